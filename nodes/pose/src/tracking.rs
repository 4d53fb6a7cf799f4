//! From frame to frame: where the camera is.
//!
//! A step of [`Tracker`] is PL-SLAM's tracking (section 2.3) without its keyframes: the motion so far, a gyroscope or wheels say
//! where the camera should be; landmarks are looked for where they should be seen from there; what of them agrees gives
//! the pose; they are looked for again, closer to where they must be; points and lines together give the final pose.
//! What of a frame is no landmark yet becomes one.

mod config;
mod fates;
mod history;
mod readout;
mod relocalisation;
mod result;
mod sighting;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
mod tracker;

pub use config::{FollowConfig, TrackerConfig};
pub use readout::Readout;
pub use result::{CameraPose, Fate, Room, Tracked, TrackingState, Trouble};
pub use tracker::{Hints, Tracker};
