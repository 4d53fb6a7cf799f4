//! The camera moves at constant velocity.

use estimation::perturbation::left::adjoint;
use estimation::twist::part_of_motion;
use geometry::Stamp;
use nalgebra::{Matrix6, Vector3};

use super::{KnownPose, MotionConfig, NoPrediction, by_std_devs, finite, interval_s};
use crate::solve::PoseGuess;

/// The pose at a stamp, by the motion between the last two poses: the same screw at the same rate.
///
/// The covariance holds what both poses are off by, and what the velocity may have become: an acceleration changes it
/// between the middle of the known interval and the middle of the predicted one.
///
/// # Errors
/// When the stamps do not grow or lie too far apart, and without a pose before the last one.
pub fn constant_velocity(
    before: Option<&KnownPose>,
    last: &KnownPose,
    at: Stamp,
    config: &MotionConfig,
) -> Result<PoseGuess, NoPrediction> {
    let ahead_s = interval_s(last.stamp, at, config.max_gap_s)?;
    let before = before.ok_or(NoPrediction::NoVelocity)?;
    let passed_s = interval_s(before.stamp, last.stamp, config.max_gap_s)?;
    let share = ahead_s / passed_s;
    let last_from_before = last.camera_from_map * before.camera_from_map.inverse();
    let next_from_last = part_of_motion(&last_from_before, share);
    // The error of the last pose goes into the step as well, that of the one before only there.
    let of_last = adjoint(&next_from_last);
    let of_before = of_last * adjoint(&last_from_before);
    let carried =
        |matrix: &Matrix6<f64>, covariance: &Matrix6<f64>| matrix * covariance * matrix.transpose();
    let known = (1.0 + share).powi(2) * carried(&of_last, &last.covariance)
        + share * share * carried(&of_before, &before.covariance);
    let lever_s2 = 0.5 * (passed_s + ahead_s) * ahead_s;
    let unknown = by_std_devs(
        &Vector3::repeat(config.acceleration_m_per_s2 * lever_s2),
        &Vector3::repeat(config.acceleration_rad_per_s2 * lever_s2),
    );
    finite(next_from_last * last.camera_from_map, known + unknown)
}
