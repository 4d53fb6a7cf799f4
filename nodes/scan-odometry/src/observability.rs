//! Which directions of the plane's three a match tells.
//!
//! A wall tells of its normal and nothing of its own direction; between two parallel walls a platform may be anywhere
//! along them. What the returns say of such a direction is noise, and following it would carry the pose along
//! (Zhang, Kaess and Singh 2016: solution remapping).

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use crate::ScanOdometryConfig;

/// A direction is told when its information is so many times what normals at random would seem to tell: their noise
/// may be twice the expected one, and its own part counts once more.
const ABOVE_NOISE: f64 = 2.0;

/// The normal equations of a match, in metres: a turn is counted in metres at the lever's end.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct NormalEquations {
    /// `J' W J`, the information of the returns.
    pub(crate) information: Matrix3<f64>,
    /// `J' W r`.
    pub(crate) gradient: Vector3<f64>,
    /// What of the information the noise of the normals accounts for.
    pub(crate) noise: Matrix3<f64>,
    /// Metres that a turn by a radian counts as.
    pub(crate) lever_m: f64,
}

impl NormalEquations {
    pub(crate) fn new(lever_m: f64) -> Self {
        Self {
            information: Matrix3::zeros(),
            gradient: Vector3::zeros(),
            noise: Matrix3::zeros(),
            lever_m,
        }
    }

    /// Adds what is known beforehand of `[x, y, turn]`, of which `moved` metres have been left already. The returns'
    /// information is in units of their expected variance, of which the true one is `variance_factor` times as much.
    pub(crate) fn add_prior(
        &mut self,
        information: &Matrix3<f64>,
        variance_factor: f64,
        moved: &Vector3<f64>,
    ) {
        let to_radians = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0 / self.lever_m));
        let information = variance_factor * (to_radians * information * to_radians);
        self.information += information;
        self.gradient += information * moved;
    }

    /// Metres and radians to metres.
    pub(crate) fn in_metres(&self, increment: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(increment.x, increment.y, increment.z * self.lever_m)
    }

    /// Metres to metres and radians; of a jacobian, those by metres and radians to those by metres.
    pub(crate) fn in_radians(&self, increment: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(increment.x, increment.y, increment.z / self.lever_m)
    }
}

/// A direction of the plane's motions, `[x, y, turn]` in metres, in the frame of the scanner.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Direction {
    pub(crate) vector: Vector3<f64>,
    pub(crate) is_told: bool,
}

/// The three directions that are told independently of each other.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Observability {
    pub(crate) directions: [Direction; 3],
    pub(crate) lever_m: f64,
}

impl Observability {
    /// The eigenvectors of the information without its noise. `variance_factor` is the variance of the residuals
    /// over the expected one. Numbers that are not finite tell nothing.
    pub(crate) fn of(
        equations: &NormalEquations,
        variance_factor: f64,
        config: &ScanOdometryConfig,
    ) -> Self {
        let NormalEquations { information, noise, lever_m, .. } = equations;
        let told = information - noise;
        if !told.iter().all(|element| element.is_finite()) {
            return Self::nothing(*lever_m);
        }
        let eigen = SymmetricEigen::new(told);
        let directions = std::array::from_fn(|index| {
            let vector: Vector3<f64> = eigen.eigenvectors.column(index).into_owned();
            let noise = (vector.transpose() * noise * vector).x;
            let told = eigen.eigenvalues[index];
            let turn_m = config.max_std_dev_rad * lever_m;
            let allowed_m2 = vector.xy().norm_squared() * config.max_std_dev_m.powi(2)
                + vector.z.powi(2) * turn_m.powi(2);
            let is_told = told > (ABOVE_NOISE - 1.0) * noise && told * allowed_m2 > variance_factor;
            Direction { vector, is_told }
        });
        Self { directions, lever_m: *lever_m }
    }

    pub(crate) fn nothing(lever_m: f64) -> Self {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        Self { directions: axes.map(|vector| Direction { vector, is_told: false }), lever_m }
    }

    pub(crate) fn tells_nothing(&self) -> bool {
        self.directions.iter().all(|direction| !direction.is_told)
    }

    /// The directions that keep the prediction.
    pub(crate) fn held(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.directions.iter().filter(|one| !one.is_told).map(|one| &one.vector)
    }

    /// Takes an increment in metres to its part that is told.
    pub(crate) fn projector(&self) -> Matrix3<f64> {
        self.directions
            .iter()
            .filter(|one| one.is_told)
            .map(|one| one.vector * one.vector.transpose())
            .sum()
    }

    /// The increment, in metres, that solves the equations where they tell something, and takes back what was `moved`
    /// where they do not.
    pub(crate) fn solve(
        &self,
        equations: &NormalEquations,
        moved: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let inverse = self.inverse(equations)?;
        let held = Matrix3::identity() - self.projector();
        Some(-(inverse * equations.gradient) - held * moved)
    }

    /// The inverse of the information within the directions that are told, 0 in the others.
    pub(crate) fn inverse(&self, equations: &NormalEquations) -> Option<Matrix3<f64>> {
        let projector = self.projector();
        let held = Matrix3::identity() - projector;
        // As large as the rest, so that the inverse is as exact as without it.
        let size = equations.information.trace();
        let reduced = projector * equations.information * projector + size * held;
        Some(projector * reduced.try_inverse()? * projector)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corridor() -> NormalEquations {
        // A thousand returns of a centimetre each on walls along x, whose normals deviate by 2 degrees.
        let seen = 1000.0 / 1e-4;
        let stray = seen * 0.035_f64.powi(2);
        NormalEquations {
            information: Matrix3::from_diagonal(&Vector3::new(1.2 * stray, seen, 0.5 * seen)),
            gradient: Vector3::new(3.0 * stray, -0.01 * seen, 0.0),
            noise: Matrix3::from_diagonal(&Vector3::new(stray, 0.0, 0.0)),
            lever_m: 2.0,
        }
    }

    #[test]
    fn the_axis_of_a_corridor_is_held() {
        let equations = corridor();
        let told = Observability::of(&equations, 1.0, &ScanOdometryConfig::default());
        let held: Vec<_> = told.held().map(|vector| vector.x.abs()).collect();
        assert_eq!(held.len(), 1);
        assert!((held[0] - 1.0).abs() < 1e-9);
        let step = told.solve(&equations, &Vector3::new(0.2, 0.1, 0.0)).unwrap();
        assert!((step - Vector3::new(-0.2, 0.01, 0.0)).norm() < 1e-9, "{step}");
        assert_eq!(told.inverse(&equations).unwrap().m11, 0.0);
    }

    #[test]
    fn an_end_of_the_corridor_that_ten_beams_meet_is_enough() {
        let mut equations = corridor();
        equations.information.m11 += 10.0 / 1e-4;
        let told = Observability::of(&equations, 1.0, &ScanOdometryConfig::default());
        assert_eq!(told.held().count(), 0);
    }

    #[test]
    fn little_information_and_bad_numbers_tell_nothing() {
        let mut equations = corridor();
        equations.information = Matrix3::from_diagonal_element(100.0);
        equations.noise = Matrix3::zeros();
        let config = ScanOdometryConfig::default();
        assert!(Observability::of(&equations, 1.0, &config).tells_nothing());
        equations.information.m12 = f64::NAN;
        assert!(Observability::of(&equations, 1.0, &config).tells_nothing());
    }
}
