//! Absolute trajectory error: how far the aligned estimate is from the reference, pair by pair (Sturm et al.
//! 2012, section IV.B).

use geometry::Stamp;
use nalgebra::Isometry3;
use serde::Serialize;

use super::statistics::Statistics;

/// What the absolute errors of a trajectory come to.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct AbsoluteScore {
    /// Of the positions.
    pub translation_m: Statistics,
    /// Of the rotations, by the angle of the turn between them; absent where the alignment leaves the turn open.
    pub rotation_deg: Option<Statistics>,
}

/// A pair of poses in the frame of the reference, with its errors.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MatchedPose {
    /// The reference's stamp; absent where frames are counted.
    pub stamp: Option<Stamp>,
    /// Seconds since the first stamp of the reference, or the number of the frame.
    pub at: f64,
    /// The aligned estimate.
    pub estimate: Isometry3<f64>,
    /// The reference.
    pub reference: Isometry3<f64>,
    /// The distance between the two.
    pub translation_m: f64,
    /// The angle of the turn from one to the other.
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

/// The score of the pairs; none where there is no pair.
pub(super) fn score(pairs: &[MatchedPose], rotation_is_determined: bool) -> Option<AbsoluteScore> {
    let of = |error: fn(&MatchedPose) -> f64| {
        Statistics::of(&pairs.iter().map(error).collect::<Vec<f64>>())
    };
    Some(AbsoluteScore {
        translation_m: of(|pair| pair.translation_m)?,
        rotation_deg: of(|pair| pair.rotation_deg).filter(|_| rotation_is_determined),
    })
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
}
