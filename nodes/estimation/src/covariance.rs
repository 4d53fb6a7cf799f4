//! Covariances: propagated, scaled, and what an error is worth by them.

use nalgebra::{Const, DimMin, Matrix3, Matrix6, SMatrix, SVector};

/// The covariance of `jacobian * error`: `J C J'`.
#[must_use]
pub fn propagated<const M: usize, const N: usize>(
    jacobian: &SMatrix<f64, M, N>,
    covariance: &SMatrix<f64, N, N>,
) -> SMatrix<f64, M, M> {
    jacobian * covariance * jacobian.transpose()
}

/// The covariance of independent errors with these standard deviations.
#[must_use]
pub fn of_std_devs<const N: usize>(std_devs: &SVector<f64, N>) -> SMatrix<f64, N, N> {
    SMatrix::from_diagonal(&std_devs.component_mul(std_devs))
}

/// A covariance, or an information, with each coordinate multiplied by its own factor.
#[must_use]
pub fn scaled<const N: usize>(
    matrix: &SMatrix<f64, N, N>,
    factors: &SVector<f64, N>,
) -> SMatrix<f64, N, N> {
    SMatrix::from_fn(|row, column| matrix[(row, column)] * factors[row] * factors[column])
}

/// The mean of a matrix and its transpose: rounding leaves the halves of a covariance a little apart.
#[must_use]
pub fn symmetrized<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    0.5 * (matrix + matrix.transpose())
}

/// The matrix that rotates both the shift and the turn of a perturbation.
#[must_use]
pub fn rotation_of_both(rotation: &Matrix3<f64>) -> Matrix6<f64> {
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(rotation);
    both
}

/// The squared length of an error in standard deviations (the squared Mahalanobis distance): chi-square distributed where
/// the covariance is right. `None` when the covariance is not positive definite.
#[must_use]
pub fn squared_in_std_devs<const N: usize>(
    error: &SVector<f64, N>,
    covariance: &SMatrix<f64, N, N>,
) -> Option<f64>
where
    Const<N>: DimMin<Const<N>, Output = Const<N>>,
{
    Some(error.dot(&covariance.cholesky()?.solve(error)))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::Random;
    use crate::chi_square::quantile;

    #[test]
    fn errors_drawn_from_a_covariance_are_worth_what_the_chi_square_distribution_says() {
        let root = Matrix3::new(2.0, 0.0, 0.0, 0.7, 1.0, 0.0, -0.3, 0.4, 0.5);
        let covariance = symmetrized(&propagated(&root, &Matrix3::identity()));
        let mut random = Random::new(5);
        let median = quantile(3, 0.5);
        let below = (0..4000).filter(|_| {
            let error = root * Vector3::from_fn(|_, _| random.normal());
            squared_in_std_devs(&error, &covariance).unwrap() < median
        });
        let share = below.count() as f64 / 4000.0;
        assert!((share - 0.5).abs() < 0.03, "{share}");
        assert_eq!(squared_in_std_devs(&Vector3::x(), &Matrix3::zeros()), None);
    }

    #[test]
    fn scaling_is_propagation_by_a_diagonal_matrix() {
        let covariance = Matrix3::new(4.0, 1.0, 0.5, 1.0, 2.0, -0.3, 0.5, -0.3, 1.0);
        let factors = Vector3::new(2.0, 0.5, 3.0);
        let expected = propagated(&Matrix3::from_diagonal(&factors), &covariance);
        assert!((scaled(&covariance, &factors) - expected).norm() < 1e-12);
        assert_eq!(of_std_devs(&factors).diagonal(), Vector3::new(4.0, 0.25, 9.0));
    }
}
