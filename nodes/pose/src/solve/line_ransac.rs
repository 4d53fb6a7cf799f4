//! The pose that most of some lines agree on, without a guess, by their places in space.
//!
//! Two lines that are not parallel fix a pose: their directions the turn, and how far they are the shift.

use estimation::Random;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::RansacConfig;

/// Directions that differ by a smaller sine are parallel: what a segment's direction is off by would decide.
const LEAST_SINE: f64 = 0.2;
/// A line fits when its ends are off by at most this many standard deviations.
const MAX_STD_DEVS: f64 = 3.0;
/// Lines of a sample.
const SAMPLE: usize = 2;

/// A line of the map and a segment that may be it, both from the end that has the brighter side on its left.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct LinePair {
    /// The line's ends in the map frame.
    pub(crate) in_map_m: [Point3<f64>; 2],
    /// The segment's ends in the camera frame; they need not be the same places.
    pub(crate) in_camera_m: [Point3<f64>; 2],
    /// The error of both ends across the line, one standard deviation.
    pub(crate) std_dev_m: f64,
}

/// The pose that explains the most pairs, and how many; `None` without two lines that are not parallel. The same pairs
/// and the same seed give the same pose.
pub(crate) fn line_ransac(
    pairs: &[LinePair],
    config: &RansacConfig,
) -> Option<(Isometry3<f64>, usize)> {
    let axes: Vec<Axes> = pairs.iter().filter_map(Axes::new).collect();
    let mut random = Random::new(config.seed);
    let mut best: Option<(Isometry3<f64>, usize)> = None;
    let (mut wanted, mut drawn) = (config.max_iterations, 0);
    while drawn < wanted && axes.len() >= SAMPLE {
        drawn += 1;
        let first = random.below(axes.len());
        let mut second = random.below(axes.len() - 1);
        second += usize::from(second >= first);
        let Some(pose) = axes.get(first).zip(axes.get(second)).and_then(|(a, b)| aligned(a, b))
        else {
            continue;
        };
        let fitting = axes.iter().filter(|axes| axes.fits(&pose)).count();
        if best.is_none_or(|(_, most)| fitting > most) {
            best = Some((pose, fitting));
            // As many samples as hold one without outliers (Fischler and Bolles 1981, section II-B).
            let both_right = (fitting as f64 / axes.len() as f64).powi(SAMPLE as i32);
            let needed = ((1.0 - config.confidence).ln() / (-both_right).ln_1p()).ceil();
            wanted = config.max_iterations.min((needed as usize).max(1));
        }
    }
    best
}

/// A pair with its directions.
struct Axes {
    pair: LinePair,
    /// Of length 1.
    along_map: Vector3<f64>,
    along_camera: Vector3<f64>,
}

impl Axes {
    fn new(pair: &LinePair) -> Option<Self> {
        let along = |[start, end]: [Point3<f64>; 2]| (end - start).try_normalize(0.0);
        Some(Self {
            pair: *pair,
            along_map: along(pair.in_map_m)?,
            along_camera: along(pair.in_camera_m)?,
        })
    }

    /// Whether the segment is on the line, in the same direction.
    fn fits(&self, camera_from_map: &Isometry3<f64>) -> bool {
        let along = camera_from_map * self.along_map;
        let start = camera_from_map * self.pair.in_map_m[0];
        let limit_m = MAX_STD_DEVS * self.pair.std_dev_m;
        let is_on_it = |end: &Point3<f64>| (end - start).cross(&along).norm() <= limit_m;
        along.dot(&self.along_camera) > 0.0 && self.pair.in_camera_m.iter().all(is_on_it)
    }
}

/// The pose that turns both lines' directions, as well as it can, and then takes the lines as near to the segments as it can.
fn aligned(first: &Axes, second: &Axes) -> Option<Isometry3<f64>> {
    let frame = |one: &Vector3<f64>, other: &Vector3<f64>| {
        let across = one.cross(other);
        let across = (across.norm() >= LEAST_SINE).then(|| across.normalize())?;
        // The half between both, so that neither counts for more.
        let middle = (one + other).try_normalize(0.0)?;
        Some(Matrix3::from_columns(&[middle, across, middle.cross(&across)]))
    };
    let in_map = frame(&first.along_map, &second.along_map)?;
    let in_camera = frame(&first.along_camera, &second.along_camera)?;
    let rotation = Rotation3::from_matrix_unchecked(in_camera * in_map.transpose());
    let (mut left, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for axes in [first, second] {
        let across = Matrix3::identity() - axes.along_camera * axes.along_camera.transpose();
        let middle = |[start, end]: [Point3<f64>; 2]| nalgebra::center(&start, &end);
        let (from, to) = (middle(axes.pair.in_map_m), middle(axes.pair.in_camera_m));
        left += across;
        right += across * (to - rotation * from);
    }
    let shift = left.cholesky()?.solve(&right);
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Some(Isometry3::from_parts(Translation3::from(shift), rotation))
}

#[cfg(test)]
mod tests {
    use estimation::perturbation::left::perturbation_between;
    use proptest::prelude::*;

    use super::*;
    use crate::solve::testing::{Random, any_pose};

    const NOISE_M: f64 = 0.003;

    fn place(random: &mut Random) -> Point3<f64> {
        Point3::from(Vector3::from_fn(|_, _| random.between(-2.0, 2.0)))
    }

    /// Lines seen from a pose, the first ones of which are held to be others; other places of them are seen than those that
    /// the map has.
    fn pairs(camera_from_map: &Isometry3<f64>, right: usize, wrong: usize) -> Vec<LinePair> {
        let mut random = Random::new(5);
        let seen = |random: &mut Random, place_m: Point3<f64>| {
            let noise = Vector3::from_fn(|_, _| NOISE_M * random.normal());
            camera_from_map * place_m + noise
        };
        let pair = |index: usize| {
            let (start, end) = (place(&mut random), place(&mut random));
            let other = if index < wrong { place(&mut random) } else { start };
            let along = end - other;
            let in_camera_m =
                [seen(&mut random, other + 0.2 * along), seen(&mut random, other + 0.9 * along)];
            LinePair { in_map_m: [start, end], in_camera_m, std_dev_m: 3.0 * NOISE_M }
        };
        (0..right + wrong).map(pair).collect()
    }

    proptest! {
        #[test]
        fn the_pose_of_lines_of_which_half_are_wrong_is_found(pose in any_pose()) {
            let (found, fitting) = line_ransac(&pairs(&pose, 20, 20), &RansacConfig::default()).unwrap();
            let off = perturbation_between(&found, &pose);
            prop_assert!(fitting >= 18, "{fitting}");
            prop_assert!(off.fixed_rows::<3>(0).norm() < 0.05, "{off}");
            prop_assert!(off.fixed_rows::<3>(3).norm() < 0.03, "{off}");
        }
    }

    #[test]
    fn parallel_lines_one_line_and_lines_of_no_length_give_no_pose() {
        let config = RansacConfig::default();
        let all = pairs(&Isometry3::identity(), 10, 0);
        assert_eq!(line_ransac(&[], &config), None);
        assert_eq!(line_ransac(&all[..1], &config), None);
        let beside = |by: f64| {
            let moved = |ends: [Point3<f64>; 2]| ends.map(|end| end + Vector3::new(by, 0.0, by));
            let LinePair { in_map_m, in_camera_m, std_dev_m } = all[0];
            LinePair { in_map_m: moved(in_map_m), in_camera_m: moved(in_camera_m), std_dev_m }
        };
        assert_eq!(line_ransac(&[beside(0.0), beside(0.5), beside(1.0)], &config), None);
        let point = LinePair { in_camera_m: [Point3::origin(); 2], ..all[0] };
        let nowhere = LinePair { in_camera_m: [Point3::new(f64::NAN, 0.0, 1.0); 2], ..all[0] };
        assert_eq!(line_ransac(&[point, nowhere, all[1]], &config), None);
    }
}
