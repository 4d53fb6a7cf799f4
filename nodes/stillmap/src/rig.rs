//! The rig that recordings are read into.

use std::f64::consts::FRAC_PI_2;

use geometry::pose_from_vector;
use nalgebra::Isometry3;

/// The optical frame (x right, y down, z forward) in the rig frame (x forward, y left, z up), REP-103.
pub(crate) fn rig_from_camera() -> Isometry3<f64> {
    pose_from_vector(&[0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2])
}
