//! The rig that recordings are read into.

use detection::DetectionConfig;
use geometry::pose_from_vector;
use nalgebra::Isometry3;

/// The optical frame in the rig frame as detection has it by default, so that what is imported is read
/// back as it was meant.
pub fn rig_from_camera() -> Isometry3<f64> {
    pose_from_vector(&DetectionConfig::default().rig_from_camera)
}
