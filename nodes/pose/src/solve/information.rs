//! What observations tell of a pose: the sums of the normal equations.

use nalgebra::{Matrix6, Vector6};

/// `J' W J` (its upper half, row by row) and `J' W e`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Information {
    upper: [f64; 21],
    pull: [f64; 6],
}

impl Information {
    /// Adds an error with its derivatives.
    #[inline]
    pub(super) fn add(&mut self, error: f64, jacobian: &[f64; 6], weight: f64) {
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

    pub(super) fn matrix(&self) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        let mut upper = self.upper.iter();
        for row in 0..6 {
            for column in row..6 {
                let value = upper.next().copied().unwrap_or_default();
                matrix[(row, column)] = value;
                matrix[(column, row)] = value;
            }
        }
        matrix
    }

    /// Half the derivative of the sum of squares by the perturbation.
    pub(super) fn pull(&self) -> Vector6<f64> {
        Vector6::from(self.pull)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sums_are_those_of_the_matrices() {
        let rows = [[1.0, -2.0, 0.5, 3.0, 0.0, 7.0], [0.0, 1.0, -1.0, 2.0, 5.0, -3.0]];
        let mut information = Information::default();
        let (mut matrix, mut pull) = (Matrix6::zeros(), Vector6::zeros());
        for (row, (error, weight)) in rows.iter().zip([(2.0, 0.5), (-1.0, 3.0)]) {
            information.add(error, row, weight);
            let jacobian = Vector6::from(*row);
            matrix += weight * jacobian * jacobian.transpose();
            pull += weight * error * jacobian;
        }
        assert_eq!(information.matrix(), matrix);
        assert_eq!(information.pull(), pull);
    }
}
