//! How far the platform has gone, by its wheels.

use estimation::perturbation::left::adjoint;
use geometry::Stamp;
use nalgebra::{Isometry3, Matrix6, Vector3};

use super::{KnownPose, MotionConfig, NoPrediction, by_std_devs, finite, interval_s};
use crate::solve::PoseGuess;

/// The poses of wheel odometry at two moments.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct WheelStep {
    /// The platform (x forward, z up) at the last pose's stamp, in the frame of the odometry.
    pub odom_from_base_before: Isometry3<f64>,
    /// At the stamp of the prediction.
    pub odom_from_base_now: Isometry3<f64>,
    /// Where the camera is on the platform.
    pub camera_from_base: Isometry3<f64>,
}

/// The pose at a stamp, by the wheels' motion since the last pose.
///
/// # Errors
/// When the stamps do not grow or lie too far apart, and for numbers that are not finite.
pub fn by_wheels(
    last: &KnownPose,
    step: &WheelStep,
    at: Stamp,
    config: &MotionConfig,
) -> Result<PoseGuess, NoPrediction> {
    interval_s(last.stamp, at, config.max_gap_s)?;
    let now_from_before = step.odom_from_base_now.inverse() * step.odom_from_base_before;
    let next_from_last = step.camera_from_base * now_from_before * step.camera_from_base.inverse();
    let travelled_m = now_from_before.translation.vector.norm();
    let turn_rad = now_from_before.rotation.angle();
    let about_up = config.wheel_noise_turn * turn_rad;
    let in_base = by_std_devs(
        &Vector3::new(
            config.wheel_noise_along * travelled_m,
            config.wheel_noise_across * travelled_m,
            config.heave_m,
        ),
        &Vector3::new(
            config.tilt_rad,
            config.tilt_rad,
            about_up.hypot(config.wheel_noise_rad_per_m * travelled_m),
        ),
    );
    let carried = |motion: &Isometry3<f64>, covariance: &Matrix6<f64>| {
        let matrix = adjoint(motion);
        matrix * covariance * matrix.transpose()
    };
    let covariance =
        carried(&next_from_last, &last.covariance) + carried(&step.camera_from_base, &in_base);
    finite(next_from_last * last.camera_from_map, covariance)
}
