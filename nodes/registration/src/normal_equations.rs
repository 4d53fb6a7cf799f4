//! The sums over the correspondences.

use estimation::{NormalEquations, Symmetric3};
use nalgebra::{Matrix6, Vector3, Vector6};

/// The normal equations of a pose, and what else is summed over correspondences.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Sums {
    equations: NormalEquations,
    /// The sum of the weighted squared errors.
    pub(super) squares_m2: f64,
    /// The sum of the squared levers.
    levers_m2: f64,
    /// How many correspondences there are.
    pub(super) count: usize,
}

impl Sums {
    /// Adds a correspondence: the error `e` from the source's point to the target's, its weight, its weight matrix, and the
    /// lever from the source's origin to the point.
    #[inline]
    pub(super) fn add(
        &mut self,
        error_m: &Vector3<f64>,
        weight: f64,
        matrix: &Symmetric3,
        lever_m: &Vector3<f64>,
    ) {
        let pull = self.equations.add_point(error_m, weight, matrix, lever_m);
        self.squares_m2 += error_m.dot(&pull);
        self.levers_m2 += lever_m.norm_squared();
        self.count += 1;
    }

    /// Adds the sums of others.
    pub(super) fn add_all(&mut self, others: &Self) {
        self.equations.add_all(&others.equations);
        self.squares_m2 += others.squares_m2;
        self.levers_m2 += others.levers_m2;
        self.count += others.count;
    }

    /// `sum A' M A`.
    pub(super) fn information(&self) -> Matrix6<f64> {
        self.equations.information()
    }

    /// `sum A' M e`.
    pub(super) fn pull(&self) -> Vector6<f64> {
        self.equations.pull()
    }

    /// A metre of shift, and the turn that moves points by a metre in the mean of squares.
    pub(super) fn units(&self) -> Vector6<f64> {
        let lever_m = (self.levers_m2 / self.count.max(1) as f64).sqrt();
        let turn_rad = lever_m.max(f64::MIN_POSITIVE).recip();
        Vector6::new(1.0, 1.0, 1.0, turn_rad, turn_rad, turn_rad)
    }
}

#[cfg(test)]
mod tests {
    use estimation::Random;

    use super::*;

    #[test]
    fn errors_and_levers_are_summed_in_parts_and_put_together() {
        let mut random = Random::new(9);
        let mut sums = [Sums::default(); 2];
        let mut squares_m2 = 0.0;
        for number in 0..40 {
            let (error, weight) = (random.direction(), random.between(0.1, 1.0));
            let matrix = Symmetric3::outer(&random.direction()).plus(0.3, &Symmetric3::IDENTITY);
            sums[number % 2].add(&error, weight, &matrix, &(20.0 * random.direction()));
            squares_m2 += weight * error.dot(&matrix.times(&error));
        }
        let [mut all, more] = sums;
        all.add_all(&more);
        assert!((all.squares_m2 - squares_m2).abs() < 1e-9 * squares_m2);
        assert_eq!(all.count, 40);
        assert!((all.units() - Vector6::new(1.0, 1.0, 1.0, 0.05, 0.05, 0.05)).norm() < 1e-12);
    }
}
