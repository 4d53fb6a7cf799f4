//! Where the 2D scanner is on the rig: its pose is right when the scan lies on the surfaces that the depth
//! camera sees. And the calibration of a camera as ROS writes it to a file.
//!
//! | module | step |
//! |---|---|
//! | [`returns`] | a scan's returns, each with how the rig moved between it and the image |
//! | [`static_returns`] | which returns are of static surfaces: those that other cycles have too |
//! | [`optics`] | what the depth image shows where a return is projected: a plane, or the edge of something near |
//! | [`constraint`] | the distance of a return from there, and how it changes with the scanner's pose |
//! | `repeated` | which of these recur from cycle to cycle: those that appear by chance are biased |
//! | [`fit`] | the correction that makes these distances small; directions that the bag does not determine are held |
//! | [`mod@calibrate`] | all of them in turn, until the pose converges |
//! | [`drift`] | the same for the last seconds of a live run: has the scanner moved on its mount? |
//! | [`camera_file`] | camera_info YAML (`camera_calibration`, `camera_info_manager`) |
//! | [`reprojection`] | the reprojection error of a camera, and what it comes to in metres (Rec-HV Annex 1) |
//!
//! # Frames
//!
//! Those of the crate `geometry`. A correction is six numbers `[x, y, z, about x, about y, about z]` in metres
//! and radians: the scanner's origin is moved along the axes of the rig, and the scanner is turned about axes through
//! its own origin that are parallel to the rig's.
//!
//! No ROS, no files, no clock.
//!
//! ```
//! use calibration::calibrate::RigMounts;
//! use geometry::pose_from_vector;
//! use nalgebra::{Point3, Vector6};
//! use std::f64::consts::FRAC_PI_2;
//!
//! // The scanner is 5 cm below the camera; a correction moves it 2 cm forward.
//! let mounts = RigMounts {
//!     rig_from_camera: pose_from_vector(&[0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2]),
//!     rig_from_lidar: pose_from_vector(&[0.0, 0.0, -0.05, 0.0, 0.0, 0.0]),
//! };
//! let corrected = mounts.corrected(&Vector6::new(0.02, 0.0, 0.0, 0.0, 0.0, 0.0));
//!
//! // A return 1 m ahead, in the optical frame: x right, y down, z forward.
//! let at_rest = pose_from_vector(&[0.0; 6]);
//! let point_in_camera = corrected.camera_from_lidar(&at_rest) * Point3::new(1.0, 0.0, 0.0);
//! assert!((point_in_camera - Point3::new(0.0, 0.05, 1.02)).norm() < 1e-9);
//! ```

pub mod calibrate;
pub mod camera_file;
pub mod config;
pub mod constraint;
pub mod drift;
pub mod fit;
pub mod observability;
pub mod optics;
mod repeated;
pub mod reprojection;
pub mod returns;
pub mod static_returns;
#[cfg(test)]
mod testing;

pub use calibrate::{
    Calibration, CalibrationError, CoordinateEstimate, Cycle, RigMounts, calibrate,
};
pub use config::CalibrationConfig;
pub use drift::{DriftConfig, DriftMonitor, Extrinsics};
pub use observability::{Coordinate, Direction};
pub use optics::DepthOptics;
pub use returns::{LidarReturn, returns_of};
