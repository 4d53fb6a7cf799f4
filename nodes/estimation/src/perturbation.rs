//! The six numbers that a pose is corrected by.
//!
//! A perturbation is `[v; w]`: a shift `v` in metres and a turn `w` (axis times angle, in radians). Of a pose
//! `target_from_source = (R, t)` there are three conventions, a module each:
//!
//! | module | corrected rotation | corrected translation | the turn is about | axes |
//! |---|---|---|---|---|
//! | [`left`] | `exp(w) R` | `exp(w) t + v` | the target's origin | the target's |
//! | [`right`] | `R exp(w)` | `t + R v` | the source's origin | the source's |
//! | [`composite`] | `exp(w) R` | `t + v` | the source's origin | the target's |
//!
//! `left` and `right` are the left and right "plus" of Sola et al. 2018, "A micro Lie theory", eq. 25 and 27, with the pair
//! `(exp(w), v)` for the exponential of SE(3): the two agree to first order, and the pair needs no Jacobian. `composite` is
//! the plus of the composite manifold R^3 x SO(3) (section IV there), and the convention of
//! `geometry_msgs/PoseWithCovariance` (REP 103). `left` suits observations in the target's frame (a camera pose
//! `camera_from_map`); `right` and `composite` keep their digits where the target's origin is far away.

pub mod composite;
pub mod left;
pub mod right;

use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};

/// The shift and the turn of a perturbation.
#[must_use]
pub fn parts(perturbation: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let [x, y, z, about_x, about_y, about_z] = (*perturbation).into();
    (Vector3::new(x, y, z), Vector3::new(about_x, about_y, about_z))
}

/// The perturbation of a shift and a turn.
#[must_use]
pub fn joined(shift: &Vector3<f64>, turn: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// How far from 1 the length of a rotation's quaternion may be: what single precision rounds off, and what rounding adds up to over
/// years of corrections; it moves a point at 100 m by 0.2 mm.
const MOST_OFF_UNIT: f64 = 1e-6;

/// Whether four numbers, which the type takes for a unit quaternion unseen, are one.
#[must_use]
pub fn is_rotation(rotation: &UnitQuaternion<f64>) -> bool {
    (rotation.coords.norm() - 1.0).abs() <= MOST_OFF_UNIT
}

/// Whether a pose is a rotation and a shift with finite numbers.
#[must_use]
pub fn is_rigid(pose: &Isometry3<f64>) -> bool {
    is_rotation(&pose.rotation) && pose.translation.vector.iter().all(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_with_one_number_that_is_not_finite_is_none() {
        let pose = Isometry3::new(Vector3::new(1.0, -2.0, 3.0), Vector3::new(0.1, 0.2, 0.3));
        assert!(is_rigid(&pose));
        for bad in [f64::NAN, f64::INFINITY] {
            let (mut moved, mut turned) = (pose, pose);
            moved.translation.vector.y = bad;
            turned.rotation.as_mut_unchecked().coords.w = bad;
            assert!(!is_rigid(&moved) && !is_rigid(&turned));
        }
    }
}
