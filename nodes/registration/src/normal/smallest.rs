//! The direction in which points scatter least.

use estimation::Symmetric3;
use nalgebra::Vector3;

/// Newton's steps, at most: six are enough for what passes for a plane.
const MOST_STEPS: usize = 12;
/// ... and they end when one is shorter than this share of the sum of the eigenvalues.
const SETTLED: f64 = 1e-9;
/// Points that scatter across the line that they lie along by less than this share (of variances: a fifth of its length)
/// may be a plane of any normal about it: so lie those of a single ray.
const THINNEST_PLANE: f64 = 0.05;
/// A plane scatters less along its normal than this share of its least variance within.
const THICKEST_PLANE: f64 = 0.5;

/// The normal of points with this scatter, if they lie on a plane: neither along a line nor all about.
///
/// The least eigenvalue is the least root of the characteristic polynomial, whose roots are real and not negative: Newton's
/// steps from 0 rise to it without passing it.
pub(super) fn plane_normal(scatter: &Symmetric3) -> Option<Vector3<f64>> {
    let Symmetric3 { xx, xy, xz, yy, yz, zz } = *scatter;
    let trace = xx + yy + zz;
    let minors = (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz);
    let determinant =
        xx * (yy * zz - yz * yz) - xy * (xy * zz - xz * yz) + xz * (xy * yz - xz * yy);
    let mut least = 0.0;
    for _ in 0..MOST_STEPS {
        let value = ((least - trace) * least + minors) * least - determinant;
        let slope = (3.0 * least - 2.0 * trace) * least + minors;
        let step = -value / slope;
        // Nothing to divide by where the points lie on a line or are one.
        if !step.is_finite() || step < SETTLED * trace {
            break;
        }
        least += step;
    }
    // The other two, by their sum and their product.
    let sum = trace - least;
    let product = (minors - least * sum).max(0.0);
    let half_gap = (0.25 * sum * sum - product).max(0.0).sqrt();
    let (middle, largest) = (0.5 * sum - half_gap, 0.5 * sum + half_gap);
    let plane = middle > THINNEST_PLANE * largest && least < THICKEST_PLANE * middle;
    plane.then(|| null_direction(&scatter.plus(-least, &Symmetric3::IDENTITY))).flatten()
}

/// The direction that a matrix of rank 2 takes to nothing: across its rows.
fn null_direction(matrix: &Symmetric3) -> Option<Vector3<f64>> {
    let Symmetric3 { xx, xy, xz, yy, yz, zz } = *matrix;
    let rows = [Vector3::new(xx, xy, xz), Vector3::new(xy, yy, yz), Vector3::new(xz, yz, zz)];
    let across = [rows[0].cross(&rows[1]), rows[1].cross(&rows[2]), rows[2].cross(&rows[0])];
    let [a, b, c] = across.map(|direction| direction.norm_squared());
    let longest = across[if a >= b && a >= c {
        0
    } else if b >= c {
        1
    } else {
        2
    }];
    longest.try_normalize(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3, SymmetricEigen};
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_is_the_eigenvector_of_the_least_eigenvalue(
            turn in prop::array::uniform3(-3.0..3.0_f64), scale in 1e-4..1e4_f64,
            least in prop_oneof![Just(0.0), 1e-9..0.1_f64], middle in 0.3..1.0_f64,
        ) {
            let turn = Rotation3::new(Vector3::from(turn)).into_inner();
            let matrix = scale * turn * Matrix3::from_diagonal(&Vector3::new(1.0, least, middle)) * turn.transpose();
            let scatter = Symmetric3 {
                xx: matrix.m11, xy: matrix.m12, xz: matrix.m13, yy: matrix.m22, yz: matrix.m23, zz: matrix.m33,
            };
            let found = plane_normal(&scatter).unwrap();
            let eigen = SymmetricEigen::new(matrix);
            let expected = eigen.eigenvectors.column(eigen.eigenvalues.imin());
            prop_assert!((found.dot(&expected).abs() - 1.0).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn lines_blobs_and_points_have_none() {
        let diagonal =
            |xx, yy, zz| plane_normal(&Symmetric3 { xx, yy, zz, ..Symmetric3::default() });
        assert_eq!(diagonal(1.0, 0.001, 0.0005), None);
        assert_eq!(diagonal(1.0, 0.0, 0.0), None);
        assert_eq!(diagonal(1.0, 1.0, 1.0), None);
        assert_eq!(diagonal(0.0, 0.0, 0.0), None);
        assert_eq!(diagonal(f64::NAN, 1.0, 1.0), None);
        assert_eq!(diagonal(1.0, 0.0, 1.0).map(|normal| normal.abs()), Some(Vector3::y()));
    }
}
