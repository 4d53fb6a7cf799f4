//! Velocities in the plane.

use nalgebra::{Isometry2, Matrix2, Vector2, Vector3};

/// Below this angle the series of `sin(a) / a` and its kin are exact to the bit.
const SMALL_ANGLE_RAD: f64 = 1e-5;

/// A velocity of the scanner in its own frame.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Twist {
    pub(crate) linear_m_per_s: Vector2<f64>,
    pub(crate) angular_rad_per_s: f64,
}

impl Twist {
    /// Where the scanner is `after_s` later, in its present frame.
    pub(crate) fn after(&self, after_s: f64) -> Isometry2<f64> {
        motion(&Vector3::new(
            self.linear_m_per_s.x * after_s,
            self.linear_m_per_s.y * after_s,
            self.angular_rad_per_s * after_s,
        ))
    }

    /// How far apart two velocities would lead within a time, over distances of about `lever_m`.
    pub(crate) fn parts_m(&self, other: &Self, passed_s: f64, lever_m: f64) -> f64 {
        let linear = (self.linear_m_per_s - other.linear_m_per_s).norm();
        passed_s * (linear + lever_m * (self.angular_rad_per_s - other.angular_rad_per_s).abs())
    }
}

/// The exponential map of SE(2): the motion of `[x, y, turn]` at constant velocity in the moving frame
/// (Lynch and Park, Modern Robotics, 3.3.3).
pub(crate) fn motion(increment: &Vector3<f64>) -> Isometry2<f64> {
    let translation = bend(increment.z) * increment.xy();
    Isometry2::new(translation, increment.z)
}

/// The inverse of [`motion`] for turns in `(-pi, pi)`.
pub(crate) fn increment(motion: &Isometry2<f64>) -> Vector3<f64> {
    let turn_rad = motion.rotation.angle();
    // `bend` is a turn by half the angle and a scale: its inverse always exists within (-2 pi, 2 pi).
    let straight =
        bend(turn_rad).try_inverse().unwrap_or_else(Matrix2::identity) * motion.translation.vector;
    Vector3::new(straight.x, straight.y, turn_rad)
}

fn bend(turn_rad: f64) -> Matrix2<f64> {
    let (sine, versine) = if turn_rad.abs() < SMALL_ANGLE_RAD {
        (1.0 - turn_rad * turn_rad / 6.0, 0.5 * turn_rad)
    } else {
        (turn_rad.sin() / turn_rad, (1.0 - turn_rad.cos()) / turn_rad)
    };
    Matrix2::new(sine, -versine, versine, sine)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn an_increment_makes_its_motion(x in -3.0..3.0_f64, y in -3.0..3.0_f64, turn in -3.0..3.0_f64) {
            let step = Isometry2::new(Vector2::new(x, y), turn);
            let made = motion(&increment(&step));
            prop_assert!((made.translation.vector - step.translation.vector).norm() < 1e-9);
            prop_assert!((made.rotation.angle() - turn).abs() < 1e-9);
        }

        #[test]
        fn half_the_time_twice_is_the_whole(x in -3.0..3.0_f64, turn in -3.0..3.0_f64) {
            let twist = Twist { linear_m_per_s: Vector2::new(x, -0.3), angular_rad_per_s: turn };
            let (half, whole) = (twist.after(0.05), twist.after(0.1));
            prop_assert!(((half * half).translation.vector - whole.translation.vector).norm() < 1e-12);
        }
    }

    #[test]
    fn a_circle_is_driven() {
        let twist = Twist { linear_m_per_s: Vector2::new(1.0, 0.0), angular_rad_per_s: 1.0 };
        let quarter = twist.after(std::f64::consts::FRAC_PI_2);
        assert!((quarter.translation.vector - Vector2::new(1.0, 1.0)).norm() < 1e-12);
        let still = motion(&Vector3::new(1.0, 2.0, 1e-7));
        assert!((still.translation.vector - Vector2::new(1.0, 2.0)).norm() < 1e-6);
    }
}
