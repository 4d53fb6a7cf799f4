//! Which directions of the pose the observations tell of.

use nalgebra::{Matrix6, SymmetricEigen, Vector3, Vector6};

use super::perturbation::parts;

/// A direction that is known to just the wanted standard deviation has this eigenvalue in units of the limits.
const NEEDED: f64 = 1.0;
/// Smaller components are what the eigenvectors' own rounding leaves.
const NEGLIGIBLE: f64 = 1e-12;

/// A direction of the perturbation of a pose, in the camera frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Direction {
    /// The shift and the turn, each in units of its limit: a vector of length 1. Its sign means nothing.
    pub in_limits: Vector6<f64>,
    /// Metres of shift and radians of turn, as large as the limit is in this direction.
    pub limit: Vector6<f64>,
    /// The standard deviation over the limit; infinite when nothing is told.
    pub std_dev_in_limits: f64,
    /// Whether it was estimated.
    pub estimated: bool,
}

impl Direction {
    /// The shift that belongs to it, of length 1, `None` for a mere turn.
    #[must_use]
    pub fn shift(&self) -> Option<Vector3<f64>> {
        parts(&self.in_limits).0.try_normalize(NEGLIGIBLE)
    }

    /// The axis that it turns about, of length 1, `None` for a mere shift.
    #[must_use]
    pub fn axis(&self) -> Option<Vector3<f64>> {
        parts(&self.in_limits).1.try_normalize(NEGLIGIBLE)
    }
}

/// What the observations tell, direction by direction: the eigenvectors of their information, scaled by the standard
/// deviations that are wanted (Zhang, Kaess and Singh 2016, "On degeneracy of optimization-based state estimation
/// problems").
#[derive(Clone, PartialEq, Debug)]
pub struct Observability {
    /// The best told one first.
    pub directions: [Direction; 6],
}

impl Observability {
    /// What `information` tells (the inverse of a covariance: 1/m^2, 1/rad^2 and mixed). A direction is estimated when its
    /// standard deviation is no larger than the limits.
    #[must_use]
    pub fn of(information: &Matrix6<f64>, limits: &Vector6<f64>) -> Self {
        let eigen = SymmetricEigen::new(scaled(information, limits));
        let mut directions: [Direction; 6] = std::array::from_fn(|index| {
            let column = eigen.eigenvectors.column(index).into_owned();
            let in_limits =
                column.map(|weight| if weight.abs() < NEGLIGIBLE { 0.0 } else { weight });
            // Rounding may leave less than nothing.
            let told = eigen.eigenvalues[index].max(0.0);
            Direction {
                in_limits,
                limit: in_limits.component_mul(limits),
                std_dev_in_limits: told.sqrt().recip(),
                estimated: told >= NEEDED,
            }
        });
        directions.sort_by(|a, b| a.std_dev_in_limits.total_cmp(&b.std_dev_in_limits));
        Self { directions }
    }

    /// The directions that were not estimated: along them the pose stays where it was.
    pub fn weak(&self) -> impl Iterator<Item = &Direction> {
        self.directions.iter().filter(|direction| !direction.estimated)
    }

    /// How many directions were estimated.
    #[must_use]
    pub fn estimated(&self) -> usize {
        self.directions.iter().filter(|direction| direction.estimated).count()
    }

    /// Takes a perturbation in units of the limits to its part along the directions that are not estimated.
    pub(crate) fn weak_projector(&self) -> Matrix6<f64> {
        self.weak().map(|direction| direction.in_limits * direction.in_limits.transpose()).sum()
    }
}

/// The information on a perturbation in units of the limits.
pub(crate) fn scaled(information: &Matrix6<f64>, limits: &Vector6<f64>) -> Matrix6<f64> {
    Matrix6::from_fn(|row, column| information[(row, column)] * limits[row] * limits[column])
}

/// Whether every direction is told as well as is wanted. Much quicker than the eigenvectors.
pub(crate) fn all_told(scaled_information: &Matrix6<f64>) -> bool {
    (scaled_information - NEEDED * Matrix6::identity()).cholesky().is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_is_told_apart_from_what_is_not() {
        // x and y are known only in their sum, z not at all, the turns well.
        let limits = Vector6::new(0.1, 0.1, 0.1, 0.01, 0.01, 0.01);
        let mut information = Matrix6::from_diagonal(&Vector6::new(0.0, 0.0, 0.0, 5e4, 6e4, 7e4));
        for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            information[(row, column)] = 200.0;
        }
        assert!(!all_told(&scaled(&information, &limits)));
        let observability = Observability::of(&information, &limits);
        assert_eq!(observability.estimated(), 4);
        let weak: Vec<Direction> = observability.weak().copied().collect();
        assert!(weak.iter().all(|direction| direction.std_dev_in_limits == f64::INFINITY));
        let kept = observability.weak_projector() * Vector6::new(1.0, 0.0, 3.0, 0.0, 0.0, 2.0);
        let expected = Vector6::new(0.5, -0.5, 3.0, 0.0, 0.0, 0.0);
        assert!((kept - expected).norm() < 1e-9, "{kept}");
        // The sum of x and y: an eigenvalue of 400 / m^2 along a limit of 0.1 m.
        let sum = observability.directions[3];
        assert!((sum.std_dev_in_limits - 0.5).abs() < 1e-9);
        assert!((sum.shift().unwrap().x.abs() - 0.5_f64.sqrt()).abs() < 1e-9);
        assert_eq!(sum.axis(), None);
        information += 200.0 * Matrix6::identity();
        assert!(all_told(&scaled(&information, &limits)));
        assert_eq!(Observability::of(&information, &limits).estimated(), 6);
    }
}
