//! How close to the truth, and whether the covariance says so.

use estimation::perturbation::left::perturbation_between;
use nalgebra::Vector6;
use proptest::prelude::*;

use crate::solve::testing::{KINECT_NOISE, NO_DEPTH, Noise, Random, View, kinect};
use crate::solve::{NoiseScale, PoseEstimate, PoseGuess, RefineConfig, RobustKernel, refine_pose};

fn refined(view: &View, off: &Vector6<f64>, config: &RefineConfig) -> PoseEstimate {
    let guess = PoseGuess { camera_from_map: view.guess(off), covariance: None };
    refine_pose(&kinect(), &guess, &view.points, &view.lines, config).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn without_noise_the_pose_is_exact(
        seed in any::<u64>(), points in 0..60_usize, lines in 0..30_usize, with_depth in any::<bool>(),
    ) {
        prop_assume!(points + lines >= 12);
        let noise = if with_depth { KINECT_NOISE } else { NO_DEPTH };
        let view = View::room(points, lines, noise, seed);
        let off = Random::new(seed).perturbation(0.05, 0.02);
        let found = refined(&view, &off, &RefineConfig { kernel: RobustKernel::Cauchy, ..RefineConfig::default() });
        prop_assume!(found.observability.estimated() == 6);
        let (off_m, off_rad) = view.error(&found.camera_from_map);
        prop_assert!(off_m < 1e-7 && off_rad < 1e-7, "{off_m} {off_rad}");
        prop_assert_eq!(found.point_inliers(), points);
    }

    #[test]
    fn where_the_origin_of_the_map_lies_does_not_matter(seed in any::<u64>(), far in -1e6..1e6_f64) {
        let near = View::room(40, 20, KINECT_NOISE, seed).noisy(1.0, seed);
        let mut moved = near.clone();
        let shift = nalgebra::Vector3::new(far, -0.5 * far, 0.1 * far);
        moved.points.iter_mut().for_each(|point| point.point_in_map_m += shift);
        for line in &mut moved.lines {
            line.start_in_map_m += shift;
            line.end_in_map_m += shift;
        }
        moved.camera_from_map *= nalgebra::Translation3::from(-shift);
        let off = Random::new(seed).perturbation(0.05, 0.02);
        let [here, there] = [&near, &moved].map(|view| refined(view, &off, &RefineConfig::default()));
        let error = |view: &View, found: &PoseEstimate| {
            perturbation_between(&view.camera_from_map, &found.camera_from_map)
        };
        prop_assert!((error(&near, &here) - error(&moved, &there)).norm() < 1e-6);
        prop_assert!((here.covariance - there.covariance).norm() < 1e-5 * here.covariance.norm());
    }
}

/// The mean of the squared errors in standard deviations, over draws of the noise: the number of coordinates if the
/// covariance is right.
fn mean_nees(
    (points, lines): (usize, usize),
    noise: Noise,
    times: f64,
    config: &RefineConfig,
    outliers: f64,
    series: u64,
) -> f64 {
    let mut sum = 0.0;
    for seed in (1 + series) * 1000..(1 + series) * 1000 + u64::from(DRAWS) {
        let view = View::room(points, lines, noise, 7 + seed % 50)
            .noisy(times, seed)
            .with_outliers(outliers, seed);
        let off = Random::new(seed).perturbation(0.02, 0.01);
        let found = refined(&view, &off, config);
        assert_eq!(found.observability.estimated(), 6, "{:?}", found.observability);
        let error = perturbation_between(&view.camera_from_map, &found.camera_from_map);
        sum += error.dot(&found.covariance.cholesky().unwrap().solve(&error));
    }
    sum / f64::from(DRAWS)
}

const DRAWS: u32 = 300;
/// The standard deviation of the mean of this many chi-square numbers of 6 degrees of freedom.
const OF_MEAN: f64 = 3.464 / 17.32;
/// 99 % of normal numbers lie within this many standard deviations: 95 % of all five series.
const ONE_OF_FIVE: f64 = 2.58;
/// 95 % do.
const ALONE: f64 = 1.96;

#[test]
fn the_covariance_is_of_the_size_of_the_errors() {
    let config = RefineConfig::default();
    let series = [
        ((120, 40), KINECT_NOISE, 0.0),
        ((120, 0), NO_DEPTH, 0.0),
        ((0, 60), KINECT_NOISE, 0.0),
        ((60, 60), NO_DEPTH, 0.0),
        ((120, 40), KINECT_NOISE, 0.3),
    ];
    let mut all = 0.0;
    for (index, (counts, noise, outliers)) in series.into_iter().enumerate() {
        let nees = mean_nees(counts, noise, 1.0, &config, outliers, index as u64);
        println!("{counts:?} {noise:?} outliers {outliers}: NEES {nees:.3}");
        let off = (nees - 6.0).abs() / OF_MEAN;
        assert!(off < ONE_OF_FIVE, "{counts:?} {noise:?} {outliers}: {nees}");
        all += nees / 5.0;
    }
    println!("NEES of all: {all:.3}");
    assert!((all - 6.0).abs() < ALONE * OF_MEAN / 5.0_f64.sqrt(), "{all}");
}

#[test]
fn noise_that_is_stated_wrong_is_estimated() {
    let config = RefineConfig { noise: NoiseScale::Estimated, ..RefineConfig::default() };
    for times in [0.4, 1.0, 2.5] {
        let nees = mean_nees((120, 40), KINECT_NOISE, times, &config, 0.0, 7);
        println!("noise {times} times the stated one: NEES {nees:.3}");
        // The factor is known to some 5 % itself.
        assert!((nees - 6.0).abs() < 1.2 * ALONE * OF_MEAN, "{times}: {nees}");
    }
    // That it can fail: taken at its word, noise of 2.5 times makes errors far beyond the covariance.
    let at_its_word = mean_nees((120, 40), KINECT_NOISE, 2.5, &RefineConfig::default(), 0.0, 7);
    assert!(at_its_word > 12.0, "{at_its_word}");
}

#[test]
fn the_errors_reach_the_bound_of_cramer_and_rao() {
    // The information of the true inliers about the pose with nothing cut off: no estimate without a bias is better.
    let config = RefineConfig { inlier_probability: 0.999, ..RefineConfig::default() };
    let view = View::room(200, 60, KINECT_NOISE, 21);
    let bound = refined(&view, &Vector6::zeros(), &config).covariance;
    let (mut squares, draws) = (Vector6::zeros(), 300);
    for seed in 0..draws {
        let found = refined(&view.noisy(1.0, seed), &Vector6::zeros(), &config);
        let error = perturbation_between(&view.camera_from_map, &found.camera_from_map);
        squares += error.component_mul(&error) / draws as f64;
    }
    let ratio = squares.component_div(&bound.diagonal());
    println!("variances over the bound: {:.3?}", ratio.as_slice());
    // A variance of 300 draws is known to 8 %.
    assert!(ratio.iter().all(|ratio| (0.76..1.24).contains(ratio)), "{ratio}");
}

#[test]
fn outliers_do_not_carry_the_pose_away() {
    for (kernel, shares) in [
        (RobustKernel::Cauchy, [0.3, 0.5, 0.7, 0.8]),
        // Has one minimum, which this many outliers shift.
        (RobustKernel::Huber, [0.2, 0.3, 0.4, 0.5]),
    ] {
        for share in shares {
            let mut worst: f64 = 0.0;
            for seed in 0..30 {
                let view = View::room(300, 100, KINECT_NOISE, seed)
                    .noisy(1.0, seed)
                    .with_outliers(share, seed);
                // As far off as a prediction between frames.
                let off = Random::new(seed).perturbation(0.02, 0.01);
                let found =
                    refined(&view, &off, &RefineConfig { kernel, ..RefineConfig::default() });
                let (off_m, off_rad) = view.error(&found.camera_from_map);
                worst = worst.max(off_m).max(2.0 * off_rad);
            }
            println!("{share} outliers, {kernel:?}: worst {worst:.4} m");
            assert!(worst < 0.02, "{share} {kernel:?}: {worst}");
        }
    }
}
