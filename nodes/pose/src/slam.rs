//! The camera in a map that stays right: tracking, mapping and loop closing put together (PL-SLAM, section 2.1).
//!
//! | module | what is in it |
//! |---|---|
//! | `session` | a frame at a time |
//! | `localiser` | the pose of the odometry in the map, and the choice of keyframes |
//! | `followed` | which landmark of the map the odometry's landmarks are |
//! | `predicted` | how often frames show the landmarks that they should |
//! | `tie` | the filter of the odometry's pose in the map |
//! | `travelled` | how far odometry has gone |
//! | `inline` | the map, in the caller's thread; the node has one that works in a thread of its own |
//! | `waypoints` | where the camera came along, as the map has it by now |
//! | `trajectory` | where the camera was, as the map has it in the end |
//! | `config` | the parameters |
//!
//! Two frames: the tracker's own, `odom`, in which the camera never jumps, and which drifts; and `map`, that of the
//! keyframes, which is corrected. What ties them, `map_from_odom`, is all that changes when a loop is closed (REP 105).
//!
//! Tracking reads a snapshot of the map and never waits for it. What it wants of the map, a frame to be kept or a lost
//! camera to be found, are requests; the answers come with the next snapshot. Inline they are there at once, and the same
//! frames give the same poses, bit for bit; in the background they come when they come.

mod config;
mod followed;
mod inline;
mod localiser;
mod predicted;
mod session;
#[cfg(test)]
mod tests;
mod tie;
mod trajectory;
mod travelled;
mod waypoints;

pub use config::{LocaliserConfig, SlamConfig, SlamConfigError};
pub use inline::InlineMapping;
#[cfg(feature = "ros")]
pub(crate) use inline::answered;
pub use localiser::{Localised, MapState};
pub use predicted::Predicted;
pub use session::{Slam, SlamFrame};
pub use trajectory::{Trajectory, TrajectoryPose};

use std::sync::Arc;

use geometry::CameraModel;
use nalgebra::Isometry3;

use crate::frame::Frame;
use crate::map::{ByOdometry, LineId, Map, MapError, PointId};
use crate::mapping::MappingStep;

/// The map, and its mapper.
pub trait Mapping {
    /// The map as of the last answers that were taken.
    fn map(&self) -> Arc<Map>;

    /// Whether nothing is being worked on, and nothing waits.
    fn is_idle(&self) -> bool;

    /// Requests work. Requests are processed in their order.
    fn ask(&mut self, request: Request);

    /// The answers since the last call, in the order of the requests; the map is as it was after it from then on.
    fn answers(&mut self) -> Vec<Done>;
}

/// A request to the mapper.
#[derive(Clone, Debug)]
pub enum Request {
    /// A frame is to be kept.
    Keep(Box<Kept>),
    /// A camera is to be found.
    Find {
        /// Its features.
        frame: Arc<Frame>,
        /// The rectified camera.
        camera: CameraModel,
    },
}

/// A frame that is to be kept.
#[derive(Clone, Debug)]
pub struct Kept {
    /// The rectified camera.
    pub camera: CameraModel,
    /// Where it was.
    pub camera_from_map: Isometry3<f64>,
    /// Its features on the static scene.
    pub frame: Arc<Frame>,
    /// Which corners are which points.
    pub points: Vec<(usize, PointId)>,
    /// Which segments are which lines.
    pub lines: Vec<(usize, LineId)>,
    /// The landmarks that the frames since the last request should have seen, and whether they have.
    pub predicted: Predicted,
    /// Its pose by odometry.
    pub by_odometry: Option<ByOdometry>,
}

/// The outcome of a request.
#[derive(Clone, Debug)]
pub enum Done {
    /// A frame was kept, or could not be.
    Kept(Result<MappingStep, MapError>),
    /// A camera was looked for.
    Found {
        /// Its features.
        frame: Arc<Frame>,
        /// The rectified camera.
        camera: CameraModel,
        /// Where it was; `None` where it was not found.
        camera_from_map: Option<Isometry3<f64>>,
    },
}
