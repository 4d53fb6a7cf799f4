//! `builtin_interfaces`: moments and spans.

use serde::{Deserialize, Serialize};

/// A moment of the clock in use.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize)]
pub struct Time {
    /// Whole seconds since the epoch, rounded towards the past.
    pub sec: i32,
    /// Nanoseconds to add to the seconds, below 10^9.
    pub nanosec: u32,
}
ros_message!(Time, "builtin_interfaces");

/// A span of time.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize)]
pub struct Duration {
    /// Whole seconds, rounded towards minus infinity.
    pub sec: i32,
    /// Nanoseconds to add to the seconds, below 10^9.
    pub nanosec: u32,
}
ros_message!(Duration, "builtin_interfaces");
