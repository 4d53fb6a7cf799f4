//! Which directions of the pose the correspondences tell of.

use nalgebra::{Matrix6, SymmetricEigen, Vector3, Vector6};

use super::motion::parts;
use super::normal_equations::NormalEquations;

/// Smaller components are what the eigenvectors' own rounding leaves.
const NEGLIGIBLE: f64 = 1e-9;

/// A direction of the perturbation of a pose, along the axes of the target.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Direction {
    /// The shift in metres, and the turn in metres that it moves points by: a vector of length 1. Its sign means nothing.
    pub in_metres: Vector6<f64>,
    /// How well it is told: as if this share of the correspondences looked straight along it.
    pub told_share: f64,
    /// Whether it was estimated.
    pub estimated: bool,
}

impl Direction {
    /// The shift that belongs to it, of length 1, `None` for a mere turn.
    #[must_use]
    pub fn shift(&self) -> Option<Vector3<f64>> {
        parts(&self.in_metres).0.try_normalize(NEGLIGIBLE)
    }

    /// The axis that it turns about, of length 1, `None` for a mere shift.
    #[must_use]
    pub fn axis(&self) -> Option<Vector3<f64>> {
        parts(&self.in_metres).1.try_normalize(NEGLIGIBLE)
    }
}

/// What the correspondences tell, direction by direction: the eigenvectors of what the surfaces agree upon (Zhang, Kaess
/// and Singh 2016, "On degeneracy of optimization-based state estimation problems"). The share in place of the bare
/// eigenvalue makes it a matter of the scene, not of how many points it is seen with.
#[derive(Clone, PartialEq, Debug)]
pub struct Observability {
    /// The best told one first.
    pub directions: [Direction; 6],
    /// A turn by a radian moves the points by so much, in the mean of squares.
    pub lever_m: f64,
}

impl Observability {
    /// What sums over agreements tell.
    pub(super) fn of(agreement: &NormalEquations, min_told_share: f64) -> Self {
        let lever_m = agreement.lever_m().max(f64::MIN_POSITIVE);
        let scale = in_metres(lever_m).map(f64::recip);
        let information = agreement.information() / agreement.count.max(1) as f64;
        let scaled =
            Matrix6::from_fn(|row, column| information[(row, column)] * scale[row] * scale[column]);
        let eigen = SymmetricEigen::new(scaled);
        let mut directions: [Direction; 6] = std::array::from_fn(|index| {
            let column = eigen.eigenvectors.column(index).into_owned();
            // Rounding, and noise that happens to disagree, may leave less than nothing.
            let told_share = eigen.eigenvalues[index].max(0.0);
            Direction { in_metres: column, told_share, estimated: told_share > min_told_share }
        });
        directions.sort_by(|a, b| b.told_share.total_cmp(&a.told_share));
        Self { directions, lever_m }
    }

    /// The directions that were not estimated: along them the pose stays where the guess was.
    pub fn weak(&self) -> impl Iterator<Item = &Direction> {
        self.directions.iter().filter(|direction| !direction.estimated)
    }

    /// How many directions were estimated.
    #[must_use]
    pub fn estimated(&self) -> usize {
        self.directions.iter().filter(|direction| direction.estimated).count()
    }

    /// Takes a perturbation in metres to its part along the directions that are not estimated.
    pub(super) fn weak_projector(&self) -> Matrix6<f64> {
        self.weak().map(|direction| direction.in_metres * direction.in_metres.transpose()).sum()
    }

    /// What takes a perturbation to metres, element by element.
    pub(super) fn in_metres(&self) -> Vector6<f64> {
        in_metres(self.lever_m)
    }
}

fn in_metres(lever_m: f64) -> Vector6<f64> {
    Vector6::new(1.0, 1.0, 1.0, lever_m, lever_m, lever_m)
}
