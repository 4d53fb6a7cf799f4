//! The IMU and the wheel odometry.

use super::{Checked, check_pose, not_negative, number, rate};
use crate::{Imu, Wheels};

pub(super) fn check_imu(imu: &Imu) -> Checked {
    check_pose(&imu.rig_from_imu, "the inertial unit")?;
    rate("imu.rate_hz", imu.rate_hz)?;
    not_negative("imu.gyro_noise", imu.gyro_noise)?;
    not_negative("imu.accelerometer_noise", imu.accelerometer_noise)?;
    not_negative("imu.gyro_bias_walk", imu.gyro_bias_walk)?;
    not_negative("imu.accelerometer_bias_walk", imu.accelerometer_bias_walk)?;
    not_negative("imu.gyro_bias", imu.gyro_bias)?;
    not_negative("imu.accelerometer_bias", imu.accelerometer_bias)?;
    number("imu.response_s", imu.response_s, |v| (1e-4..=1.0).contains(&v), "0.0001 to 1")
}

pub(super) fn check_wheels(wheels: &Wheels) -> Checked {
    rate("wheels.rate_hz", wheels.rate_hz)?;
    not_negative("wheels.scale_error", wheels.scale_error)?;
    not_negative("wheels.turn_scale_error", wheels.turn_scale_error)?;
    not_negative("wheels.noise_m_per_root_m", wheels.noise_m_per_root_m)?;
    not_negative("wheels.turn_noise_rad_per_root_m", wheels.turn_noise_rad_per_root_m)?;
    not_negative("wheels.turn_noise_rad_per_root_rad", wheels.turn_noise_rad_per_root_rad)
}
