//! The covariance of a step, and of the pose since the start.
//!
//! A pose is measured against the map, so its error has two parts: that of the match, new in every scan, and that of
//! the map, which was left by scans with errors of their own. The second grows only as the map is renewed.

use estimation::covariance::propagated;
use nalgebra::{Isometry2, Matrix3};

use crate::observability::Observability;

/// The error of the map by the scans that made it: at worst a single one, with an error like that of the match.
const MATCHES_A_RENEWAL: f64 = 2.0;
/// The map is another when less than this share of the returns lies on what was there before.
const RENEWED_SHARE: f64 = 0.5;

/// The covariance of a pose in the frame that a motion leads to (the adjoint of its inverse; Barfoot 2017, 7.1.4).
pub(crate) fn carried(covariance: &Matrix3<f64>, step: &Isometry2<f64>) -> Matrix3<f64> {
    let back = step.inverse();
    let rotation = back.rotation.to_rotation_matrix();
    let rotation = rotation.matrix();
    let offset = back.translation.vector;
    // A turn about the old origin also shifts the new one.
    let adjoint = Matrix3::new(
        rotation.m11,
        rotation.m12,
        offset.y, //
        rotation.m21,
        rotation.m22,
        -offset.x, //
        0.0,
        0.0,
        1.0,
    );
    propagated(&adjoint, covariance)
}

/// The parts of a covariance in the directions that a match determines, and in the others. Their correlation
/// is left out.
pub(crate) fn parted(
    covariance: &Matrix3<f64>,
    observability: &Observability,
) -> (Matrix3<f64>, Matrix3<f64>) {
    let units = &observability.units;
    let (from_units, to_units) =
        (Matrix3::from_diagonal(units), Matrix3::from_diagonal(&units.map(f64::recip)));
    let within =
        |projector: Matrix3<f64>| propagated(&(from_units * projector * to_units), covariance);
    (within(observability.projector()), within(observability.weak_projector()))
}

/// The place of the map's own error: the pose where it was last renewed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Anchor {
    /// Number of the scan.
    pub(crate) scan: u64,
    odom_from_middle: Isometry2<f64>,
    /// Of x, y and yaw in the odom frame.
    covariance: Matrix3<f64>,
}

impl Anchor {
    /// A map that begins with a scan at a pose.
    pub(crate) fn new(
        scan: u64,
        odom_from_middle: Isometry2<f64>,
        covariance: Matrix3<f64>,
    ) -> Self {
        Self { scan, odom_from_middle, covariance }
    }

    /// The covariance of x, y and yaw in the odom frame, of a pose with an error of `matched` against the map, in the
    /// frame of the scanner.
    pub(crate) fn covariance_of(
        &self,
        odom_from_middle: &Isometry2<f64>,
        matched: &Matrix3<f64>,
    ) -> Matrix3<f64> {
        self.carried_to(odom_from_middle) + turned(matched, odom_from_middle)
    }

    /// Moves on when `kept_share` of the returns lie on what was there when the anchor was set.
    pub(crate) fn follow(
        &mut self,
        scan: u64,
        kept_share: f64,
        odom_from_middle: &Isometry2<f64>,
        matched: &Matrix3<f64>,
    ) {
        if kept_share < RENEWED_SHARE {
            let covariance = self.carried_to(odom_from_middle)
                + MATCHES_A_RENEWAL * turned(matched, odom_from_middle);
            *self = Self { scan, odom_from_middle: *odom_from_middle, covariance };
        }
    }

    /// An error of the anchor's yaw swings what is far from it.
    fn carried_to(&self, odom_from_middle: &Isometry2<f64>) -> Matrix3<f64> {
        let way = odom_from_middle.translation.vector - self.odom_from_middle.translation.vector;
        let swing = Matrix3::new(
            1.0, 0.0, -way.y, //
            0.0, 1.0, way.x, //
            0.0, 0.0, 1.0,
        );
        propagated(&swing, &self.covariance)
    }
}

/// A covariance in the frame of the scanner, in the axes of the odom frame.
fn turned(covariance: &Matrix3<f64>, odom_from_middle: &Isometry2<f64>) -> Matrix3<f64> {
    let rotation = odom_from_middle.rotation.to_rotation_matrix().to_homogeneous();
    propagated(&rotation, covariance)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector2, Vector3};

    use super::*;
    use crate::observability::units;
    use crate::testing::Random;
    use crate::twist::{increment, motion};

    #[test]
    fn a_carried_covariance_is_that_of_the_carried_errors() {
        let covariance = Matrix3::new(4.0, 1.0, 0.5, 1.0, 2.0, -0.3, 0.5, -0.3, 1.0) * 1e-6;
        let root = covariance.cholesky().unwrap().l();
        let step = Isometry2::new(Vector2::new(1.0, -2.0), 0.7);
        let mut random = Random::new(1);
        let mut found = Matrix3::zeros();
        for _ in 0..20_000 {
            let error = motion(&(root * Vector3::from_fn(|_, _| random.normal())));
            // The same error, seen from after the step.
            let carried = increment(&(step.inverse() * error * step));
            found += carried * carried.transpose() / 20_000.0;
        }
        let expected = carried(&covariance, &step);
        assert!((found - expected).norm() < 0.05 * expected.norm(), "{found} {expected}");
    }

    #[test]
    fn an_error_of_the_yaw_grows_with_the_distance() {
        let start = Anchor::new(0, Isometry2::identity(), Matrix3::zeros());
        let mut anchor = start;
        let matched = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1e-4));
        anchor.follow(5, 0.9, &Isometry2::identity(), &matched);
        assert_eq!(anchor, start);
        anchor.follow(6, 0.4, &Isometry2::identity(), &matched);
        assert_eq!(anchor.scan, 6);
        let far = Isometry2::new(Vector2::new(10.0, 0.0), 1.0);
        let covariance = anchor.covariance_of(&far, &Matrix3::zeros());
        assert!((covariance.m22 - 2.0 * 100.0 * 1e-4).abs() < 1e-9, "{covariance}");
        assert!((covariance.m33 - 2e-4).abs() < 1e-12);
    }

    #[test]
    fn observable_and_other_directions_are_separated() {
        let nothing = Observability::nothing(&units(3.0));
        let covariance = Matrix3::new(4.0, 1.0, 0.5, 1.0, 2.0, -0.3, 0.5, -0.3, 1.0);
        let (observed, held) = parted(&covariance, &nothing);
        assert!(observed.norm() < 1e-12 && (held - covariance).norm() < 1e-12);
        let mut x_is_observed = nothing;
        x_is_observed.directions[0].estimated = true;
        let (observed, held) = parted(&covariance, &x_is_observed);
        assert!((observed.m11 - 4.0).abs() < 1e-12 && observed.m33 == 0.0);
        assert_eq!((held.m11, held.m12), (0.0, 0.0));
        assert!((held.m23 + 0.3).abs() < 1e-12 && (held.m33 - 1.0).abs() < 1e-12);
    }
}
