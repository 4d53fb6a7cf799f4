//! The six numbers that a pose is corrected by.
//!
//! A perturbation is `[v; w]`: a shift `v` in metres and a turn `w` (axis times angle, in radians), both along the axes of
//! the camera frame of the pose that is corrected. It acts on the left:
//!
//! ```text
//! corrected_camera_from_map * p = exp(w) * (camera_from_map * p) + v
//! ```
//!
//! A point of the camera frame moves by `v + w x p` to first order, wherever the origin of the map lies. It is points
//! that are moved here: the camera itself goes the other way.

use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

/// The pose that a perturbation makes of `camera_from_map`.
#[must_use]
pub fn perturbed(camera_from_map: &Isometry3<f64>, perturbation: &Vector6<f64>) -> Isometry3<f64> {
    let (shift, turn) = parts(perturbation);
    let rotation = UnitQuaternion::from_scaled_axis(turn);
    let mut whole = rotation * camera_from_map.rotation;
    // Rounding must not add up over the steps of a solver.
    whole.renormalize_fast();
    let translation = rotation * camera_from_map.translation.vector + shift;
    Isometry3::from_parts(Translation3::from(translation), whole)
}

/// The perturbation that makes `to` of `from`: the inverse of [`perturbed`].
#[must_use]
pub fn perturbation_between(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let rotation = to.rotation * from.rotation.inverse();
    let shift = to.translation.vector - rotation * from.translation.vector;
    let turn = rotation.scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Takes a small perturbation of a pose to that of another one: when `next_from_camera * camera_from_map` is the pose
/// of the next camera, an error of `camera_from_map` is this matrix times it as an error of the next pose (the adjoint of
/// the motion; Sola et al. 2018, "A micro Lie theory", eq. 31).
#[must_use]
pub fn adjoint(next_from_camera: &Isometry3<f64>) -> Matrix6<f64> {
    let rotation = next_from_camera.rotation.to_rotation_matrix().into_inner();
    let mut adjoint = Matrix6::zeros();
    adjoint.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    adjoint.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    let lever: Matrix3<f64> = next_from_camera.translation.vector.cross_matrix() * rotation;
    adjoint.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
    adjoint
}

/// The shift and the turn of a perturbation.
pub(crate) fn parts(perturbation: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let [x, y, z, about_x, about_y, about_z] = (*perturbation).into();
    (Vector3::new(x, y, z), Vector3::new(about_x, about_y, about_z))
}

/// Whether a pose has only finite numbers.
pub(crate) fn is_finite(pose: &Isometry3<f64>) -> bool {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;
    use crate::solve::testing::any_pose;

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
        fn a_point_moves_by_the_shift_and_about_the_camera(
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
