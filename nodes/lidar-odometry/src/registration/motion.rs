//! The six numbers that a pose is corrected by.
//!
//! A perturbation is `[v; w]`: a shift `v` of the source's origin in metres and a turn `w` about it (axis times angle, in
//! radians), both along the axes of the target:
//!
//! ```text
//! corrected_target_from_source * p = exp(w) * R * p + t + v
//! ```
//!
//! So a covariance over them is what `geometry_msgs/PoseWithCovariance` holds, and no digit is lost where the target's
//! origin is far away.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};

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
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
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
    use super::*;
    use crate::testing::{Random, apart};

    #[test]
    fn the_perturbation_between_two_poses_leads_from_one_to_the_other() {
        let mut random = Random::new(3);
        for _ in 0..50 {
            let (from, to) = (random.motion(9.0, 2.0), random.motion(9.0, 1.0));
            let there = perturbed(&from, &perturbation_between(&from, &to));
            let (metres, radians) = apart(&there, &to);
            assert!(metres < 1e-12 && radians < 1e-7, "{metres} {radians}");
        }
    }
}
