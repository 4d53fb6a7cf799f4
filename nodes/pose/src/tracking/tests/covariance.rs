//! What the tracker says of its own errors.

use nalgebra::Vector6;

use super::*;
use crate::solve::perturbation::perturbation_between;

/// The mean squared error of the last of some frames in standard deviations, of runs that differ in their noise.
fn mean_error2(frames: u32, runs: u64) -> f64 {
    let room = Thing::room(2500, 200, 50);
    let run = |seed: u64| {
        let (mut tracker, mut camera) = (
            tracker(),
            Camera::new(looking_about, Spoil { pixel_px: 1.0, ..Spoil::default() }, 1000 + seed),
        );
        let mut last = None;
        for index in 0..frames {
            let frame =
                camera.frame(f64::from(index) * PERIOD_S, &[(&room, Isometry3::identity())]);
            last = tracker.step(&frame, &camera.model, &Hints::default()).pose;
        }
        let pose = last.unwrap();
        let truth = looking_about(f64::from(frames - 1) * PERIOD_S).inverse();
        let off: Vector6<f64> = perturbation_between(&truth, &pose.camera_from_map);
        off.dot(&pose.covariance.cholesky().unwrap().solve(&off))
    };
    (0..runs).map(run).sum::<f64>() / runs as f64
}

/// The sum of the squares of six numbers of deviation 1, over 200 runs: its mean lies between these in 95 of 100 cases.
const HONEST: std::ops::Range<f64> = 5.52..6.48;

/// While all is seen that the first frames showed. Later the error of the map is bounded and not estimated: the
/// covariance may be too large then, but never too small.
#[test]
fn the_covariance_is_honest() {
    for frames in [2, 8] {
        let mean = mean_error2(frames, 200);
        assert!(HONEST.contains(&mean), "{frames}: {mean}");
    }
    let mean = mean_error2(60, 30);
    assert!((3.0..7.0).contains(&mean), "{mean}");
}
