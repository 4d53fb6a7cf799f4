//! Perturbations on the right: in the source's frame, about its origin.
//!
//! ```text
//! corrected_target_from_source * p = target_from_source * (exp(w) * p + v)
//! ```
//!
//! So the corrections of nodes far from the target's origin are as exact as others.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector6};

use super::{joined, parts};

/// The pose that a perturbation makes of `target_from_source`.
#[must_use]
pub fn perturbed(
    target_from_source: &Isometry3<f64>,
    perturbation: &Vector6<f64>,
) -> Isometry3<f64> {
    let (shift, turn) = parts(perturbation);
    let mut rotation = target_from_source.rotation * UnitQuaternion::from_scaled_axis(turn);
    // Rounding must not add up over the steps of a solver.
    rotation.renormalize_fast();
    let translation = target_from_source.translation.vector + target_from_source.rotation * shift;
    Isometry3::from_parts(Translation3::from(translation), rotation)
}

/// The perturbation that makes `to` of `from`: the inverse of [`perturbed`].
#[must_use]
pub fn perturbation_between(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let between = from.inverse() * to;
    joined(&between.translation.vector, &between.rotation.scaled_axis())
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;
    use crate::testing::any_pose;

    proptest! {
        #[test]
        fn the_perturbation_between_two_poses_leads_from_one_to_the_other(
            from in any_pose(), to in any_pose(), point in prop::array::uniform3(-5.0..5.0_f64),
        ) {
            let there = perturbed(&from, &perturbation_between(&from, &to));
            let point = Point3::from(point);
            prop_assert!((there * point - to * point).norm() < 1e-9);
        }

        #[test]
        fn a_point_moves_by_the_shift_and_about_the_sources_origin(
            pose in any_pose(), point in prop::array::uniform3(-5.0..5.0_f64),
            direction in prop::array::uniform6(-1.0..1.0_f64),
        ) {
            const SMALL: f64 = 1e-6;
            let direction = Vector6::from(direction);
            let (shift, turn) = parts(&direction);
            let point = Point3::from(point);
            let moved = (perturbed(&pose, &(SMALL * direction)) * point - pose * point) / SMALL;
            let expected = pose.rotation * (shift + turn.cross(&point.coords));
            prop_assert!((moved - expected).norm() < 1e-4);
        }
    }
}
