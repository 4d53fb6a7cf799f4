//! The motion that goes on as it was.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// How a vehicle moves: along its own axes at a moment.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Velocity {
    shift_m_per_s: Vector3<f64>,
    turn_rad_per_s: Vector3<f64>,
}

impl Velocity {
    /// The velocity that leads from one pose to a later one.
    pub(super) fn between(from: &Isometry3<f64>, to: &Isometry3<f64>, seconds: f64) -> Self {
        let motion = from.inv_mul(to);
        // The turn is spread evenly, and the way with it: the screw that joins the two (Sola et al. 2018, eq. 174).
        let turn = motion.rotation.scaled_axis();
        let half_back = UnitQuaternion::from_scaled_axis(-0.5 * turn);
        Self {
            shift_m_per_s: half_back * motion.translation.vector / seconds,
            turn_rad_per_s: turn / seconds,
        }
    }

    /// The motion in so many seconds, which may be negative.
    pub(super) fn motion(&self, seconds: f64) -> Isometry3<f64> {
        let turn = seconds * self.turn_rad_per_s;
        // To the third order in the turn a chord lies half a turn off (and is shorter by a twenty-fourth of its square).
        let shift = UnitQuaternion::from_scaled_axis(0.5 * turn) * (seconds * self.shift_m_per_s);
        Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, apart};

    #[test]
    fn a_motion_goes_on_as_it_was() {
        let mut random = Random::new(4);
        for _ in 0..20 {
            let (from, motion) = (random.motion(9.0, 2.0), random.motion(2.0, 0.1));
            let velocity = Velocity::between(&from, &(from * motion), 0.1);
            let (metres, radians) = apart(&velocity.motion(0.1), &motion);
            assert!(metres < 1e-12 && radians < 1e-7);
            // Twice is once and once again.
            let (metres, radians) = apart(&velocity.motion(0.2), &(motion * motion));
            assert!(metres < 0.01 && radians < 1e-7, "{metres}");
            let (metres, _) = apart(&velocity.motion(-0.1), &motion.inverse());
            assert!(metres < 1e-12);
        }
    }
}
