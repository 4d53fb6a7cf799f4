//! The rig that recordings are read into.

use geometry::RigMounts;
use nalgebra::Isometry3;

/// The optical frame in the rig frame as the pipeline has it by default, so that what is imported is read
/// back as it was meant.
pub fn rig_from_camera() -> Isometry3<f64> {
    RigMounts::default().rig_from_camera
}
