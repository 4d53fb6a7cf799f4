//! The pinhole camera with lens distortion.

use serde::{Deserialize, Serialize};

/// Lens distortion, named as `sensor_msgs/CameraInfo` names it.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub enum Distortion {
    /// Rectified already.
    #[default]
    None,
    /// `plumb_bob`: k1, k2, t1, t2, k3.
    PlumbBob([f64; 5]),
    /// `rational_polynomial`: k1, k2, t1, t2, k3, k4, k5, k6.
    Rational([f64; 8]),
}

/// A pinhole camera. A pixel's centre has whole coordinates, as OpenCV and ROS have it.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct CameraModel {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Focal length in columns.
    pub fx_px: f64,
    /// Focal length in rows.
    pub fy_px: f64,
    /// Column of the principal point.
    pub cx_px: f64,
    /// Row of the principal point.
    pub cy_px: f64,
    /// Lens distortion.
    pub distortion: Distortion,
}
