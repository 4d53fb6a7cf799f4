//! Absolute trajectory error: how far the aligned estimate is from the reference, pair by pair (Sturm et al.
//! 2012, section IV.B).

use std::borrow::Cow;

use geometry::Stamp;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion};
use serde::Serialize;

use super::statistics::Statistics;

/// Quaternions whose sum is shorter than this have no mean: their rotations go in all directions.
const LEAST_SUM: f64 = 1e-9;

/// Bodies with a smaller turn between them are taken for one that is turned in error.
const LEAST_OFFSET_RAD: f64 = 0.1;
/// A turn between two bodies is constant if what is left without it is less than this share of it, in the mean square.
const CONSTANT_SHARE: f64 = 0.25;

/// The absolute errors of a trajectory.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct AbsoluteScore {
    /// Errors of the positions.
    pub translation_m: Statistics,
    /// Errors of the rotations, by the angle between them; absent when the alignment leaves the rotation open.
    pub rotation_deg: Option<Statistics>,
    /// The rotation from the reference's body frame to the estimate's that fits all poses best: two frames on one body,
    /// such as a camera and the markers of a motion capture system, differ by a constant rotation, which is not an error
    /// of the estimate.
    pub rotation_offset_deg: Option<f64>,
    /// Errors of the rotations without that constant rotation.
    pub rotation_without_offset_deg: Option<Statistics>,
}

/// A pair of poses in the frame of the reference, with its errors.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MatchedPose {
    /// The reference's stamp; absent for trajectories of frames.
    pub stamp: Option<Stamp>,
    /// Seconds since the first stamp of the reference, or the number of the frame.
    pub at: f64,
    /// The aligned estimate.
    pub estimate: Isometry3<f64>,
    /// The reference.
    pub reference: Isometry3<f64>,
    /// The distance between the two positions.
    pub translation_m: f64,
    /// The angle of the rotation between them.
    pub rotation_deg: f64,
}

impl MatchedPose {
    /// A pair with its errors.
    pub(super) fn new(
        stamp: Option<Stamp>,
        at: f64,
        estimate: Isometry3<f64>,
        reference: Isometry3<f64>,
    ) -> Self {
        let translation_m = (estimate.translation.vector - reference.translation.vector).norm();
        let rotation_deg = reference.rotation.angle_to(&estimate.rotation).to_degrees();
        Self { stamp, at, estimate, reference, translation_m, rotation_deg }
    }
}

/// The score of the pairs; `None` without pairs.
pub(super) fn score(pairs: &[MatchedPose], rotation_is_determined: bool) -> Option<AbsoluteScore> {
    let of = |error: fn(&MatchedPose) -> f64| {
        Statistics::of(&pairs.iter().map(error).collect::<Vec<f64>>())
    };
    let translation_m = of(|pair| pair.translation_m)?;
    let offset = mean_turn(pairs).filter(|_| rotation_is_determined);
    let without_offset = offset.and_then(|offset| {
        let left = |pair: &MatchedPose| offset.angle_to(&turn(pair)).to_degrees();
        Statistics::of(&pairs.iter().map(left).collect::<Vec<f64>>())
    });
    Some(AbsoluteScore {
        translation_m,
        rotation_deg: of(|pair| pair.rotation_deg).filter(|_| rotation_is_determined),
        rotation_offset_deg: offset.map(|offset| offset.angle().to_degrees()),
        rotation_without_offset_deg: without_offset,
    })
}

/// The turn from the reference's body to that of the estimate, where they are clearly two: a camera's optical axes and a robot's.
pub(super) fn turn_of_bodies(
    pairs: &[MatchedPose],
    score: &AbsoluteScore,
) -> Option<UnitQuaternion<f64>> {
    let left = score.rotation_without_offset_deg?.rmse;
    let offset = mean_turn(pairs)?;
    let is_constant = left.to_radians() < CONSTANT_SHARE * offset.angle();
    (offset.angle() >= LEAST_OFFSET_RAD && is_constant).then_some(offset)
}

/// The pairs with the estimate's body turned to that of the reference.
pub(super) fn of_one_body(
    pairs: &[MatchedPose],
    turn: Option<UnitQuaternion<f64>>,
) -> Cow<'_, [MatchedPose]> {
    let Some(turn) = turn else { return Cow::Borrowed(pairs) };
    let turned = |pair: &MatchedPose| {
        let MatchedPose { stamp, at, estimate, reference, .. } = *pair;
        MatchedPose::new(stamp, at, estimate * turn.inverse(), reference)
    };
    Cow::Owned(pairs.iter().map(turned).collect())
}

/// The rotation from the reference to the estimate, in the reference's body frame.
fn turn(pair: &MatchedPose) -> UnitQuaternion<f64> {
    pair.reference.rotation.inverse() * pair.estimate.rotation
}

/// The mean of the rotations: of their quaternions, each with the sign nearer to the first; `None` without rotations.
fn mean_turn(pairs: &[MatchedPose]) -> Option<UnitQuaternion<f64>> {
    let first = turn(pairs.first()?).into_inner();
    let nearer = |pair: &MatchedPose| {
        let turn = turn(pair).into_inner();
        if turn.dot(&first) < 0.0 { -turn } else { turn }
    };
    let sum = pairs.iter().map(nearer).fold(Quaternion::default(), |sum, turn| sum + turn);
    UnitQuaternion::try_new(sum, LEAST_SUM)
}

#[cfg(test)]
mod tests {
    use super::super::testing::pose;
    use super::*;

    #[test]
    fn a_shift_and_a_turn_are_their_own_errors() {
        let reference = pose([1.0, 2.0, 3.0], [0.3, -0.2, 0.5]);
        let turn = pose([0.0; 3], [0.0, 0.02, 0.0]).rotation;
        let mut estimate = reference;
        estimate.translation.vector.x += 0.3;
        estimate.translation.vector.z -= 0.4;
        estimate.rotation *= turn;
        let pair = MatchedPose::new(None, 0.0, estimate, reference);
        assert!((pair.translation_m - 0.5).abs() < 1e-12);
        assert!((pair.rotation_deg - 0.02_f64.to_degrees()).abs() < 1e-12);
        assert!(score(&[pair], true).unwrap().rotation_deg.is_some());
        assert!(score(&[pair], false).unwrap().rotation_deg.is_none());
        assert!(score(&[], true).is_none());
    }

    #[test]
    fn a_constant_turn_of_the_body_frame_is_taken_out() {
        let offset = pose([0.0; 3], [0.3, -0.4, 0.1]).rotation;
        let pairs: Vec<MatchedPose> = (0..20)
            .map(|index| {
                let reference =
                    pose([f64::from(index), 0.0, 0.0], [0.0, 0.1, 0.2 * f64::from(index)]);
                let error_rad = if index % 2 == 0 { 0.01 } else { -0.01 };
                let error = pose([0.0; 3], [error_rad, 0.0, 0.0]).rotation;
                let mut estimate = reference;
                estimate.rotation *= offset * error;
                MatchedPose::new(None, f64::from(index), estimate, reference)
            })
            .collect();
        let score = score(&pairs, true).unwrap();
        assert!((score.rotation_offset_deg.unwrap() - offset.angle().to_degrees()).abs() < 1e-6);
        let left = score.rotation_without_offset_deg.unwrap();
        assert!((left.max - 0.01_f64.to_degrees()).abs() < 1e-6, "{left:?}");
        assert!(score.rotation_deg.unwrap().rmse > 25.0);
    }
}
