//! What of the node is chosen by a word.

use serde::{Deserialize, Serialize};

/// Where the scans come from.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LidarInput {
    /// Clouds of any driver.
    #[default]
    Points,
    /// Packets, by `velodyne_driver`.
    VelodynePackets,
    /// Packets, from the scanner itself.
    Udp,
}

/// In which unit a cloud's points tell their times.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TimeUnitChoice {
    /// In the one that makes a revolution of them.
    #[default]
    Auto,
    /// Seconds.
    S,
    /// Milliseconds.
    Ms,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
}

/// What sends the packets.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the models' own names")]
pub enum ModelChoice {
    /// What the packets say.
    #[default]
    Auto,
    Hdl32e,
    Vlp16,
    PuckHiRes,
    Vlp32c,
    Hdl64e,
}

/// Which of two echoes is taken.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EchoChoice {
    /// The strongest.
    #[default]
    Strongest,
    /// The last.
    Last,
}

/// Which points take part.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FilterChoice {
    /// All.
    #[default]
    None,
    /// Those of some rays.
    Rays,
    /// Those that are not as bright as the road: the road thesis' own.
    RoadIntensity,
    /// Those that do not lie on the ground.
    Ground,
}
