//! The motion between two sets of points that are known to be the same.

use nalgebra::{
    Isometry3, Matrix3, Point3, Rotation3, SVD, SymmetricEigen, Translation3, UnitQuaternion,
    Vector3,
};

/// Points that scatter across their longest extent by less than this share of it are a line, about which everything may
/// turn.
const LEAST_WIDTH: f64 = 1e-3;

/// A motion between two sets of points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RigidAlignment {
    /// The motion.
    pub target_from_source: Isometry3<f64>,
    /// The root mean square of the distances that it leaves.
    pub rms_m: f64,
    /// The standard deviations of the source's points along their principal axes, the longest first. Where the second is
    /// hardly larger than the points' noise, the turn about the first axis is hardly known.
    pub extents_m: [f64; 3],
}

/// There is no motion, or more than one.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum AlignmentError {
    /// The sets do not match.
    #[error("{source_points} points cannot be the same as {target_points}")]
    Lengths {
        /// Points of the source.
        source_points: usize,
        /// Points of the target.
        target_points: usize,
    },
    /// Too few points.
    #[error("{points} points: at least 3 are needed")]
    TooFew {
        /// How many there are.
        points: usize,
    },
    /// A number is not finite.
    #[error("a point has a number that is not finite")]
    NotFinite,
    /// All points lie on a line, or are one.
    #[error(
        "points that extend {longest_m} m along a line and {second_m} m across: the turn about it is unknown"
    )]
    Degenerate {
        /// Their standard deviation along the line.
        longest_m: f64,
        /// And across, where it is largest.
        second_m: f64,
    },
}

/// The motion that takes the points of `source_m` to those of `target_m` with the least sum of squared distances, in closed
/// form (Umeyama 1991, without the scale). Points of one index are the same.
///
/// # Errors
/// With fewer than three points, with points of a line, and for sets that do not match.
pub fn rigid_alignment(
    source_m: &[Point3<f64>],
    target_m: &[Point3<f64>],
) -> Result<RigidAlignment, AlignmentError> {
    let (source_points, target_points) = (source_m.len(), target_m.len());
    if source_points != target_points {
        return Err(AlignmentError::Lengths { source_points, target_points });
    }
    if source_points < 3 {
        return Err(AlignmentError::TooFew { points: source_points });
    }
    let count = source_points as f64;
    let middle = |points: &[Point3<f64>]| {
        points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / count
    };
    let (source_middle, target_middle) = (middle(source_m), middle(target_m));
    let (mut scatter, mut mixed, mut target_square) = (Matrix3::zeros(), Matrix3::zeros(), 0.0);
    for (source, target) in source_m.iter().zip(target_m) {
        let (source, target) = (source.coords - source_middle, target.coords - target_middle);
        scatter += source * source.transpose();
        mixed += target * source.transpose();
        target_square += target.norm_squared();
    }
    if !(scatter.iter().chain(mixed.iter()).all(|value| value.is_finite())
        && f64::is_finite(target_square))
    {
        return Err(AlignmentError::NotFinite);
    }
    let extents_m = extents(&(scatter / count));
    let of_target = SVD::new_unordered(mixed / count, true, true);
    let [longest_m, second_m, _] = extents_m;
    // The product of both extents: the target may be a line though the source is none.
    let mut products = of_target.singular_values;
    products.as_mut_slice().sort_by(|a, b| b.total_cmp(a));
    let narrow = second_m.is_nan() || second_m <= LEAST_WIDTH * longest_m;
    if narrow || products[1] <= LEAST_WIDTH * LEAST_WIDTH * products[0] {
        return Err(AlignmentError::Degenerate { longest_m, second_m });
    }
    let Some((left, right)) = of_target.u.zip(of_target.v_t) else {
        return Err(AlignmentError::NotFinite);
    };
    let mut signs = Vector3::repeat(1.0);
    if left.determinant() * right.determinant() < 0.0 {
        // A mirror image is no motion: the least observable axis is flipped.
        signs[of_target.singular_values.imin()] = -1.0;
    }
    let matrix = left * Matrix3::from_diagonal(&signs) * right;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    let translation = Translation3::from(target_middle - rotation * source_middle);
    let target_from_source = Isometry3::from_parts(translation, rotation);
    let square: f64 = source_m
        .iter()
        .zip(target_m)
        .map(|(source, target)| (target_from_source * source - target).norm_squared())
        .sum();
    Ok(RigidAlignment { target_from_source, rms_m: (square / count).sqrt(), extents_m })
}

/// Standard deviations along the principal axes, the largest first.
fn extents(scatter: &Matrix3<f64>) -> [f64; 3] {
    let mut variances: [f64; 3] = SymmetricEigen::new(*scatter).eigenvalues.into();
    variances.sort_by(|a, b| b.total_cmp(a));
    variances.map(|variance| variance.max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::solve::testing::{Random, any_pose};

    fn scattered(count: usize, flat: bool, seed: u64) -> Vec<Point3<f64>> {
        let mut random = Random::new(seed);
        let deep = if flat { 0.0 } else { 1.0 };
        (0..count)
            .map(|_| Point3::new(random.normal(), 0.5 * random.normal(), deep * random.normal()))
            .collect()
    }

    /// The width of points across their longest extent, as a share of that extent.
    fn relative_width(points: &[Point3<f64>]) -> f64 {
        let middle =
            points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / points.len() as f64;
        let scatter = points
            .iter()
            .map(|point| (point.coords - middle) * (point.coords - middle).transpose())
            .sum::<Matrix3<f64>>();
        let [longest, second, _] = extents(&scatter);
        second / longest
    }

    /// Points whose motion is determined: random ones may lie near a line (three of them often do), about which the
    /// rotation is as badly determined as they are narrow.
    fn determined() -> impl Strategy<Value = Vec<Point3<f64>>> {
        (3..20_usize, any::<bool>(), any::<u64>())
            .prop_map(|(count, flat, seed)| scattered(count, flat, seed))
            .prop_filter("near a line", |points| relative_width(points) > 0.05)
    }

    proptest! {
        #[test]
        fn the_motion_is_found_also_of_points_of_a_plane(
            pose in any_pose(), source in determined(),
        ) {
            let target: Vec<_> = source.iter().map(|point| pose * point).collect();
            let found = rigid_alignment(&source, &target).unwrap();
            prop_assert!(found.rms_m < 1e-9);
            for (source, target) in source.iter().zip(&target) {
                prop_assert!((found.target_from_source * source - target).norm() < 1e-9);
            }
            // All three numbers of a point: the rotation holds off the plane too.
            prop_assert!((found.target_from_source.inverse() * pose).rotation.angle() < 1e-5);
        }
    }

    #[test]
    fn no_motion_near_by_is_better() {
        let pose = Isometry3::new(Vector3::new(1.0, -2.0, 0.5), Vector3::new(0.4, 1.0, -0.3));
        let source = scattered(30, false, 1);
        let mut random = Random::new(2);
        let target: Vec<_> = source
            .iter()
            .map(|point| pose * point + 0.1 * Vector3::from_fn(|_, _| random.normal()))
            .collect();
        let found = rigid_alignment(&source, &target).unwrap();
        let cost = |pose: &Isometry3<f64>| -> f64 {
            source.iter().zip(&target).map(|(a, b)| (pose * a - b).norm_squared()).sum()
        };
        let best = cost(&found.target_from_source);
        assert!((best / 30.0 - found.rms_m.powi(2)).abs() < 1e-9);
        for _ in 0..50 {
            let near = estimation::perturbation::left::perturbed(
                &found.target_from_source,
                &random.perturbation(0.01, 0.01),
            );
            assert!(cost(&near) > best);
        }
    }

    #[test]
    fn a_line_and_too_few_points_are_said() {
        let line: Vec<_> = (0..5).map(|step| Point3::new(f64::from(step), 1.0, 2.0)).collect();
        let other = scattered(5, false, 3);
        let degenerate = |source: &[Point3<f64>], target: &[Point3<f64>]| {
            matches!(rigid_alignment(source, target), Err(AlignmentError::Degenerate { .. }))
        };
        assert!(degenerate(&line, &line));
        assert!(degenerate(&other, &line));
        assert!(degenerate(&[line[0]; 4], &[line[0]; 4]));
        assert_eq!(
            rigid_alignment(&line[..2], &line[..2]),
            Err(AlignmentError::TooFew { points: 2 })
        );
        assert!(matches!(
            rigid_alignment(&line, &other[..4]),
            Err(AlignmentError::Lengths { source_points: 5, target_points: 4 })
        ));
        let mut spoilt = other.clone();
        spoilt[2].y = f64::NAN;
        assert_eq!(rigid_alignment(&other, &spoilt), Err(AlignmentError::NotFinite));
        assert_eq!(rigid_alignment(&spoilt, &other), Err(AlignmentError::NotFinite));
    }
}
