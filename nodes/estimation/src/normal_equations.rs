//! The normal equations of six unknowns: sums over observations.

use nalgebra::{Matrix6, Vector3, Vector6};

use crate::Symmetric3;

/// Where `(row, column)` of the upper half is, row by row.
const fn entry(row: usize, column: usize) -> usize {
    row * 6 - row * (row + 1) / 2 + column
}

/// `J' W J` (its upper half, row by row) and `J' W e`. Gauss-Newton's step is `-information^-1 pull` where `J` is the
/// derivative of the error `e`.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct NormalEquations {
    upper: [f64; 21],
    pull: [f64; 6],
}

impl NormalEquations {
    /// Adds a scalar error with its derivatives.
    #[inline]
    pub fn add(&mut self, error: f64, jacobian: &[f64; 6], weight: f64) {
        let mut entry = 0;
        for row in 0..6 {
            let weighted = weight * jacobian[row];
            self.pull[row] += weighted * error;
            for value in &jacobian[row..] {
                self.upper[entry] += weighted * value;
                entry += 1;
            }
        }
    }

    /// Adds a point: the error `e` from where it is to where it should be, its weight matrix `M`, and the lever `y` from the
    /// origin of its frame to it. A [composite](crate::perturbation::composite) perturbation `[v; w]` shortens `e` by
    /// `A [v; w]` with `A = [I, -[y]x]`: this is `A' M A` and `A' M e`. Gives `M e`, weighted.
    #[inline]
    pub fn add_point(
        &mut self,
        error_m: &Vector3<f64>,
        weight: f64,
        matrix: &Symmetric3,
        lever_m: &Vector3<f64>,
    ) -> Vector3<f64> {
        let y = lever_m;
        let pull = weight * matrix.times(error_m);
        let turn_pull = y.cross(&pull);
        for (sum, value) in self.pull.iter_mut().zip(pull.iter().chain(turn_pull.iter())) {
            *sum += value;
        }
        let Symmetric3 { xx, xy, xz, yy, yz, zz } = *matrix;
        // -M [y]x, row by row: a row m' of M gives (y x m)'.
        let first = weight * y.cross(&Vector3::new(xx, xy, xz));
        let second = weight * y.cross(&Vector3::new(xy, yy, yz));
        let third = weight * y.cross(&Vector3::new(xz, yz, zz));
        // In the order of the upper half. The last six are [y]x of that, column by column.
        let values = [
            weight * xx,
            weight * xy,
            weight * xz,
            first.x,
            first.y,
            first.z,
            weight * yy,
            weight * yz,
            second.x,
            second.y,
            second.z,
            weight * zz,
            third.x,
            third.y,
            third.z,
            y.y * third.x - y.z * second.x,
            y.y * third.y - y.z * second.y,
            y.y * third.z - y.z * second.z,
            y.z * first.y - y.x * third.y,
            y.z * first.z - y.x * third.z,
            y.x * second.z - y.y * first.z,
        ];
        for (sum, value) in self.upper.iter_mut().zip(values) {
            *sum += value;
        }
        pull
    }

    /// Adds the sums of others.
    pub fn add_all(&mut self, others: &Self) {
        for (sum, more) in self.upper.iter_mut().zip(others.upper) {
            *sum += more;
        }
        for (sum, more) in self.pull.iter_mut().zip(others.pull) {
            *sum += more;
        }
    }

    /// `J' W J`.
    #[must_use]
    pub fn information(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|row, column| self.upper[entry(row.min(column), row.max(column))])
    }

    /// `J' W e`: half the derivative of the sum of the squared errors.
    #[must_use]
    pub fn pull(&self) -> Vector6<f64> {
        Vector6::from(self.pull)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Matrix3x6, Point3};

    use super::*;
    use crate::Random;
    use crate::perturbation::composite::perturbed;

    #[test]
    fn the_sums_are_those_of_the_matrices() {
        let rows = [[1.0, -2.0, 0.5, 3.0, 0.0, 7.0], [0.0, 1.0, -1.0, 2.0, 5.0, -3.0]];
        let mut equations = NormalEquations::default();
        let (mut matrix, mut pull) = (Matrix6::zeros(), Vector6::zeros());
        for (row, (error, weight)) in rows.iter().zip([(2.0, 0.5), (-1.0, 3.0)]) {
            equations.add(error, row, weight);
            let jacobian = Vector6::from(*row);
            matrix += weight * jacobian * jacobian.transpose();
            pull += weight * error * jacobian;
        }
        assert_eq!(equations.information(), matrix);
        assert_eq!(equations.pull(), pull);
    }

    #[test]
    fn the_sums_over_points_are_those_of_matrices_with_the_numeric_jacobian() {
        const SMALL: f64 = 1e-6;
        let mut random = Random::new(9);
        let pose = random.motion(5.0, 1.0);
        let mut sums = [NormalEquations::default(); 2];
        let (mut information, mut pull) = (Matrix6::zeros(), Vector6::zeros());
        for number in 0..40 {
            let place = 20.0 * random.direction();
            let other = pose * Point3::from(place) + random.direction();
            let matrix = Symmetric3::outer(&random.direction()).plus(0.3, &Symmetric3::IDENTITY);
            let weight = random.between(0.1, 1.0);
            let error = |pose: &Isometry3<f64>| other - pose * Point3::from(place);
            let lever = pose.rotation * place;
            let weighted = sums[number % 2].add_point(&error(&pose), weight, &matrix, &lever);
            assert!((weighted - weight * matrix.times(&error(&pose))).norm() < 1e-12);
            let mut jacobian = Matrix3x6::zeros();
            for column in 0..6 {
                let mut step = Vector6::zeros();
                step[column] = SMALL;
                let slope = (error(&perturbed(&pose, &step)) - error(&perturbed(&pose, &-step)))
                    / (2.0 * SMALL);
                // The error becomes shorter.
                jacobian.set_column(column, &-slope);
            }
            information += weight * jacobian.transpose() * matrix.matrix() * jacobian;
            pull += weight * jacobian.transpose() * matrix.matrix() * error(&pose);
        }
        let [mut all, more] = sums;
        all.add_all(&more);
        assert!((all.information() - information).norm() < 1e-6 * information.norm());
        assert!((all.pull() - pull).norm() < 1e-6 * pull.norm());
    }
}
