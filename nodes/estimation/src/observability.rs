//! Which directions of a pose the measurements constrain, and the solution within these.
//!
//! A wall constrains motion along its normal and none along itself. What noise says of such a direction must not move the pose:
//! it keeps its prediction there (Zhang, Kaess and Singh 2016, "On degeneracy of optimization-based state estimation
//! problems": solution remapping).

use nalgebra::{Const, DimMin, Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};

use crate::covariance::scaled;
use crate::perturbation::parts;

/// Smaller components are what the eigenvectors' own rounding leaves.
const NEGLIGIBLE: f64 = 1e-12;
/// A direction whose shift or turn is smaller than this is a mere turn, or a mere shift.
const ABSENT: f64 = 1e-9;

/// A symmetric matrix of a size that poses have: three numbers in the plane, six in space.
pub trait Symmetric<const N: usize> {
    /// Its eigenvectors, as columns, and their eigenvalues.
    fn eigen(self) -> (SMatrix<f64, N, N>, SVector<f64, N>);
}

impl Symmetric<3> for Matrix3<f64> {
    fn eigen(self) -> (Self, Vector3<f64>) {
        let eigen = self.symmetric_eigen();
        (eigen.eigenvectors, eigen.eigenvalues)
    }
}

impl Symmetric<6> for Matrix6<f64> {
    fn eigen(self) -> (Self, Vector6<f64>) {
        let eigen = self.symmetric_eigen();
        (eigen.eigenvectors, eigen.eigenvalues)
    }
}

/// A direction of the perturbation of a pose. Coordinates are counted in units: of the precision that is wanted, or of
/// metres where a turn counts by the lever that it moves points with.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Direction<const N: usize> {
    /// In units: a vector of length 1. Its sign means nothing.
    pub in_units: SVector<f64, N>,
    /// The eigenvalue of the information in units: 1 where the direction is known to one unit. Never below 0.
    pub information: f64,
    /// Whether it was estimated; otherwise the pose keeps its prediction along it.
    pub estimated: bool,
}

impl<const N: usize> Direction<N> {
    /// Its standard deviation in units; infinite when nothing is known.
    #[must_use]
    pub fn std_dev_in_units(&self) -> f64 {
        self.information.sqrt().recip()
    }
}

impl Direction<6> {
    /// The shift that belongs to it, of length 1, `None` for a mere turn.
    #[must_use]
    pub fn shift(&self) -> Option<Vector3<f64>> {
        parts(&self.in_units).0.try_normalize(ABSENT)
    }

    /// The axis that it turns about, of length 1, `None` for a mere shift.
    #[must_use]
    pub fn axis(&self) -> Option<Vector3<f64>> {
        parts(&self.in_units).1.try_normalize(ABSENT)
    }
}

/// The directions that the measurements constrain independently of each other: the eigenvectors of their information in
/// units.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Observability<const N: usize> {
    /// The best known first.
    pub directions: [Direction<N>; N],
    /// The unit of each coordinate: metres of translation, radians of rotation.
    pub units: SVector<f64, N>,
}

impl<const N: usize> Observability<N> {
    /// The directions that `information` determines (the inverse of a covariance: 1/m^2, 1/rad^2 and mixed). `is_estimated` decides by a direction
    /// in units and the information along it.
    #[must_use]
    pub fn of(
        information: &SMatrix<f64, N, N>,
        units: &SVector<f64, N>,
        is_estimated: impl Fn(&SVector<f64, N>, f64) -> bool,
    ) -> Self
    where
        SMatrix<f64, N, N>: Symmetric<N>,
    {
        let (vectors, values) = scaled(information, units).eigen();
        let mut directions: [Direction<N>; N] = std::array::from_fn(|index| {
            let in_units = SVector::<f64, N>::from_fn(|row, _| {
                let weight = vectors[(row, index)];
                if weight.abs() < NEGLIGIBLE { 0.0 } else { weight }
            });
            // Rounding, or noise that was subtracted, may leave less than nothing.
            let information = values[index].max(0.0);
            let estimated = is_estimated(&in_units, information);
            Direction { in_units, information, estimated }
        });
        directions.sort_by(|a, b| b.information.total_cmp(&a.information));
        Self { directions, units: *units }
    }

    /// Nothing is known: the directions are those of the coordinates.
    #[must_use]
    pub fn nothing(units: &SVector<f64, N>) -> Self {
        let direction = |index: usize| {
            let in_units = SVector::from_fn(|row, _| if row == index { 1.0 } else { 0.0 });
            Direction { in_units, information: 0.0, estimated: false }
        };
        Self { directions: std::array::from_fn(direction), units: *units }
    }

    /// The directions that were not estimated.
    pub fn weak(&self) -> impl Iterator<Item = &Direction<N>> {
        self.directions.iter().filter(|direction| !direction.estimated)
    }

    /// How many directions were estimated.
    #[must_use]
    pub fn estimated(&self) -> usize {
        self.directions.iter().filter(|direction| direction.estimated).count()
    }

    /// Takes a perturbation in units to its part along the directions that were not estimated.
    #[must_use]
    pub fn weak_projector(&self) -> SMatrix<f64, N, N> {
        self.weak().map(|direction| direction.in_units * direction.in_units.transpose()).sum()
    }

    /// Takes a perturbation in units to its part along the directions that were estimated.
    #[must_use]
    pub fn projector(&self) -> SMatrix<f64, N, N> {
        SMatrix::identity() - self.weak_projector()
    }
}

/// Information in units without any tie between the directions that are estimated and those that are `held` (the projector
/// to them). Along the latter it is `size`: no step leads there, and the inverse stays as exact as without them where that
/// is as large as the rest.
#[must_use]
pub fn restricted<const N: usize>(
    information: &SMatrix<f64, N, N>,
    held: &SMatrix<f64, N, N>,
    size: f64,
) -> SMatrix<f64, N, N> {
    let estimated = SMatrix::<f64, N, N>::identity() - held;
    estimated * information * estimated + size * held
}

/// Whether every direction has at least the information 1. Much quicker than the eigenvectors.
#[must_use]
pub fn all_estimated<const N: usize>(information_in_units: &SMatrix<f64, N, N>) -> bool
where
    Const<N>: DimMin<Const<N>, Output = Const<N>>,
{
    (information_in_units - SMatrix::<f64, N, N>::identity()).cholesky().is_some()
}

/// A direction that is known to one unit is estimated.
#[must_use]
pub fn to_one_unit<const N: usize>(_: &SVector<f64, N>, information: f64) -> bool {
    information >= 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_that_are_known_are_separated_from_those_that_are_not() {
        // x and y are known only in their sum, z not at all, the turns well.
        let limits = Vector6::new(0.1, 0.1, 0.1, 0.01, 0.01, 0.01);
        let mut information = Matrix6::from_diagonal(&Vector6::new(0.0, 0.0, 0.0, 5e4, 6e4, 7e4));
        for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            information[(row, column)] = 200.0;
        }
        assert!(!all_estimated(&scaled(&information, &limits)));
        let observability = Observability::of(&information, &limits, to_one_unit);
        assert_eq!(observability.estimated(), 4);
        let weak: Vec<Direction<6>> = observability.weak().copied().collect();
        assert!(weak.iter().all(|direction| direction.std_dev_in_units() == f64::INFINITY));
        let error = Vector6::new(1.0, 0.0, 3.0, 0.0, 0.0, 2.0);
        let kept = observability.weak_projector() * error;
        let expected = Vector6::new(0.5, -0.5, 3.0, 0.0, 0.0, 0.0);
        assert!((kept - expected).norm() < 1e-9, "{kept}");
        assert!((observability.projector() * error + kept - error).norm() < 1e-12);
        // The sum of x and y: an eigenvalue of 400 / m^2 along a limit of 0.1 m.
        let sum = observability.directions[3];
        assert!((sum.std_dev_in_units() - 0.5).abs() < 1e-9);
        assert!((sum.shift().unwrap().x.abs() - 0.5_f64.sqrt()).abs() < 1e-9);
        assert_eq!(sum.axis(), None);
        information += 200.0 * Matrix6::identity();
        assert!(all_estimated(&scaled(&information, &limits)));
        assert_eq!(Observability::of(&information, &limits, to_one_unit).estimated(), 6);
    }

    #[test]
    fn no_step_leads_along_what_is_held() {
        let information = Matrix6::from_fn(|row, column| {
            let same = if row == column { 10.0 } else { 0.0 };
            same + 1.0 / (1 + row + column) as f64
        });
        let units = Vector6::repeat(1.0);
        let observability = Observability::of(&information, &units, |_, along| along > 10.3);
        assert!((1..6).contains(&observability.estimated()));
        let held = observability.weak_projector();
        let pull = Vector6::new(1.0, -2.0, 3.0, 0.5, 0.1, -1.0);
        let step = restricted(&information, &held, 10.0)
            .cholesky()
            .unwrap()
            .solve(&(observability.projector() * pull));
        assert!((held * step).norm() < 1e-12 && step.norm() > 0.01, "{step}");
        assert_eq!(Observability::<6>::nothing(&units).estimated(), 0);
    }

    #[test]
    fn what_rounding_leaves_of_a_direction_is_no_shift() {
        // Ties between shifts and turns that are below the digits of the information.
        let mut information = Matrix6::from_diagonal(&Vector6::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0));
        for axis in 0..3 {
            information[(axis, axis + 3)] = 1e-14;
            information[(axis + 3, axis)] = 1e-14;
        }
        let observability = Observability::of(&information, &Vector6::repeat(1.0), to_one_unit);
        for direction in observability.directions {
            assert_eq!(direction.in_units.iter().filter(|weight| **weight != 0.0).count(), 1);
        }
    }
}
