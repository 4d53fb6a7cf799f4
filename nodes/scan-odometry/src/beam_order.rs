//! The order in which a scanner measures.

use serde::{Deserialize, Serialize};

/// The order in which a scanner measures the beams of its message.
///
/// `LaserScan` defines `time_increment` as the time from a beam to the next, but the common drivers of scanners that
/// turn clockwise (`rplidar_ros`) turn the readings round and leave the increment positive.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BeamOrder {
    /// Not known: every beam is taken for measured in the middle of the turn. All scans are then skewed alike while
    /// the platform moves evenly, and little is lost; while it speeds up or turns, some is.
    #[default]
    Unknown,
    /// The first beam of the message is the first that was measured (REP-138).
    FirstToLast,
    /// The last beam of the message is the first that was measured.
    LastToFirst,
}
