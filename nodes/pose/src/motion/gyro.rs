//! How far the camera has turned, by a gyroscope.

use geometry::Stamp;
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use super::{MotionConfig, NoPrediction, finite, interval_s};
use crate::solve::PoseGuess;

/// A reading of a gyroscope.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GyroSample {
    /// When.
    pub stamp: Stamp,
    /// The angular velocity along the axes of the camera frame, less the bias: an IMU's own axes are turned to them
    /// beforehand.
    pub rate_rad_per_s: Vector3<f64>,
}

/// A turn of the camera.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Turn {
    /// Takes directions of the camera at the end to those at the beginning.
    pub begin_from_end: UnitQuaternion<f64>,
    /// Its covariance about the axes of the camera frame.
    pub covariance: Matrix3<f64>,
}

/// Integrates the samples over an interval. Between samples the rate changes evenly; outside of them it stays, for half a sample's
/// distance at most. Samples must be in order.
///
/// # Errors
/// When the interval or the order of the samples goes back in time or has a gap, or a number is not finite.
pub fn integrated_turn(
    samples: &[GyroSample],
    from: Stamp,
    to: Stamp,
    config: &MotionConfig,
) -> Result<Turn, NoPrediction> {
    let whole_s = interval_s(from, to, config.max_gap_s)?;
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Err(NoPrediction::NotCovered { missing_s: whole_s });
    };
    let mut turn = UnitQuaternion::identity();
    let mut last_stamp = first.stamp;
    for pair in samples.windows(2) {
        let [one, other] = [pair[0], pair[1]];
        let apart_s = other.stamp.seconds_since(one.stamp);
        if apart_s <= 0.0 {
            return Err(NoPrediction::TimeWentBack { by_s: -apart_s });
        }
        last_stamp = other.stamp;
        let (begin, end) = (one.stamp.max(from), other.stamp.min(to));
        let span_s = end.seconds_since(begin);
        if span_s > 0.0 {
            // The rate in the middle of what is used: exact for an even change about one axis.
            let middle_s = begin.seconds_since(one.stamp) + 0.5 * span_s;
            let rate = one.rate_rad_per_s.lerp(&other.rate_rad_per_s, middle_s / apart_s);
            turn *= UnitQuaternion::from_scaled_axis(rate * span_s);
        }
    }
    let typical_s = last_stamp.seconds_since(first.stamp) / (samples.len() - 1).max(1) as f64;
    let missing = |span_s: f64| span_s.max(0.0);
    let before_s = missing(first.stamp.min(to).seconds_since(from));
    let after_s = missing(to.seconds_since(last.stamp.max(from)));
    if before_s > 0.5 * typical_s || after_s > 0.5 * typical_s {
        return Err(NoPrediction::NotCovered { missing_s: before_s + after_s });
    }
    let turn = UnitQuaternion::from_scaled_axis(first.rate_rad_per_s * before_s)
        * turn
        * UnitQuaternion::from_scaled_axis(last.rate_rad_per_s * after_s);
    if !turn.coords.iter().all(|value| value.is_finite()) {
        return Err(NoPrediction::NotFinite);
    }
    let variance = config.gyro_noise_rad_per_sqrt_s.powi(2) * whole_s
        + (config.gyro_bias_rad_per_s * whole_s).powi(2);
    Ok(Turn { begin_from_end: turn, covariance: variance * Matrix3::identity() })
}

/// A prediction with its turn since the last pose replaced by the gyroscope's. Shifts stay as they were predicted.
///
/// # Errors
/// When a number is not finite.
pub fn turned(
    prediction: &PoseGuess,
    last: &super::KnownPose,
    turn: &Turn,
) -> Result<PoseGuess, NoPrediction> {
    let next_from_last = prediction.camera_from_map * last.camera_from_map.inverse();
    let rotation = turn.begin_from_end.inverse();
    // The position of the new camera in the last one is the predicted translation.
    let in_last = next_from_last.inverse().translation.vector;
    let shift = Translation3::from(-(rotation * in_last));
    let next_from_last = Isometry3::from_parts(shift, rotation);
    let mut covariance = prediction.covariance.unwrap_or(last.covariance);
    let carried = rotation.to_rotation_matrix().into_inner();
    let of_last: Matrix3<f64> = last.covariance.fixed_view::<3, 3>(3, 3).into_owned();
    let of_turn = carried * of_last * carried.transpose() + turn.covariance;
    // A turn that is now known by itself has nothing to do with the shift any more.
    covariance.fixed_view_mut::<3, 3>(0, 3).fill(0.0);
    covariance.fixed_view_mut::<3, 3>(3, 0).fill(0.0);
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&of_turn);
    finite(next_from_last * last.camera_from_map, covariance)
}
