//! The camera goes on as it did.

use estimation::perturbation::left::adjoint;
use geometry::Stamp;
use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3};

use super::{KnownPose, MotionConfig, NoPrediction, by_std_devs, finite, interval_s};
use crate::solve::PoseGuess;

/// Turns below this are straight ahead: their series has no more digits.
const STRAIGHT_RAD: f64 = 1e-6;

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

/// A share of a motion, or more than all of it, at a constant velocity of the body: the exponential of the share of its
/// logarithm (Sola et al. 2018, "A micro Lie theory", eq. 172 to 174).
pub(super) fn part_of_motion(motion: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    let turn = motion.rotation.scaled_axis();
    // What a constant velocity would lead to over a turn, and back.
    let straight = swept(&turn).try_inverse().unwrap_or_else(Matrix3::identity);
    let velocity = straight * motion.translation.vector;
    let part = share * turn;
    let translation = swept(&part) * (share * velocity);
    Isometry3::from_parts(Translation3::from(translation), UnitQuaternion::from_scaled_axis(part))
}

/// The mean rotation over a turn: the left Jacobian of SO(3).
fn swept(turn: &Vector3<f64>) -> Matrix3<f64> {
    let angle = turn.norm();
    let cross = turn.cross_matrix();
    if angle < STRAIGHT_RAD {
        return Matrix3::identity() + 0.5 * cross;
    }
    let square = angle * angle;
    Matrix3::identity()
        + (1.0 - angle.cos()) / square * cross
        + (angle - angle.sin()) / (square * angle) * cross * cross
}
