//! What the tracker says of its own errors.

use estimation::perturbation::left::perturbation_between;
use nalgebra::Vector6;

use super::*;

/// The mean squared error in standard deviations after this many frames, of runs that differ in their noise.
fn mean_errors2<const COUNT: usize>(room: &Thing, runs: u32, frames: [u32; COUNT]) -> [f64; COUNT] {
    let mut sums = [0.0; COUNT];
    for seed in 0..u64::from(runs) {
        let (mut tracker, mut camera) = (
            tracker(),
            Camera::new(looking_about, Spoil { pixel_px: 1.0, ..Spoil::default() }, 1000 + seed),
        );
        for index in 0..frames[COUNT - 1] {
            let time_s = f64::from(index) * PERIOD_S;
            let frame = camera.frame(time_s, &[(room, Isometry3::identity())]);
            let pose = tracker.step(&frame, &camera.model, &Hints::default()).pose.unwrap();
            if let Some(at) = frames.iter().position(|frames| *frames == index + 1) {
                let truth = looking_about(time_s).inverse();
                let off: Vector6<f64> = perturbation_between(&truth, &pose.camera_from_map);
                sums[at] += off.dot(&pose.covariance.cholesky().unwrap().solve(&off));
            }
        }
    }
    sums.map(|sum| sum / f64::from(runs))
}

/// The sum of the squares of six numbers of deviation 1, over 200 runs: its mean lies between these in 95 of 100 cases.
const HONEST: std::ops::Range<f64> = 5.52..6.48;

#[test]
fn while_the_first_landmarks_are_seen_the_covariance_is_honest() {
    let means = mean_errors2(&Thing::room(2500, 200, 50), 200, [2, 8]);
    assert!(means.iter().all(|mean| HONEST.contains(mean)), "{means:?}");
}

/// Later the error of the map is bounded and not estimated: the covariance is too large then, and never too small.
#[test]
fn later_the_covariance_is_too_large_rather_than_too_small() {
    let means = mean_errors2(&Thing::room(1200, 100, 50), 80, [12, 25]);
    println!("NEES {means:?}");
    assert!(means.iter().all(|mean| (2.0..HONEST.end).contains(mean)), "{means:?}");
}
