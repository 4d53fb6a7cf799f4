//! The transform from the frame of an estimate to that of its reference.
//!
//! The least squares solution over pairs of positions is Umeyama's (1991, Least-Squares Estimation of
//! Transformation Parameters Between Two Point Patterns, eq. 34 to 43); the one that may turn about the
//! vertical only is that of Zhang and Scaramuzza 2018, section III.C.

use nalgebra::{Isometry3, Matrix3, Rotation3, SVD, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// The least ratio of the second singular value to the first of the covariance of the positions: below it their spread
/// across a line is less than a thousandth of that along it, and the rotation about the line is undetermined.
const LEAST_SPREAD: f64 = 1e-6;
/// Positions whose mean square distance from their centre is below this (that of a micrometre) do not move.
const LEAST_VARIANCE_M2: f64 = 1e-12;
/// The most iterations of the decomposition of a 3x3 matrix; ten are usual.
const MOST_SVD_ROUNDS: usize = 1000;

/// How an estimate is aligned with its reference before they are compared.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Alignment {
    /// Not at all: both are in one frame.
    None,
    /// The first pair's poses are made the same.
    Origin,
    /// Translated and rotated about the z axis: for sensors that measure gravity.
    Yaw,
    /// Translated and rotated, as in the TUM benchmark.
    #[default]
    Se3,
    /// Translated, rotated and scaled: for a monocular camera, whose scale is free.
    Sim3,
}

/// The transform found.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct FoundAlignment {
    /// The kind of alignment.
    pub alignment: Alignment,
    /// Metres of the reference per metre of the estimate.
    pub scale: f64,
    /// The rotation, applied before the translation.
    #[serde(skip)]
    pub reference_from_estimate: UnitQuaternion<f64>,
    /// The same as x, y, z, w.
    pub rotation_xyzw: [f64; 4],
    /// The translation.
    pub translation_m: [f64; 3],
    /// Whether the positions determine the rotation. On a line they do not, and errors of the rotation are meaningless.
    pub rotation_is_determined: bool,
}

/// No transform can be found.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum AlignmentError {
    /// The estimate does not move.
    #[error(
        "the estimate does not move (its positions spread by {spread_m:.1e} m): its scale cannot be determined"
    )]
    NoScale {
        /// The root of the mean square of its positions from their centre.
        spread_m: f64,
    },
    /// The decomposition does not converge: the numbers are too large.
    #[error("the positions are too large to be aligned")]
    OutOfRange,
}

impl FoundAlignment {
    /// A pose of the estimate in the frame of the reference.
    #[must_use]
    pub fn apply(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let turn = self.reference_from_estimate;
        let place_m =
            turn * (pose.translation.vector * self.scale) + Vector3::from(self.translation_m);
        Isometry3::from_parts(Translation3::from(place_m), turn * pose.rotation)
    }

    fn new(
        alignment: Alignment,
        scale: f64,
        reference_from_estimate: UnitQuaternion<f64>,
        translation_m: Vector3<f64>,
    ) -> Self {
        let numbers = reference_from_estimate.quaternion();
        Self {
            alignment,
            scale,
            reference_from_estimate,
            rotation_xyzw: [numbers.i, numbers.j, numbers.k, numbers.w],
            translation_m: translation_m.into(),
            rotation_is_determined: true,
        }
    }
}

/// A pose of the estimate and the one of the reference.
type PosePair = (Isometry3<f64>, Isometry3<f64>);

/// The transform for pairs of poses, at least one.
pub(super) fn align(
    alignment: Alignment,
    pairs: &[PosePair],
) -> Result<FoundAlignment, AlignmentError> {
    match (alignment, pairs.first()) {
        (Alignment::None, _) | (_, None) => {
            let nothing = Vector3::zeros();
            Ok(FoundAlignment::new(alignment, 1.0, UnitQuaternion::identity(), nothing))
        }
        (Alignment::Origin, Some((estimate, reference))) => {
            let found = reference * estimate.inverse();
            Ok(FoundAlignment::new(alignment, 1.0, found.rotation, found.translation.vector))
        }
        (Alignment::Yaw, _) => Ok(Moments::of(pairs).yaw()),
        (Alignment::Se3, _) => Moments::of(pairs).umeyama(alignment, false),
        (Alignment::Sim3, _) => Moments::of(pairs).umeyama(alignment, true),
    }
}

/// The moments of the positions that the alignment needs.
struct Moments {
    estimate_centre_m: Vector3<f64>,
    reference_centre_m: Vector3<f64>,
    /// The mean square of the estimate's positions from their centre, eq. 36.
    estimate_variance_m2: f64,
    /// Rows are axes of the reference, columns of the estimate, eq. 38.
    covariance_m2: Matrix3<f64>,
}

impl Moments {
    fn of(pairs: &[PosePair]) -> Self {
        let count = pairs.len() as f64;
        let centre_m =
            |of: fn(&PosePair) -> Vector3<f64>| pairs.iter().map(of).sum::<Vector3<f64>>() / count;
        let estimate_centre_m = centre_m(|pair| pair.0.translation.vector);
        let reference_centre_m = centre_m(|pair| pair.1.translation.vector);
        let (mut estimate_variance_m2, mut covariance_m2) = (0.0, Matrix3::zeros());
        for (estimate, reference) in pairs {
            let estimate_m = estimate.translation.vector - estimate_centre_m;
            let reference_m = reference.translation.vector - reference_centre_m;
            estimate_variance_m2 += estimate_m.norm_squared() / count;
            covariance_m2 += reference_m * estimate_m.transpose() / count;
        }
        Self { estimate_centre_m, reference_centre_m, estimate_variance_m2, covariance_m2 }
    }

    fn umeyama(
        &self,
        alignment: Alignment,
        with_scale: bool,
    ) -> Result<FoundAlignment, AlignmentError> {
        let svd = SVD::try_new(self.covariance_m2, true, true, f64::EPSILON, MOST_SVD_ROUNDS)
            .ok_or(AlignmentError::OutOfRange)?;
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Err(AlignmentError::OutOfRange) };
        // Eq. 39 and 43: the least axis is turned round where the best match would be a mirror image.
        let sign = if u.determinant() * v_t.determinant() < 0.0 { -1.0 } else { 1.0 };
        let signs = Vector3::new(1.0, 1.0, sign);
        let rotation = Rotation3::from_matrix_unchecked(u * Matrix3::from_diagonal(&signs) * v_t);
        let scale = if with_scale {
            if self.estimate_variance_m2 < LEAST_VARIANCE_M2 {
                return Err(AlignmentError::NoScale { spread_m: self.estimate_variance_m2.sqrt() });
            }
            svd.singular_values.dot(&signs) / self.estimate_variance_m2
        } else {
            1.0
        };
        let turn = UnitQuaternion::from_rotation_matrix(&rotation);
        let found = self.placed(alignment, scale, UnitQuaternion::from_quaternion(*turn));
        let [first, second] = [svd.singular_values[0], svd.singular_values[1]];
        let rotation_is_determined = first > LEAST_VARIANCE_M2 && second > LEAST_SPREAD * first;
        Ok(FoundAlignment { rotation_is_determined, ..found })
    }

    fn yaw(&self) -> FoundAlignment {
        let covariance_m2 = &self.covariance_m2;
        let sine = covariance_m2[(1, 0)] - covariance_m2[(0, 1)];
        let cosine = covariance_m2[(0, 0)] + covariance_m2[(1, 1)];
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), sine.atan2(cosine));
        let rotation_is_determined = sine.hypot(cosine) > LEAST_VARIANCE_M2;
        FoundAlignment { rotation_is_determined, ..self.placed(Alignment::Yaw, 1.0, turn) }
    }

    /// Eq. 41: the centres fall together.
    fn placed(
        &self,
        alignment: Alignment,
        scale: f64,
        turn: UnitQuaternion<f64>,
    ) -> FoundAlignment {
        let translation_m = self.reference_centre_m - turn * (self.estimate_centre_m * scale);
        FoundAlignment::new(alignment, scale, turn, translation_m)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::testing::{pose, walk};
    use super::*;

    type Pairs = Vec<PosePair>;

    /// The walk, and a translated, rotated and scaled-down copy.
    fn moved(turn_rad: [f64; 3], scale: f64) -> (FoundAlignment, Pairs) {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(turn_rad));
        let truth =
            FoundAlignment::new(Alignment::Sim3, scale, turn, Vector3::new(3.0, -20.0, 0.7));
        (truth, walk(60).into_iter().map(|pose| (pose, truth.apply(&pose))).collect())
    }

    fn sum_of_squares_m2(found: &FoundAlignment, pairs: &Pairs) -> f64 {
        pairs
            .iter()
            .map(|(estimate, reference)| {
                let at = found.apply(estimate).translation.vector;
                (at - reference.translation.vector).norm_squared()
            })
            .sum()
    }

    fn assert_same(found: &FoundAlignment, truth: &FoundAlignment) {
        assert!((found.scale - truth.scale).abs() < 1e-12, "{found:?}");
        assert!(found.reference_from_estimate.angle_to(&truth.reference_from_estimate) < 1e-12);
        let shift_m = Vector3::from(found.translation_m) - Vector3::from(truth.translation_m);
        assert!(shift_m.norm() < 1e-11, "{found:?}");
        assert!(found.rotation_is_determined);
    }

    #[test]
    fn a_known_transform_is_found_again() {
        let (truth, pairs) = moved([0.3, -2.0, 1.1], 1.7);
        assert_same(&align(Alignment::Sim3, &pairs).unwrap(), &truth);
        let (truth, pairs) = moved([0.3, -2.0, 1.1], 1.0);
        assert_same(&align(Alignment::Se3, &pairs).unwrap(), &truth);
        assert_same(&align(Alignment::Origin, &pairs).unwrap(), &truth);
        let (truth, pairs) = moved([0.0, 0.0, -2.5], 1.0);
        assert_same(&align(Alignment::Yaw, &pairs).unwrap(), &truth);
    }

    #[test]
    fn a_mirror_image_is_not_taken_for_a_turn() {
        let mirrored = |pose: &Isometry3<f64>| {
            let [x, y, z] = pose.translation.vector.into();
            Isometry3::translation(x, y, -z)
        };
        let pairs: Pairs = walk(60).iter().map(|pose| (*pose, mirrored(pose))).collect();
        let found = align(Alignment::Se3, &pairs).unwrap();
        let matrix = found.reference_from_estimate.to_rotation_matrix();
        assert!((matrix.matrix().determinant() - 1.0).abs() < 1e-12);
        assert!(sum_of_squares_m2(&found, &pairs) > 0.1);
    }

    #[test]
    fn on_a_line_the_errors_are_small_and_the_turn_is_unknown() {
        let pairs: Pairs = (0..50)
            .map(|index| {
                let along_m = f64::from(index) * 0.1;
                (
                    Isometry3::translation(along_m, 0.0, 0.0),
                    Isometry3::translation(1.0, along_m, 2.0),
                )
            })
            .collect();
        let found = align(Alignment::Se3, &pairs).unwrap();
        assert!(!found.rotation_is_determined);
        assert!(sum_of_squares_m2(&found, &pairs) < 1e-20);
    }

    #[test]
    fn what_stands_still_has_no_scale() {
        let pairs: Pairs =
            walk(20).into_iter().map(|reference| (Isometry3::identity(), reference)).collect();
        assert!(matches!(align(Alignment::Sim3, &pairs), Err(AlignmentError::NoScale { .. })));
        let found = align(Alignment::Se3, &pairs).unwrap();
        assert!(!found.rotation_is_determined);
        assert!(!align(Alignment::Yaw, &pairs).unwrap().rotation_is_determined);
    }

    proptest! {
        #[test]
        fn no_other_transform_is_nearer(
            noise_m in proptest::collection::vec(-0.3..0.3_f64, 60),
            other in proptest::array::uniform6(-0.1..0.1_f64),
            stretch in 0.9..1.1_f64,
        ) {
            let (_, mut pairs) = moved([0.1, 0.2, 2.0], 1.3);
            for (pair, noise_m) in pairs.iter_mut().zip(&noise_m) {
                pair.0.translation.vector += Vector3::new(*noise_m, -noise_m, noise_m * noise_m);
            }
            let [x, y, z, a, b, c] = other;
            for alignment in [Alignment::Yaw, Alignment::Se3, Alignment::Sim3] {
                let found = align(alignment, &pairs).unwrap();
                let turn = match alignment {
                    Alignment::Yaw => pose([x, y, z], [0.0, 0.0, c]),
                    _ => pose([x, y, z], [a, b, c]),
                };
                let scale = if alignment == Alignment::Sim3 { found.scale * stretch } else { 1.0 };
                let elsewhere = FoundAlignment::new(
                    alignment,
                    scale,
                    turn.rotation * found.reference_from_estimate,
                    Vector3::from(found.translation_m) + turn.translation.vector,
                );
                prop_assert!(
                    sum_of_squares_m2(&found, &pairs) <= sum_of_squares_m2(&elsewhere, &pairs) + 1e-12
                );
            }
        }
    }
}
