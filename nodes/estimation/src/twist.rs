//! A constant velocity of a body, and the motion that it leads to: the exponential map of SE(3) and its inverse.
//!
//! Source: Barfoot, "State Estimation for Robotics", section 7.1.3 and 7.1.4; Sola et al. 2018, "A micro Lie theory",
//! eq. 143 to 146 and 172 to 174.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

/// The velocity of a body in its own frame; while it stays constant the body moves on a screw line.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Twist {
    /// Of the frame's origin, along the frame's axes.
    pub linear_m_per_s: Vector3<f64>,
    /// About the frame's axes.
    pub angular_rad_per_s: Vector3<f64>,
}

/// Below this angle in radians the series of sine and cosine are exact to the last digit.
const SMALL_RAD: f64 = 1e-4;

impl Twist {
    /// The constant velocity that leads to `start_from_end` within a time: the logarithm of SE(3). `None` where the time is
    /// not above 0.
    #[must_use]
    pub fn between(start_from_end: &Isometry3<f64>, duration_s: f64) -> Option<Self> {
        if !(duration_s > 0.0 && duration_s.is_finite()) {
            return None;
        }
        let turn_rad = start_from_end.rotation.scaled_axis();
        let shift_m = inverse_left_jacobian(&turn_rad) * start_from_end.translation.vector;
        Some(Self {
            linear_m_per_s: shift_m / duration_s,
            angular_rad_per_s: turn_rad / duration_s,
        })
    }

    /// Where the body is after a time, in its frame at the start: `start_from_then`; before it with a negative time. The
    /// exponential of SE(3).
    #[must_use]
    pub fn displacement(&self, time_s: f64) -> Isometry3<f64> {
        let turn_rad = self.angular_rad_per_s * time_s;
        let shift_m = left_jacobian(&turn_rad) * self.linear_m_per_s * time_s;
        Isometry3::from_parts(
            Translation3::from(shift_m),
            UnitQuaternion::from_scaled_axis(turn_rad),
        )
    }
}

/// A share of a motion, or more than all of it, at a constant velocity of the body.
#[must_use]
pub fn part_of_motion(motion: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    Twist::between(motion, 1.0).unwrap_or_default().displacement(share)
}

/// The left Jacobian of SO(3): how a constant velocity's shift is bent by a turn.
#[must_use]
pub fn left_jacobian(turn_rad: &Vector3<f64>) -> Matrix3<f64> {
    let angle_rad = turn_rad.norm();
    let cross = turn_rad.cross_matrix();
    let squared_rad = angle_rad * angle_rad;
    let (first, second) = if angle_rad < SMALL_RAD {
        (0.5 - squared_rad / 24.0, 1.0 / 6.0 - squared_rad / 120.0)
    } else {
        let (sin, cos) = angle_rad.sin_cos();
        ((1.0 - cos) / squared_rad, (angle_rad - sin) / (squared_rad * angle_rad))
    };
    Matrix3::identity() + cross * first + cross * cross * second
}

/// The inverse of [`left_jacobian`], for turns below a whole one.
#[must_use]
pub fn inverse_left_jacobian(turn_rad: &Vector3<f64>) -> Matrix3<f64> {
    let cross = turn_rad.cross_matrix();
    Matrix3::identity() - cross * 0.5 + cross * cross * second_of_inverse(turn_rad)
}

/// How the rotation vector changes with a small turn on the right: the inverse of the right Jacobian.
#[must_use]
pub fn inverse_right_jacobian(turn_rad: &Vector3<f64>) -> Matrix3<f64> {
    let cross = turn_rad.cross_matrix();
    Matrix3::identity() + 0.5 * cross + second_of_inverse(turn_rad) * cross * cross
}

/// The factor of the squared cross matrix in the inverse of both Jacobians.
fn second_of_inverse(turn_rad: &Vector3<f64>) -> f64 {
    let angle_rad = turn_rad.norm();
    let squared_rad = angle_rad * angle_rad;
    if angle_rad < SMALL_RAD {
        1.0 / 12.0 + squared_rad / 720.0
    } else {
        let half_rad = angle_rad / 2.0;
        (1.0 - half_rad / half_rad.tan()) / squared_rad
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::any_pose;

    fn twist(values: [f64; 6]) -> Twist {
        let [x, y, z, roll, pitch, yaw] = values;
        Twist {
            linear_m_per_s: Vector3::new(x, y, z),
            angular_rad_per_s: Vector3::new(roll, pitch, yaw),
        }
    }

    fn distance(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
        (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation)
    }

    proptest! {
        #[test]
        fn two_stretches_make_one(
            values in proptest::array::uniform6(-9.0..9.0_f64),
            first_s in -0.1..0.1_f64,
            second_s in -0.1..0.1_f64,
        ) {
            let twist = twist(values);
            let one = twist.displacement(first_s + second_s);
            prop_assert!(distance(&(twist.displacement(first_s) * twist.displacement(second_s)), &one) < 1e-12);
        }

        #[test]
        fn the_velocity_is_found_again(
            values in proptest::array::uniform6(-9.0..9.0_f64),
            scale in prop_oneof![Just(1.0), Just(1e-4), Just(1e-7)],
        ) {
            let twist = twist(values.map(|value| value * scale));
            let found = Twist::between(&twist.displacement(0.1), 0.1).unwrap();
            prop_assert!((found.linear_m_per_s - twist.linear_m_per_s).norm() < 1e-9);
            prop_assert!((found.angular_rad_per_s - twist.angular_rad_per_s).norm() < 1e-9);
        }

        #[test]
        fn parts_of_a_motion_make_up_the_whole(motion in any_pose(), share in 0.0..2.0_f64) {
            let two = part_of_motion(&motion, share) * part_of_motion(&motion, 1.0 - share);
            prop_assert!(distance(&two, &motion) < 1e-7);
            prop_assert!(distance(&part_of_motion(&motion, 1.0), &motion) < 1e-7);
            prop_assert!(distance(&part_of_motion(&motion, -1.0), &motion.inverse()) < 1e-7);
        }

        #[test]
        fn the_right_jacobian_is_how_the_logarithm_changes(
            turn in prop::array::uniform3(-1.6..1.6_f64), small in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            const SMALL: f64 = 1e-6;
            let (turn, small) = (Vector3::from(turn), Vector3::from(small));
            let at = UnitQuaternion::from_scaled_axis(turn);
            let moved = (at * UnitQuaternion::from_scaled_axis(SMALL * small)).scaled_axis();
            let slope = (moved - at.scaled_axis()) / SMALL;
            prop_assert!((slope - inverse_right_jacobian(&turn) * small).norm() < 1e-4);
        }
    }

    #[test]
    fn a_car_in_a_bend_drives_a_circle() {
        let car = twist([10.0, 0.0, 0.0, 0.0, 0.0, 0.5]);
        let quarter = car.displacement(std::f64::consts::PI);
        // A radius of 20 m, a quarter turn to the left.
        assert!((quarter.translation.vector - Vector3::new(20.0, 20.0, 0.0)).norm() < 1e-9);
    }

    #[test]
    fn no_time_has_no_velocity() {
        for duration_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Twist::between(&Isometry3::identity(), duration_s), None);
        }
    }
}
