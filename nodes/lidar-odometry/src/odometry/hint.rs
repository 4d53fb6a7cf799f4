//! The motion by other sensors: wheels, or a gyroscope.

use nalgebra::{Isometry3, UnitQuaternion};

use crate::registration::{is_rigid, is_rotation};

/// How the sensor has moved from the last pose to the next, as far as others know it; in its frame at the last pose.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct MotionHint {
    /// Its translation and rotation: `last_from_now`, by wheels.
    pub motion: Option<Isometry3<f64>>,
    /// Its rotation alone, by a gyroscope: it is used in place of that of the wheels.
    pub turn: Option<UnitQuaternion<f64>>,
}

impl MotionHint {
    /// Whether the translation is known, not the turn alone.
    pub(super) fn has_translation(&self) -> bool {
        self.motion.is_some_and(|motion| is_rigid(&motion))
    }

    /// The motion as it is expected: that of the wheels, or that of constant velocity; with the gyroscope's rotation.
    pub(super) fn motion(&self, going_on: &Isometry3<f64>) -> Option<Isometry3<f64>> {
        let by_wheels = self.motion.filter(is_rigid);
        let turn = self.turn.filter(is_rotation);
        match (by_wheels, turn) {
            (None, None) => None,
            (Some(motion), None) => Some(motion),
            (motion, Some(turn)) => {
                let shift = motion.as_ref().unwrap_or(going_on).translation;
                Some(Isometry3::from_parts(shift, turn))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Quaternion, Vector3};

    use super::*;

    #[test]
    fn the_gyroscope_gives_the_rotation_and_the_wheels_the_translation() {
        let going_on = Isometry3::new(Vector3::x(), Vector3::z() * 0.1);
        let motion = Some(Isometry3::new(Vector3::x() * 2.0, Vector3::z() * 0.2));
        let turn = Some(UnitQuaternion::from_scaled_axis(Vector3::z() * 0.3));
        let expected =
            |x: f64, yaw: f64| Some(Isometry3::new(Vector3::x() * x, Vector3::z() * yaw));
        let hint = |motion, turn| MotionHint { motion, turn }.motion(&going_on);
        assert_eq!(hint(None, None), None);
        assert_eq!(hint(motion, None), expected(2.0, 0.2));
        assert_eq!(hint(None, turn), expected(1.0, 0.3));
        assert_eq!(hint(motion, turn), expected(2.0, 0.3));
        let broken = Some(Isometry3::translation(f64::NAN, 0.0, 0.0));
        assert_eq!(hint(broken, turn), expected(1.0, 0.3));
        // Regression: each pose was turned by a quaternion twice as long as the one before.
        let long = Some(UnitQuaternion::new_unchecked(Quaternion::new(2.0, 0.0, 0.0, 0.0)));
        assert_eq!(hint(motion, long), expected(2.0, 0.2));
    }
}
