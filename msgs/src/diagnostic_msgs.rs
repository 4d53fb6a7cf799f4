//! `diagnostic_msgs`: how the parts of a robot do.

use serde::{Deserialize, Serialize};

use crate::std_msgs::Header;

/// A value that has a name.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct KeyValue {
    /// The name.
    pub key: String,
    /// The value.
    pub value: String,
}
ros_message!(KeyValue, "diagnostic_msgs");

/// How one part of a robot does.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// One of the levels, for instance [`DiagnosticStatus::WARN`].
    pub level: u8,
    /// The part that reports.
    pub name: String,
    /// How it does, in words.
    pub message: String,
    /// The device, by its own name.
    pub hardware_id: String,
    /// Figures.
    pub values: Vec<KeyValue>,
}
ros_message!(DiagnosticStatus, "diagnostic_msgs", {
    /// All is well.
    OK: u8 = 0,
    /// Something needs attention.
    WARN: u8 = 1,
    /// Something does not work.
    ERROR: u8 = 2,
    /// Nothing was heard for a while.
    STALE: u8 = 3,
});

impl DiagnosticStatus {
    /// The value of this name; `None` where there is none.
    pub fn value(&self, key: &str) -> Option<&str> {
        self.values.iter().find(|pair| pair.key == key).map(|pair| pair.value.as_str())
    }
}

/// How parts of a robot do.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// The moment; the frame is not used.
    pub header: Header,
    /// One entry for each part.
    pub status: Vec<DiagnosticStatus>,
}
ros_message!(DiagnosticArray, "diagnostic_msgs");

impl DiagnosticArray {
    /// What the part of this name says of itself; `None` where the array is of others.
    pub fn part(&self, name: &str) -> Option<&DiagnosticStatus> {
        self.status.iter().find(|status| status.name == name)
    }
}
