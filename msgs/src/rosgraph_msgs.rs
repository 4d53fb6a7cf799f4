//! `rosgraph_msgs`: the time of a simulation or of a recording.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Time;

/// The time of a simulation or of a recording that is played.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Clock {
    /// The time.
    pub clock: Time,
}
ros_message!(Clock, "rosgraph_msgs");
