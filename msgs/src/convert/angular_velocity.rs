//! How fast an inertial unit turns.

use nalgebra::Vector3;

use super::ConvertError;
use crate::sensor_msgs::Imu;

/// The first element of a covariance where there is no such measurement, by the comments of `sensor_msgs/msg/Imu`.
const NOT_MEASURED: f64 = -1.0;

/// The angular velocity in the axes of the unit, in rad/s.
///
/// # Errors
/// When the unit has no gyroscope, or the numbers are not finite.
pub fn angular_velocity_from_message(message: &Imu) -> Result<Vector3<f64>, ConvertError> {
    if message.angular_velocity_covariance.first() == Some(&NOT_MEASURED) {
        return Err(ConvertError::NoAngularVelocity);
    }
    let crate::geometry_msgs::Vector3 { x, y, z } = message.angular_velocity;
    if [x, y, z].iter().all(|value| value.is_finite()) {
        Ok(Vector3::new(x, y, z))
    } else {
        Err(ConvertError::AngularVelocity { x_rad_per_s: x, y_rad_per_s: y, z_rad_per_s: z })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angular_velocity_that_was_not_measured_is_none() {
        let mut message = Imu::default();
        message.angular_velocity.z = 0.5;
        assert_eq!(angular_velocity_from_message(&message), Ok(Vector3::new(0.0, 0.0, 0.5)));
        message.angular_velocity_covariance[0] = -1.0;
        let refused = angular_velocity_from_message(&message);
        assert_eq!(refused, Err(ConvertError::NoAngularVelocity));
        message.angular_velocity_covariance[0] = 0.0;
        message.angular_velocity.x = f64::NAN;
        assert!(angular_velocity_from_message(&message).is_err());
    }
}
