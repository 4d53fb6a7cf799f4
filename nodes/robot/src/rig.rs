//! The rig of imported recordings.

use geometry::RigMounts;
use nalgebra::Isometry3;

/// The optical frame in the rig frame, as the pipeline has it by default, so that the pipeline reads imported bags correctly.
pub fn rig_from_camera() -> Isometry3<f64> {
    RigMounts::default().rig_from_camera
}
