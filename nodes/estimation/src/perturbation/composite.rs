//! Perturbations along the target's axes, about the source's origin.
//!
//! ```text
//! corrected_target_from_source * p = exp(w) * R * p + t + v
//! ```
//!
//! So a covariance over them is what `geometry_msgs/PoseWithCovariance` holds, and no digit is lost where the target's
//! origin is far away.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector6};

use super::{joined, parts};

/// The pose that a perturbation makes of `target_from_source`.
#[must_use]
pub fn perturbed(
    target_from_source: &Isometry3<f64>,
    perturbation: &Vector6<f64>,
) -> Isometry3<f64> {
    let (shift, turn) = parts(perturbation);
    let mut rotation = UnitQuaternion::from_scaled_axis(turn) * target_from_source.rotation;
    // Rounding must not add up over the steps of a solver.
    rotation.renormalize_fast();
    Isometry3::from_parts(
        Translation3::from(target_from_source.translation.vector + shift),
        rotation,
    )
}

/// The perturbation that makes `to` of `from`: the inverse of [`perturbed`].
#[must_use]
pub fn perturbation_between(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let shift = to.translation.vector - from.translation.vector;
    joined(&shift, &(to.rotation * from.rotation.inverse()).scaled_axis())
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
            let expected = shift + turn.cross(&(pose.rotation * point.coords));
            prop_assert!((moved - expected).norm() < 1e-4);
        }
    }
}
