//! The contribution of odometry besides the observations of keyframes.

use nalgebra::Translation3;

use super::*;
use crate::map::testing::{blank, blank_frame};
use crate::map::{ByOdometry, MapConfig, NewKeyframe};

/// Odometry from each pose to the next, as exact as it says.
fn motions(truth: &[Isometry3<f64>], seed: u64) -> Vec<Motion> {
    let mut random = Random::new(seed);
    let pairs = truth.windows(2).enumerate();
    let motions = pairs.map(|(from, pair)| Motion {
        from,
        to: from + 1,
        to_from_from: perturbed(&(pair[1] * pair[0].inverse()), &random.perturbation(0.002, 0.001)),
        std_dev: MotionStdDev { shift_m: 0.002, turn_rad: 0.001 },
    });
    motions.collect()
}

/// Two rooms: what the first six keyframes see the others do not. The second is 5 cm off.
fn two_rooms(scene: &Scene) -> Bundle {
    let mut bundle = scene.spoilt(3);
    let is_of_first: Vec<bool> = (0..bundle.points_m.len()).map(|point| point % 2 == 0).collect();
    bundle.point_sightings.retain(|of| is_of_first[of.landmark] == (of.pose < 6));
    bundle.line_sightings.clear();
    let away = Translation3::new(0.05, 0.0, 0.0);
    for pose in bundle.poses.iter_mut().skip(6) {
        pose.camera_from_map *= away.inverse();
    }
    for (point, is_of_first) in bundle.points_m.iter_mut().zip(&is_of_first) {
        if !is_of_first {
            *point = away * *point;
        }
    }
    bundle
}

#[test]
fn a_motion_ties_rooms_that_show_nothing_of_each_other() {
    let scene = Scene::new(1.0, 21);
    let mut bundle = two_rooms(&scene);
    let [apart_m, ..] = scene.errors(&adjusted(&bundle));
    bundle.motions = motions(&scene.truth, 22);
    let found = adjusted(&bundle);
    let [tied_m, tied_rad, ..] = scene.errors(&found);
    assert!(apart_m > 0.03, "{apart_m}");
    assert!(tied_m < 0.008 && tied_rad < 0.003, "{tied_m} {tied_rad}");
}

#[test]
fn a_motion_that_is_wrong_does_not_carry_keyframes_along() {
    let scene = Scene::new(1.0, 23);
    let mut bundle = scene.spoilt(24);
    let [before_m, ..] = scene.errors(&adjusted(&bundle));
    bundle.motions = motions(&scene.truth, 25);
    let wrong = &mut bundle.motions[6].to_from_from;
    *wrong = Translation3::new(0.0, 0.0, 0.4) * *wrong;
    let [after_m, ..] = scene.errors(&adjusted(&bundle));
    assert!(after_m < before_m + 0.001, "{before_m} {after_m}");
}

#[test]
fn depths_of_a_view_that_are_off_alike_do_not_drag_it_along() {
    let off_m = |config: &WindowConfig| {
        let scene = Scene::new(1.0, 26);
        let mut bundle = Window::full(&scene.map, config).bundle;
        bundle.poses[1].is_fixed = true;
        for sighting in &mut bundle.point_sightings {
            // Every other view has all things 2 % too far away.
            let stretch = if sighting.pose % 2 == 0 { 1.0 } else { 1.02 };
            let depth_m = sighting.seen.depth_m.as_mut();
            depth_m.into_iter().for_each(|depth_m| *depth_m *= stretch);
        }
        scene.errors(&adjusted(&bundle))[0]
    };
    let as_independent_m = off_m(&window_config());
    let as_alike_m = off_m(&WindowConfig::default());
    assert!(as_alike_m < 0.5 * as_independent_m, "{as_alike_m} {as_independent_m}");
}

#[test]
fn odometry_of_a_map_is_given_from_keyframe_to_keyframe_and_leg_by_leg() {
    let frame = blank_frame(4, 0);
    let mut map = Map::new(MapConfig::default());
    let legs = [(0, 0.0), (0, 1.0), (0, 2.0), (1, 0.0), (1, 0.5)];
    let ids: Vec<KeyframeId> = legs
        .iter()
        .map(|(leg, travelled_m)| {
            let by_odometry = Some(ByOdometry {
                leg: *leg,
                camera_from_odom: Isometry3::translation(-travelled_m, 0.0, 0.0),
                travelled_m: *travelled_m,
                turned_rad: 0.0,
            });
            map.insert_keyframe(NewKeyframe { by_odometry, ..blank(&frame) }).unwrap()
        })
        .collect();
    let config = WindowConfig::default();
    let ties = |map: &Map| -> Vec<(usize, usize, f64)> {
        let all = Window::full(map, &config).bundle.motions;
        all.iter().map(|by| (by.from, by.to, by.to_from_from.translation.x)).collect()
    };
    assert_eq!(ties(&map), [(0, 1, -1.0), (1, 2, -1.0), (3, 4, -0.5)]);
    // A removed keyframe is skipped: the distance and its uncertainty are as before.
    map.cull_keyframe(ids[1]).unwrap();
    let motions = Window::full(&map, &config).bundle.motions;
    assert_eq!(motions[0].to_from_from.translation.x, -2.0);
    let MotionConfig { shift_m, drift_per_m, .. } = config.motions;
    assert!((motions[0].std_dev.shift_m - (shift_m + 2.0 * drift_per_m)).abs() < 1e-12);
    // A window of one contains its neighbours on the path, held.
    let window = Window::local(&map, ids[2], &config).unwrap();
    assert_eq!(window.keyframes(), [ids[0], ids[2]]);
    assert!(window.bundle.poses[0].is_fixed && !window.bundle.poses[1].is_fixed);
    assert_eq!(window.bundle.motions.len(), 1);
}

#[test]
fn a_motion_of_a_pose_to_itself_is_refused() {
    let mut bundle = Scene::new(1.0, 27).spoilt(28);
    let motion = motions(&[Isometry3::identity(); 2], 1)[0];
    bundle.motions = vec![Motion { to: 0, ..motion }];
    let refused = adjust(&bundle, &BundleConfig::default(), &|| false).unwrap_err();
    assert_eq!(refused, BundleError::Motion { motion: 0, poses: 12 });
}
