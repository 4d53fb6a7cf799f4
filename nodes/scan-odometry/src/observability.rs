//! Which directions of the plane's three a match constrains.
//!
//! A wall determines the position along its normal and not along itself; between two parallel walls a platform may be anywhere
//! along them. Unobservable directions keep the prediction: see [`estimation::observability`].

use estimation::covariance::scaled;
use estimation::observability::restricted;
use nalgebra::{Matrix3, Vector3};

use crate::ScanOdometryConfig;

/// A direction is estimated when its information is this many times what normals at random would seem to give: their noise
/// may be twice the expected one, and its own part counts once more.
const ABOVE_NOISE: f64 = 2.0;

/// The three directions `[x, y, turn]` that a match constrains independently of each other, in the frame of the scanner; a
/// turn counts in metres at the lever's end.
pub(crate) type Observability = estimation::Observability<3>;

/// The normal equations of a match, of `[x, y, turn]` in m and rad in the frame of the scanner.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct NormalEquations {
    /// `J' W J`, the information of the returns.
    pub(crate) information: Matrix3<f64>,
    /// `J' W r`.
    pub(crate) gradient: Vector3<f64>,
    /// The part of the information that the noise of the normals accounts for.
    pub(crate) noise: Matrix3<f64>,
}

impl NormalEquations {
    /// Adds what is known beforehand of `[x, y, turn]`, of which `moved` has been left already. The returns' information is
    /// in units of their expected variance, of which the true one is `variance_factor` times as much.
    pub(crate) fn add_prior(
        &mut self,
        information: &Matrix3<f64>,
        variance_factor: f64,
        moved: &Vector3<f64>,
    ) {
        let information = variance_factor * information;
        self.information += information;
        self.gradient += information * moved;
    }

    /// The directions of the information without its noise. `variance_factor` is the variance of the residuals over the
    /// expected one. Numbers that are not finite give no direction.
    pub(crate) fn observability(
        &self,
        lever_m: f64,
        variance_factor: f64,
        config: &ScanOdometryConfig,
    ) -> Observability {
        let units = units(lever_m);
        let without_noise = self.information - self.noise;
        if !without_noise.iter().all(|element| element.is_finite()) {
            return Observability::nothing(&units);
        }
        let noise = scaled(&self.noise, &units);
        let turn_m = config.max_std_dev_rad * lever_m;
        Observability::of(&without_noise, &units, |direction, information| {
            let noise = direction.dot(&(noise * direction));
            let allowed_m2 = direction.xy().norm_squared() * config.max_std_dev_m.powi(2)
                + direction.z.powi(2) * turn_m.powi(2);
            information > (ABOVE_NOISE - 1.0) * noise && information * allowed_m2 > variance_factor
        })
    }

    /// The increment of `[x, y, turn]` that solves the equations along the directions that are estimated, and takes back what
    /// was `moved` along the others.
    pub(crate) fn solve(
        &self,
        observability: &Observability,
        moved: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let units = &observability.units;
        let held = observability.weak_projector();
        let taken_back = (held * moved.component_div(units)).component_mul(units);
        Some(-(self.inverse(observability)? * self.gradient) - taken_back)
    }

    /// The inverse of the information along the directions that are estimated, 0 along the others.
    pub(crate) fn inverse(&self, observability: &Observability) -> Option<Matrix3<f64>> {
        let units = &observability.units;
        let information = scaled(&self.information, units);
        let held = observability.weak_projector();
        let estimated = observability.projector();
        let inverse = restricted(&information, &held, information.trace()).try_inverse()?;
        Some(scaled(&(estimated * inverse * estimated), units))
    }
}

/// A metre, and the turn that moves the lever's end by one.
pub(crate) fn units(lever_m: f64) -> Vector3<f64> {
    Vector3::new(1.0, 1.0, lever_m.max(f64::MIN_POSITIVE).recip())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEVER_M: f64 = 2.0;

    fn corridor() -> NormalEquations {
        // A thousand returns of a centimetre each on walls along x, whose normals deviate by 2 degrees.
        let seen = 1000.0 / 1e-4;
        let stray = seen * 0.035_f64.powi(2);
        let turn = LEVER_M * LEVER_M * 0.5 * seen;
        NormalEquations {
            information: Matrix3::from_diagonal(&Vector3::new(1.2 * stray, seen, turn)),
            gradient: Vector3::new(3.0 * stray, -0.01 * seen, 0.0),
            noise: Matrix3::from_diagonal(&Vector3::new(stray, 0.0, 0.0)),
        }
    }

    fn observability(equations: &NormalEquations) -> Observability {
        equations.observability(LEVER_M, 1.0, &ScanOdometryConfig::default())
    }

    #[test]
    fn the_axis_of_a_corridor_is_held() {
        let equations = corridor();
        let found = observability(&equations);
        let held: Vec<f64> = found.weak().map(|direction| direction.in_units.x.abs()).collect();
        assert_eq!(held.len(), 1);
        assert!((held[0] - 1.0).abs() < 1e-9);
        let step = equations.solve(&found, &Vector3::new(0.2, 0.1, 0.0)).unwrap();
        assert!((step - Vector3::new(-0.2, 0.01, 0.0)).norm() < 1e-9, "{step}");
        assert_eq!(equations.inverse(&found).unwrap().m11, 0.0);
    }

    #[test]
    fn an_end_of_the_corridor_that_ten_beams_hit_is_enough() {
        let mut equations = corridor();
        equations.information.m11 += 10.0 / 1e-4;
        assert_eq!(observability(&equations).estimated(), 3);
    }

    #[test]
    fn little_information_and_bad_numbers_determine_nothing() {
        let mut equations = corridor();
        equations.information = Matrix3::from_diagonal_element(100.0);
        equations.noise = Matrix3::zeros();
        assert_eq!(observability(&equations).estimated(), 0);
        equations.information.m12 = f64::NAN;
        assert_eq!(observability(&equations).estimated(), 0);
    }
}
