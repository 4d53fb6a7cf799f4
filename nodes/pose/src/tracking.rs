//! From frame to frame: where the camera is.
//!
//! A step of [`Tracker`] is PL-SLAM's tracking (section 2.3) without its keyframes: the motion so far, a gyroscope or wheels predict
//! the camera's pose; landmarks are searched for where they should be seen from there; the inliers give
//! the pose; they are searched for again, closer to where they must be; points and lines together give the final pose.
//! Features that are no landmarks yet become landmarks.

mod config;
mod history;
mod readout;
mod relocalisation;
mod result;
mod sighting;
mod statuses;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
mod tracker;

pub use config::{FollowConfig, TrackerConfig};
pub use readout::Readout;
pub use result::{CameraPose, FeatureStatus, StaticFeatures, Tracked, TrackingState, Trouble};
pub use tracker::{Hints, Tracker};
