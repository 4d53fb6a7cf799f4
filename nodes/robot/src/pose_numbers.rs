//! Poses on the command line, in the order of static_transform_publisher.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use crate::failure::Failure;

/// A pose of X Y Z ROLL PITCH YAW, in metres and radians. `option` is the option that they were given with.
///
/// # Errors
/// When they are not six finite numbers.
pub(crate) fn pose_of_numbers(option: &str, numbers: &[f64]) -> Result<Isometry3<f64>, Failure> {
    match *numbers {
        [x, y, z, roll, pitch, yaw] if numbers.iter().all(|number| number.is_finite()) => {
            Ok(Isometry3::from_parts(
                Translation3::new(x, y, z),
                UnitQuaternion::from_euler_angles(roll, pitch, yaw),
            ))
        }
        _ => Err(Failure::new(format!("{option} takes six finite numbers: X Y Z ROLL PITCH YAW"))),
    }
}
