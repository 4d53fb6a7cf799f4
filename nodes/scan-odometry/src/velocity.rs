//! The velocity of the platform, and its covariance: constant but for unknown accelerations.

use nalgebra::{Isometry2, Matrix3, Vector2, Vector3};

use crate::ScanOdometryConfig;
use crate::observability::Observability;
use crate::twist::{Twist, increment};
use crate::uncertainty::parted;

/// A velocity of which nothing is known is what an acceleration makes of standing in this time.
const UNKNOWN_S: f64 = 1.0;

/// A velocity `[x, y, turn]` in the scanner's frame, in m/s and rad/s, as a Kalman filter has it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Velocity {
    mean: Vector3<f64>,
    covariance: Matrix3<f64>,
    /// For how long some direction of it has not been measured.
    held_s: f64,
}

impl Velocity {
    /// Standing, as far as is known.
    pub(crate) fn unknown(config: &ScanOdometryConfig) -> Self {
        let covariance = accelerations(config) * UNKNOWN_S * UNKNOWN_S;
        Self { mean: Vector3::zeros(), covariance, held_s: 0.0 }
    }

    /// The velocity itself.
    pub(crate) fn twist(&self) -> Twist {
        let Self { mean, .. } = self;
        Twist { linear_m_per_s: Vector2::new(mean.x, mean.y), angular_rad_per_s: mean.z }
    }

    /// The same velocity after a time: less certain by an acceleration that lasts as long as it is not measured.
    pub(crate) fn after(&self, passed_s: f64, config: &ScanOdometryConfig) -> Self {
        // The difference of the squares; from some time on it is as unknown as any.
        let grown = |held_s: f64| held_s.min(UNKNOWN_S).powi(2);
        let held_s = self.held_s + passed_s;
        let growth_s2 = grown(held_s) - grown(self.held_s);
        Self { covariance: self.covariance + accelerations(config) * growth_s2, held_s, ..*self }
    }

    /// The covariance of the motion that it makes in a time, up to now, in the scanner's frame.
    pub(crate) fn motion_covariance(
        &self,
        passed_s: f64,
        config: &ScanOdometryConfig,
    ) -> Matrix3<f64> {
        let accelerated = accelerations(config) * (0.5 * passed_s * passed_s).powi(2);
        self.covariance * (passed_s * passed_s) + accelerated
    }

    /// The covariance that this motion adds to the pose: a velocity that is not measured keeps its error in the same
    /// direction, so that the error grows with the time, not with its root.
    pub(crate) fn added_covariance(&self, passed_s: f64) -> Matrix3<f64> {
        let before_s = (self.held_s - passed_s).max(0.0);
        self.covariance * (2.0 * passed_s * before_s)
    }

    /// With a step that was measured, with this covariance.
    ///
    /// The measurement of one direction does not correct one that is held, whatever their correlation: which is which
    /// is known to a few degrees only, and a velocity that is not known would be found in these.
    pub(crate) fn measured(
        &self,
        step: &Isometry2<f64>,
        step_covariance: &Matrix3<f64>,
        passed_s: f64,
        observability: &Observability,
        config: &ScanOdometryConfig,
    ) -> Self {
        let found = increment(step) / passed_s;
        let ((observed, held), (observed_noise, _)) =
            (parted(&self.covariance, observability), parted(step_covariance, observability));
        // The held directions are not measured; here they only keep the matrix from being singular.
        let expected = observed + observed_noise / (passed_s * passed_s) + held;
        let Some(inverse) = expected.try_inverse() else { return *self };
        let gain = observed * inverse;
        let mut mean = self.mean + gain * (found - self.mean);
        let covariance = (Matrix3::identity() - gain) * observed + held;
        let is_all_told = observability.weak().next().is_none();
        let speed = mean.xy().norm();
        if speed > config.max_speed_m_per_s {
            mean.x *= config.max_speed_m_per_s / speed;
            mean.y *= config.max_speed_m_per_s / speed;
        }
        mean.z = mean.z.clamp(-config.max_turn_rad_per_s, config.max_turn_rad_per_s);
        Self {
            mean,
            // Symmetric in spite of rounding.
            covariance: 0.5 * (covariance + covariance.transpose()),
            held_s: if is_all_told { 0.0 } else { self.held_s },
        }
    }
}

fn accelerations(config: &ScanOdometryConfig) -> Matrix3<f64> {
    let (shift, turn) =
        (config.acceleration_m_per_s2.powi(2), config.acceleration_rad_per_s2.powi(2));
    Matrix3::from_diagonal(&Vector3::new(shift, shift, turn))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observability::units;

    fn config() -> ScanOdometryConfig {
        ScanOdometryConfig::default()
    }

    /// Everything is observed but perhaps x.
    fn observed(x_is_observed: bool) -> Observability {
        let mut observed = Observability::nothing(&units(3.0));
        observed.directions.iter_mut().for_each(|direction| direction.estimated = true);
        observed.directions[0].estimated = x_is_observed;
        observed
    }

    const NOISE: f64 = 1e-6;

    fn measured(
        velocity: &Velocity,
        x_m: f64,
        passed_s: f64,
        observed: &Observability,
    ) -> Velocity {
        let step = Isometry2::translation(x_m, 0.0);
        let noise = Matrix3::from_diagonal_element(NOISE);
        velocity.after(passed_s, &config()).measured(&step, &noise, passed_s, observed, &config())
    }

    #[test]
    fn a_good_measurement_is_used_and_one_over_a_moment_is_not() {
        let after = measured(&Velocity::unknown(&config()), 0.05, 0.1, &observed(true));
        assert!((after.twist().linear_m_per_s.x - 0.5).abs() < 0.001);
        // Two millimetres in a millisecond are noise, not two metres a second.
        let unmoved = measured(&after, 0.002, 0.001, &observed(true));
        assert!((unmoved.twist().linear_m_per_s.x - 0.5).abs() < 0.01, "{unmoved:?}");
    }

    #[test]
    fn an_unobserved_direction_is_kept_and_less_and_less_known() {
        let mut velocity = measured(&Velocity::unknown(&config()), 0.05, 0.1, &observed(true));
        for scans in 1..=30 {
            velocity = measured(&velocity, 0.0, 0.1, &observed(false));
            assert!((velocity.twist().linear_m_per_s.x - 0.5).abs() < 0.001, "{velocity:?}");
            let expected = f64::min(0.1 * f64::from(scans), 1.0);
            assert!((velocity.covariance.m11.sqrt() - expected).abs() < 0.01, "{velocity:?}");
            assert!(velocity.covariance.m22.sqrt() < 0.02);
        }
    }

    #[test]
    fn a_direction_observed_a_little_askew_does_not_correct_a_held_one() {
        let mut velocity = measured(&Velocity::unknown(&config()), 0.05, 0.1, &observed(true));
        for scan in 0..50 {
            let askew = if scan % 2 == 0 { 0.1 } else { -0.1 };
            let mut observed = observed(false);
            for direction in &mut observed.directions {
                let turned = nalgebra::Rotation2::new(askew) * direction.in_units.xy();
                direction.in_units = Vector3::new(turned.x, turned.y, direction.in_units.z);
            }
            let step = Isometry2::translation(0.05, 0.002);
            let noise = Matrix3::from_diagonal_element(NOISE);
            velocity =
                velocity.after(0.1, &config()).measured(&step, &noise, 0.1, &observed, &config());
        }
        assert!((velocity.twist().linear_m_per_s.x - 0.5).abs() < 0.05, "{velocity:?}");
        assert!(velocity.covariance.m11.sqrt() > 0.3, "{velocity:?}");
    }

    #[test]
    fn it_is_no_faster_than_a_platform() {
        let noise = Matrix3::from_diagonal_element(1e-9);
        let jump = Isometry2::new(Vector2::new(3.0, 4.0), 2.0);
        let fast =
            Velocity::unknown(&config()).measured(&jump, &noise, 0.1, &observed(true), &config());
        assert!((fast.twist().linear_m_per_s.norm() - 3.0).abs() < 1e-9);
        assert!(fast.twist().angular_rad_per_s <= std::f64::consts::PI);
    }
}
