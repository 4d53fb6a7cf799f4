//! How the distance between two corresponding places is measured: the idea in which the methods differ.

use estimation::Symmetric3;
use nalgebra::Vector3;

use super::config::Method;

/// The variance of a plane along its normal, in units of that within it (Segal et al. 2009, section III.B: "epsilon").
const THICKNESS: f64 = 1e-3;

/// The weight matrix `M` of a correspondence: its squared error is `e^T M e` for the vector `e` from the source's point to
/// the target's. Scaled such that a unit of it is a square metre across the surface.
///
/// The target's surface has the normals `target_normals` (the mean of `n n^T`), the source's along `source_normal`, both
/// in the target's frame; zero where there is no surface.
#[inline]
pub(super) fn weight_matrix(
    method: Method,
    target_normals: &Symmetric3,
    source_normal: &Vector3<f64>,
) -> Symmetric3 {
    match method {
        Method::PointToPoint => Symmetric3::IDENTITY,
        Method::PointToPlane => *target_normals,
        Method::Generalised | Method::VoxelisedGeneralised => {
            // The covariances of both, I - (1 - epsilon) n n^T each, add up; the weight is the inverse of the sum.
            let normals = target_normals.plus(1.0, &Symmetric3::outer(source_normal));
            let twice = Symmetric3::default().plus(2.0, &Symmetric3::IDENTITY);
            let inverse = twice.plus(THICKNESS - 1.0, &normals).inverse();
            Symmetric3::default().plus(2.0 * THICKNESS, &inverse)
        }
    }
}

/// The information of a correspondence that both surfaces agree upon: `n n^T` where the normals are the same, nothing where they
/// are at random. Noise of the two has no part in common, and adds up to nothing.
#[inline]
pub(super) fn agreement(target_normals: &Symmetric3, source_normal: &Vector3<f64>) -> Symmetric3 {
    // The symmetric part of N n n^T.
    let n = target_normals.times(source_normal);
    let (a, b) = (&n, source_normal);
    Symmetric3 {
        xx: a.x * b.x,
        xy: 0.5 * (a.x * b.y + a.y * b.x),
        xz: 0.5 * (a.x * b.z + a.z * b.x),
        yy: a.y * b.y,
        yz: 0.5 * (a.y * b.z + a.z * b.y),
        zz: a.z * b.z,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::testing::Random;

    #[test]
    fn the_weight_of_the_generalised_method_is_the_inverse_of_both_covariances() {
        let mut random = Random::new(1);
        for _ in 0..20 {
            let (a, b) = (random.direction(), random.direction());
            let covariance =
                |n: &Vector3<f64>| Matrix3::identity() - (1.0 - THICKNESS) * n * n.transpose();
            let expected =
                2.0 * THICKNESS * (covariance(&a) + covariance(&b)).try_inverse().unwrap();
            let found = weight_matrix(Method::Generalised, &Symmetric3::outer(&a), &b).matrix();
            assert!((found - expected).norm() < 1e-9, "{found} {expected}");
            let same = weight_matrix(Method::Generalised, &Symmetric3::outer(&a), &-a);
            assert!((a.dot(&same.times(&a)) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn noise_of_two_surfaces_agrees_upon_nothing() {
        let mut random = Random::new(2);
        let mut noisy = || {
            (Vector3::z() + 0.1 * Vector3::new(random.normal(), random.normal(), 0.0)).normalize()
        };
        let sum = (0..10_000).fold(Symmetric3::default(), |sum, _| {
            sum.plus(1e-4, &agreement(&Symmetric3::outer(&noisy()), &noisy()))
        });
        assert!(sum.zz > 0.95 && sum.xx.abs() < 5e-4 && sum.yy.abs() < 5e-4, "{sum:?}");
    }
}
