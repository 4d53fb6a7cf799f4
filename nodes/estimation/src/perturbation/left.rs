//! Perturbations on the left: in the target's frame, about its origin.
//!
//! ```text
//! corrected_target_from_source * p = exp(w) * (target_from_source * p) + v
//! ```
//!
//! A point in the target's frame moves by `v + w x p` to first order, wherever the source's origin is.

use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, UnitQuaternion, Vector6};

use super::{joined, parts};

/// The pose that a perturbation makes of `target_from_source`.
#[must_use]
pub fn perturbed(
    target_from_source: &Isometry3<f64>,
    perturbation: &Vector6<f64>,
) -> Isometry3<f64> {
    let (shift, turn) = parts(perturbation);
    let rotation = UnitQuaternion::from_scaled_axis(turn);
    let mut whole = rotation * target_from_source.rotation;
    // Rounding must not add up over the steps of a solver.
    whole.renormalize_fast();
    let translation = rotation * target_from_source.translation.vector + shift;
    Isometry3::from_parts(Translation3::from(translation), whole)
}

/// The perturbation that makes `to` of `from`: the inverse of [`perturbed`].
#[must_use]
pub fn perturbation_between(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let rotation = to.rotation * from.rotation.inverse();
    let shift = to.translation.vector - rotation * from.translation.vector;
    joined(&shift, &rotation.scaled_axis())
}

/// Takes a small perturbation of a pose to that of another one: when `next_from_target * target_from_source` is the next
/// pose, an error of `target_from_source` is this matrix times it as an error of the next pose (the adjoint of the motion;
/// Sola et al. 2018, eq. 31).
#[must_use]
pub fn adjoint(next_from_target: &Isometry3<f64>) -> Matrix6<f64> {
    let rotation = next_from_target.rotation.to_rotation_matrix().into_inner();
    let mut adjoint = Matrix6::zeros();
    adjoint.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    adjoint.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    let lever: Matrix3<f64> = next_from_target.translation.vector.cross_matrix() * rotation;
    adjoint.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
    adjoint
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
        fn a_point_moves_by_the_shift_and_about_the_targets_origin(
            pose in any_pose(), point in prop::array::uniform3(-5.0..5.0_f64),
            direction in prop::array::uniform6(-1.0..1.0_f64),
        ) {
            const SMALL: f64 = 1e-6;
            let direction = Vector6::from(direction);
            let (shift, turn) = parts(&direction);
            let point = Point3::from(point);
            let before = pose * point;
            let moved = (perturbed(&pose, &(SMALL * direction)) * point - before) / SMALL;
            prop_assert!((moved - (shift + turn.cross(&before.coords))).norm() < 1e-4);
        }

        #[test]
        fn the_adjoint_carries_a_perturbation_over_a_motion(
            pose in any_pose(), motion in any_pose(), direction in prop::array::uniform6(-1.0..1.0_f64),
        ) {
            const SMALL: f64 = 1e-6;
            let error = SMALL * Vector6::from(direction);
            let carried = perturbation_between(&(motion * pose), &(motion * perturbed(&pose, &error)));
            prop_assert!((carried - adjoint(&motion) * error).norm() < 1e-9);
        }
    }
}
