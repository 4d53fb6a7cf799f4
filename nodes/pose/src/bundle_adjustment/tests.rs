//! Scenes with a known answer.

mod motions;

use std::cell::Cell;

use estimation::perturbation::left::{perturbation_between, perturbed};
use nalgebra::{Isometry3, Vector3};

use super::*;
use crate::map::testing::{World, around};
use crate::map::{KeyframeId, Map};
use crate::solve::testing::{Random, any_pixel};

/// The depths of these worlds are off by chance, each by itself.
fn window_config() -> WindowConfig {
    WindowConfig { depths_alike: 1.0, ..WindowConfig::default() }
}

struct Scene {
    map: Map,
    keyframes: Vec<KeyframeId>,
    truth: Vec<Isometry3<f64>>,
    world: World,
}

impl Scene {
    /// Twelve keyframes along a wall.
    fn new(noise: f64, seed: u64) -> Self {
        let world = World::wall(300, 40, 6.0, noise, seed);
        let truth = around(12, 0.15);
        let (map, keyframes) = world.map(&truth, seed);
        Self { map, keyframes, truth, world }
    }

    /// A bundle whose poses (but for the first two) and landmarks are off.
    fn spoilt(&self, seed: u64) -> Bundle {
        let mut bundle = Window::full(&self.map, &window_config()).bundle;
        let mut random = Random::new(seed);
        bundle.poses[1].is_fixed = true;
        for pose in bundle.poses.iter_mut().skip(2) {
            let off = random.perturbation(0.03, 0.01);
            pose.camera_from_map = perturbed(&pose.camera_from_map, &off);
        }
        let mut off = || 0.03 * Vector3::new(random.normal(), random.normal(), random.normal());
        bundle.points_m.iter_mut().for_each(|point| *point += off());
        bundle.lines_m.iter_mut().flatten().for_each(|end| *end += off());
        bundle
    }

    /// Root mean squares of the errors of poses (m and rad), of points, and of lines.
    fn errors(&self, adjusted: &Adjusted) -> [f64; 4] {
        let rms =
            |squares: Vec<f64>| (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        let off = self.truth.iter().zip(&adjusted.poses);
        let off: Vec<_> = off.map(|(truth, pose)| perturbation_between(truth, pose)).collect();
        let points: Vec<_> =
            self.map.points().iter().map(|(_, point)| *point.position_m()).collect();
        let points =
            points.iter().zip(&adjusted.points_m).map(|(one, two)| (one - two).norm_squared());
        let lines = self.map.lines().iter().zip(&adjusted.lines_m).flat_map(|((_, line), ends)| {
            let line = line.plucker().unwrap();
            ends.map(|end| line.distance_to(&end).powi(2))
        });
        [
            rms(off.iter().map(|off| off.fixed_rows::<3>(0).norm_squared()).collect()),
            rms(off.iter().map(|off| off.fixed_rows::<3>(3).norm_squared()).collect()),
            rms(points.collect()),
            rms(lines.collect()),
        ]
    }
}

fn adjusted(bundle: &Bundle) -> Adjusted {
    adjust(bundle, &BundleConfig::default(), &|| false).unwrap()
}

#[test]
fn without_noise_the_truth_is_found() {
    for seed in 0..3 {
        let scene = Scene::new(0.0, seed);
        let bundle = scene.spoilt(seed);
        let found = adjusted(&bundle);
        let errors = scene.errors(&found);
        assert!(errors.iter().all(|error| *error < 1e-4), "{errors:?}");
        assert!(found.point_verdicts.iter().all(|verdict| *verdict == Verdict::Fits));
        // What is fixed stays, to the bit.
        for (pose, before) in found.poses.iter().zip(&bundle.poses).take(2) {
            assert_eq!(*pose, before.camera_from_map);
        }
    }
}

#[test]
fn with_noise_all_is_found_as_well_as_it_is_seen() {
    let mut sums = [0.0; 4];
    let (mut chi2, mut errors) = (0.0, 0.0);
    for seed in 0..5 {
        let scene = Scene::new(1.0, seed);
        let bundle = scene.spoilt(seed + 100);
        let config = BundleConfig { inlier_probability: 0.9999, ..BundleConfig::default() };
        let found = adjust(&bundle, &config, &|| false).unwrap();
        for (sum, error) in sums.iter_mut().zip(scene.errors(&found)) {
            *sum += error / 5.0;
        }
        chi2 += found.cost;
        let rows = 3 * bundle.point_sightings.len() + 4 * bundle.line_sightings.len();
        let unknowns = 6 * 10 + 3 * bundle.points_m.len() + 4 * bundle.lines_m.len();
        errors += (rows - unknowns) as f64;
    }
    println!(
        "poses {:.4} m {:.5} rad, points {:.4} m, lines {:.4} m; chi2 per freedom {:.3}",
        sums[0],
        sums[1],
        sums[2],
        sums[3],
        chi2 / errors
    );
    // Some hundred points, each seen to a pixel (4 mm at 2 m) and to 1.5 cm of depth at 3 m.
    assert!(sums[0] < 0.004 && sums[1] < 0.0015 && sums[2] < 0.02 && sums[3] < 0.02, "{sums:?}");
    // The world's segments are seen to 0.7 pixels across, where 1 is stated.
    assert!((chi2 / errors - 0.95).abs() < 0.1, "{}", chi2 / errors);
}

#[test]
fn what_does_not_fit_is_found_out() {
    let scene = Scene::new(1.0, 7);
    let mut bundle = scene.spoilt(8);
    let mut random = Random::new(9);
    let mut is_wrong = vec![false; bundle.point_sightings.len()];
    for (index, sighting) in bundle.point_sightings.iter_mut().enumerate() {
        if random.between(0.0, 1.0) < 0.1 {
            sighting.seen.pixel_px = any_pixel(&mut random);
            is_wrong[index] = true;
        }
    }
    let found = adjusted(&bundle);
    let verdicts = found.point_verdicts.iter().zip(&is_wrong);
    let wrong = is_wrong.iter().filter(|is_wrong| **is_wrong).count();
    let caught = verdicts.clone().filter(|(v, wrong)| **v == Verdict::Outlier && **wrong).count();
    let missed = verdicts.filter(|(v, wrong)| **v == Verdict::Outlier && !**wrong).count();
    let right = is_wrong.len() - wrong;
    assert!(caught as f64 > 0.98 * wrong as f64, "{caught} of {wrong}");
    assert!((missed as f64) < 0.07 * right as f64, "{missed} of {right}");
    let errors = scene.errors(&found);
    assert!(errors[0] < 0.006 && errors[1] < 0.002, "{errors:?}");
}

#[test]
fn the_same_bundle_gives_the_same_result_to_the_bit() {
    let bundle = Scene::new(1.0, 3).spoilt(4);
    assert_eq!(adjusted(&bundle), adjusted(&bundle));
}

#[test]
fn one_that_is_stopped_leaves_a_map_that_holds() {
    let scene = Scene::new(1.0, 5);
    let bundle = scene.spoilt(6);
    let config = BundleConfig::default();
    let at_once = adjust(&bundle, &config, &|| true).unwrap();
    assert!(at_once.was_aborted && at_once.iterations == 0 && at_once.cost == at_once.cost_before);
    assert_eq!(at_once.points_m, bundle.points_m);
    let mut last = f64::INFINITY;
    for steps in 1..5 {
        let asked = Cell::new(0);
        let is_aborted = || asked.replace(asked.get() + 1) >= steps;
        let found = adjust(&bundle, &config, &is_aborted).unwrap();
        assert!(found.was_aborted && found.cost < last, "{steps}: {}", found.cost);
        last = found.cost;
        let mut map = scene.map.clone();
        let window = Window::full(&map, &window_config());
        window.apply(&found, &mut map).unwrap();
        assert_eq!(map.check(), Ok(()));
    }
}

#[test]
fn a_keyframe_alone_and_landmarks_that_are_hardly_observed_do_no_harm() {
    let scene = Scene::new(1.0, 2);
    let mut bundle = scene.spoilt(3);
    // Each point is seen once, and half of them without a depth; the last pose sees nothing.
    let mut seen = std::collections::BTreeSet::new();
    bundle.point_sightings.retain(|sighting| sighting.pose != 11 && seen.insert(sighting.landmark));
    bundle.line_sightings.retain(|sighting| sighting.pose != 11);
    for sighting in bundle.point_sightings.iter_mut().step_by(2) {
        sighting.seen.depth_m = None;
    }
    let found = adjusted(&bundle);
    assert_eq!(found.poses[11], bundle.poses[11].camera_from_map);
    assert!(found.points_m.iter().all(|point| point.coords.norm() < 100.0));
    assert!(found.cost <= found.cost_before);
}

#[test]
fn depths_behind_an_edge_do_not_bias_keyframes() {
    let scene = Scene::new(1.0, 21);
    let mut bundle = Window::full(&scene.map, &window_config()).bundle;
    let before = scene.errors(&adjusted(&bundle));
    // A third of the depths on the one side of the image are of a surface half a metre farther.
    for (index, sighting) in bundle.point_sightings.iter_mut().enumerate() {
        if index % 3 == 0 && sighting.seen.pixel_px.x > 320.0 {
            sighting.seen.depth_m = sighting.seen.depth_m.map(|depth_m| depth_m + 0.5);
        }
    }
    let after = scene.errors(&adjusted(&bundle));
    println!("poses off by {before:?}, with wrong depths by {after:?}");
    assert!(after[0] < 2.0 * before[0] && after[1] < 2.0 * before[1], "{before:?} {after:?}");
}

#[test]
fn nonsense_is_named() {
    let bundle = Scene::new(1.0, 1).spoilt(1);
    let refused = |spoil: &dyn Fn(&mut Bundle)| {
        let mut spoilt = bundle.clone();
        spoil(&mut spoilt);
        adjust(&spoilt, &BundleConfig::default(), &|| false).unwrap_err()
    };
    assert_eq!(
        refused(&|bundle| bundle.poses.iter_mut().for_each(|pose| pose.is_fixed = false)),
        BundleError::NothingFixed { poses: 12 }
    );
    assert_eq!(
        refused(&|bundle| bundle.points_m[3].x = f64::NAN),
        BundleError::NotFinite { what: "point", index: 3 }
    );
    assert_eq!(
        refused(&|bundle| bundle.lines_m[2][1] = bundle.lines_m[2][0]),
        BundleError::NotFinite { what: "line", index: 2 }
    );
    assert!(matches!(
        refused(&|bundle| bundle.point_sightings[4].pose = 99),
        BundleError::NoSuchThing { sighting: 4, pose: 99, .. }
    ));
    assert!(matches!(
        refused(&|bundle| bundle.poses[0].camera.fx_px = 0.0),
        BundleError::Camera(_)
    ));
    let config = BundleConfig { inlier_probability: 1.0, ..BundleConfig::default() };
    assert!(matches!(adjust(&bundle, &config, &|| false), Err(BundleError::Config(_))));
}

#[test]
fn a_window_of_the_map_is_adjusted_and_taken_back() {
    let scene = Scene::new(1.0, 11);
    let mut map = scene.map.clone();
    let mut random = Random::new(12);
    let newest = scene.keyframes[11];
    let config = WindowConfig { max_keyframes: 4, ..window_config() };
    let window = Window::local(&map, newest, &config).unwrap();
    let free = window.keyframes().iter().zip(&window.bundle.poses);
    let free: Vec<KeyframeId> =
        free.filter(|(_, pose)| !pose.is_fixed).map(|(id, _)| *id).collect();
    assert!(free.len() == 4 && free.contains(&newest));
    for id in &free {
        let pose = map.keyframes().get(*id).unwrap().camera_from_map();
        let pose = perturbed(pose, &random.perturbation(0.02, 0.005));
        map.set_pose(*id, &pose).unwrap();
    }
    let window = Window::local(&map, newest, &config).unwrap();
    assert_eq!(window.bundle.poses.len(), 12);
    let found = adjusted(&window.bundle);
    let before = map.clone();
    let applied = window.apply(&found, &mut map).unwrap();
    assert_eq!(applied.keyframes, 4);
    assert!(applied.outliers > 0 && applied.outliers < 400, "{applied:?}");
    assert_eq!(map.check(), Ok(()));
    let off = |map: &Map, at: usize| {
        let pose = map.keyframes().get(scene.keyframes[at]).unwrap().camera_from_map();
        perturbation_between(&scene.truth[at], pose).fixed_rows::<3>(0).norm()
    };
    let sum = |map: &Map| (0..12).map(|at| off(map, at)).sum::<f64>();
    assert!(sum(&map) < 0.2 * sum(&before), "{} {}", sum(&map), sum(&before));
    assert!(scene.world.points.len() >= map.points().len());
    // The same result a second time: the keyframes are elsewhere now.
    assert!(window.apply(&found, &mut map).is_err());
    assert!(Window::local(&map, newest, &config).is_some());
    map.cull_keyframe(newest).unwrap();
    assert!(Window::local(&map, newest, &config).is_none());
}

#[test]
fn the_first_keyframe_of_a_window_is_held_where_nothing_else_is() {
    let scene = Scene::new(1.0, 13);
    let config = WindowConfig { max_keyframes: 100, ..window_config() };
    let window = Window::local(&scene.map, scene.keyframes[5], &config).unwrap();
    let fixed: Vec<usize> = (0..12).filter(|index| window.bundle.poses[*index].is_fixed).collect();
    assert_eq!(fixed, [0]);
}
