//! A constant velocity of a body, and the motion that it comes to.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

/// The velocity of a body in its own frame; while it stays constant the body moves on a screw line.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct BodyTwist {
    /// Of the frame's origin, along the frame's axes.
    pub linear_m_per_s: Vector3<f64>,
    /// About the frame's axes.
    pub angular_rad_per_s: Vector3<f64>,
}

/// Below this angle in radians the series of sine and cosine are exact to the last digit.
const SMALL_RAD: f64 = 1e-4;

impl BodyTwist {
    /// The constant velocity that leads to `start_from_end` within a time: the logarithm of SE(3) (Barfoot, State
    /// Estimation for Robotics, section 7.1.4). `None` where the time is not above 0.
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

    /// Where the body is after a time, in its frame at the start: `start_from_then`; before it with a negative time.
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

/// How a constant velocity's shift is bent by a turn.
fn left_jacobian(turn_rad: &Vector3<f64>) -> Matrix3<f64> {
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

fn inverse_left_jacobian(turn_rad: &Vector3<f64>) -> Matrix3<f64> {
    let angle_rad = turn_rad.norm();
    let cross = turn_rad.cross_matrix();
    let squared_rad = angle_rad * angle_rad;
    let second = if angle_rad < SMALL_RAD {
        1.0 / 12.0 + squared_rad / 720.0
    } else {
        let half_rad = angle_rad / 2.0;
        (1.0 - half_rad / half_rad.tan()) / squared_rad
    };
    Matrix3::identity() - cross * 0.5 + cross * cross * second
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn twist(values: [f64; 6]) -> BodyTwist {
        let [x, y, z, roll, pitch, yaw] = values;
        BodyTwist {
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
            let found = BodyTwist::between(&twist.displacement(0.1), 0.1).unwrap();
            prop_assert!((found.linear_m_per_s - twist.linear_m_per_s).norm() < 1e-9);
            prop_assert!((found.angular_rad_per_s - twist.angular_rad_per_s).norm() < 1e-9);
        }
    }

    #[test]
    fn a_car_in_a_bend_goes_round_a_circle() {
        let car = twist([10.0, 0.0, 0.0, 0.0, 0.0, 0.5]);
        let quarter = car.displacement(std::f64::consts::PI);
        // A radius of 20 m, a quarter turn to the left.
        assert!((quarter.translation.vector - Vector3::new(20.0, 20.0, 0.0)).norm() < 1e-9);
    }

    #[test]
    fn no_time_has_no_velocity() {
        for duration_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(BodyTwist::between(&Isometry3::identity(), duration_s), None);
        }
    }
}
