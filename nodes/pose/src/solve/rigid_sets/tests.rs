use estimation::perturbation::left::perturbed;
use geometry::Stamp;
use nalgebra::{Isometry3, Point2, Vector3, Vector6};

use super::*;
use crate::motion::{KnownPose, MotionConfig, constant_velocity};
use crate::solve::testing::{KINECT_NOISE, Random, View, any_pixel, kinect, ray_point};

const FRAME_S: f64 = 1.0 / 30.0;
/// A person's pace (Rec-HV, Figure 2).
const WALK_M_PER_S: f64 = 1.4;

/// A room, and a person 2 m away who has this share of the features and walks across. The map is from the frame before:
/// features on the person are where the person was.
struct Scene {
    view: View,
    person: usize,
    lines_on_person: usize,
    prediction: PoseGuess,
}

fn scene(features: usize, share: f64, walk: Vector3<f64>, seed: u64) -> Scene {
    let mut random = Random::new(seed);
    // The camera itself goes forward and turns a little.
    let step = Vector6::new(0.0, 0.0, -0.3 * FRAME_S, 0.0, 0.2 * FRAME_S, 0.0);
    let mut view = View::empty(seed);
    let now = view.camera_from_map;
    let last = perturbed(&Isometry3::identity(), &step).inverse() * now;
    let before = perturbed(&Isometry3::identity(), &step).inverse() * last;
    let person = (share * features as f64) as usize;
    let lines_on_person = 6;
    for _ in 0..person {
        let pixel = Point2::new(random.between(220.0, 420.0), random.between(30.0, 470.0));
        view.see_point(ray_point(&pixel, random.between(1.8, 2.2)), KINECT_NOISE);
    }
    for _ in 0..lines_on_person {
        let pixel = Point2::new(random.between(220.0, 420.0), random.between(60.0, 240.0));
        let shoulder = ray_point(&pixel, 2.0);
        view.see_line(shoulder, shoulder + Vector3::new(0.15, 0.5, 0.1), KINECT_NOISE);
    }
    // A difference of places: only turned to the map's axes.
    let was = now.rotation.inverse() * (-walk * FRAME_S);
    view.points.iter_mut().for_each(|point| point.point_in_map_m += was);
    for line in &mut view.lines {
        line.start_in_map_m += was;
        line.end_in_map_m += was;
    }
    for _ in person..features {
        let mut pixel = any_pixel(&mut random);
        if (200.0..440.0).contains(&pixel.x) {
            pixel.x = if pixel.x < 320.0 { pixel.x - 200.0 } else { pixel.x + 190.0 };
        }
        view.see_point(ray_point(&pixel, random.between(2.5, 5.0)), KINECT_NOISE);
    }
    for _ in 0..15 {
        let start =
            ray_point(&Point2::new(random.between(10.0, 180.0), random.between(10.0, 470.0)), 3.0);
        let end =
            ray_point(&Point2::new(random.between(460.0, 630.0), random.between(10.0, 470.0)), 4.0);
        view.see_line(start, end, KINECT_NOISE);
    }
    let known = |seconds: f64, pose: Isometry3<f64>, random: &mut Random| KnownPose {
        stamp: Stamp::default().plus_seconds(seconds),
        camera_from_map: perturbed(&pose, &random.perturbation(0.001, 0.0005)),
        covariance: Matrix6::from_diagonal(&Vector6::new(1e-6, 1e-6, 1e-6, 2.5e-7, 2.5e-7, 2.5e-7)),
    };
    let before = known(0.0, before, &mut random);
    let last = known(FRAME_S, last, &mut random);
    let at = Stamp::default().plus_seconds(2.0 * FRAME_S);
    let prediction = constant_velocity(Some(&before), &last, at, &MotionConfig::default()).unwrap();
    Scene { view: view.noisy(1.0, seed), person, lines_on_person, prediction }
}

fn split(scene: &Scene, prediction: Option<&PoseGuess>) -> RigidSplit {
    split_by(&RigidSetsConfig::default(), &scene.view, prediction)
}

fn split_by(
    config: &RigidSetsConfig,
    View { points, lines, .. }: &View,
    prediction: Option<&PoseGuess>,
) -> RigidSplit {
    split_rigid_sets(&kinect(), prediction, points, lines, config, &RefineConfig::default())
        .unwrap()
}

#[test]
fn a_person_who_fills_most_of_the_image_does_not_carry_the_camera_along() {
    for walk in [Vector3::x(), Vector3::new(0.7, 0.0, 0.7), -Vector3::z()] {
        // Three quarters of the points on a person who comes nearer by less than four deviations of a depth in a frame: too few
        // are left to decide.
        let most = if walk.z < -0.9 { 0.6 } else { 0.75 };
        for share in [0.3, 0.6, most] {
            let mut worst: f64 = 0.0;
            for seed in 0..15 {
                let scene = scene(200, share, WALK_M_PER_S * walk, seed);
                let found = split(&scene, Some(&scene.prediction));
                let background = &found.background;
                let (off_m, off_rad) = scene.view.error(&background.pose.camera_from_map);
                worst = worst.max(off_m).max(2.0 * off_rad);
                let error = perturbation_between(
                    &scene.view.camera_from_map,
                    &background.pose.camera_from_map,
                );
                let information = background.pose.covariance.cholesky().unwrap();
                let distance2 = error.dot(&information.solve(&error));
                assert!(distance2 < 28.0, "{walk} {share} {seed}: {distance2}");
                assert_eq!(found.as_predicted, Some(true), "{walk} {share} {seed}");
                let strangers = background.points.iter().filter(|index| **index < scene.person);
                // Towards the camera the person goes four standard deviations of a depth, and some stay within two.
                assert!(strangers.count() * 8 < scene.person, "{walk} {share} {seed}");
                let walker = &found.others[0];
                let right = walker.points.iter().filter(|index| **index < scene.person).count();
                assert!(right * 10 > 7 * scene.person, "{walk} {share} {seed}: {right}");
                let lines = walker.lines.iter().filter(|index| **index < scene.lines_on_person);
                assert!(lines.count() >= 3, "{walk} {share} {seed}: {:?}", walker.lines);
            }
            println!("{:?} {share}: worst {worst:.4} m", walk.as_slice());
            // The person goes 47 mm. What is left is the noise of what is left of the room.
            assert!(worst < 0.02, "{walk} {share}: {worst}");
        }
    }
}

#[test]
fn without_a_prediction_the_largest_set_is_the_background() {
    let scene = scene(200, 0.6, WALK_M_PER_S * Vector3::x(), 3);
    for prediction in [None, Some(PoseGuess { covariance: None, ..scene.prediction })] {
        let found = split(&scene, prediction.as_ref());
        assert_eq!(found.as_predicted, None);
        // The camera goes with the person: this is what the prediction is for.
        assert!(scene.view.error(&found.background.pose.camera_from_map).0 > 0.03);
        // Some of the room is where it would be seen from there, too.
        let on_person = found.background.points.iter().filter(|index| **index < scene.person);
        assert!(on_person.count() * 10 > 8 * scene.person);
    }
}

#[test]
fn a_prediction_that_is_wrong_does_not_win_against_a_room() {
    // The camera was knocked: nothing but the room itself moves, and not as predicted.
    let scene = scene(200, 0.0, Vector3::zeros(), 5);
    let knock = Vector6::new(0.05, 0.02, 0.0, 0.0, 0.04, 0.0);
    let wrong = PoseGuess {
        camera_from_map: perturbed(&scene.prediction.camera_from_map, &knock),
        ..scene.prediction
    };
    let found = split(&scene, Some(&wrong));
    assert_eq!(found.as_predicted, Some(false));
    assert!(scene.view.error(&found.background.pose.camera_from_map).0 < 0.01);
    assert!(found.background.points.len() > 180);
}

/// A camera that jumps, and a load before it that jumps with it: that alone is where the prediction has it.
#[test]
fn a_few_points_that_are_as_predicted_do_not_win_against_a_room() {
    const LOAD: usize = 24;
    for seed in 0..10 {
        let Scene { mut view, prediction, .. } = scene(200, 0.0, Vector3::zeros(), seed);
        let jump = Vector6::new(0.25, 0.0, 0.0, 0.0, 0.0, 0.0);
        let now = view.camera_from_map;
        let before = perturbed(&now, &jump);
        let prediction = PoseGuess { camera_from_map: before, ..prediction };
        for point in &mut view.points[..LOAD] {
            point.point_in_map_m = before.inverse() * (now * point.point_in_map_m);
        }
        let default = RigidSetsConfig::default();
        let by_room = split_by(&default, &view, Some(&prediction));
        assert_eq!(by_room.as_predicted, Some(false), "{seed}");
        assert!(view.error(&by_room.background.pose.camera_from_map).0 < 0.01, "{seed}");
        // It is the share that decides: the load is large enough for a set, and the prediction favours it.
        let any_size = RigidSetsConfig { min_background_share: 0.0, ..default };
        let by_load = split_by(&any_size, &view, Some(&prediction));
        assert_eq!(by_load.as_predicted, Some(true), "{seed}");
        assert!(view.error(&by_load.background.pose.camera_from_map).0 > 0.2, "{seed}");
    }
}

#[test]
fn two_people_are_two_sets() {
    let one = scene(200, 0.4, WALK_M_PER_S * Vector3::x(), 8);
    let mut both = one.view.clone();
    // Half of the person's points walk in the other direction.
    let back =
        both.camera_from_map.rotation.inverse() * (2.0 * WALK_M_PER_S * FRAME_S * Vector3::x());
    for point in &mut both.points[..40] {
        point.point_in_map_m += back;
    }
    let found = split_rigid_sets(
        &kinect(),
        Some(&one.prediction),
        &both.points,
        &[],
        &RigidSetsConfig::default(),
        &RefineConfig::default(),
    )
    .unwrap();
    assert_eq!(found.others.len(), 2, "{:?}", found.others);
    for (set, members) in found.others.iter().zip([[0, 40], [40, 80]]) {
        let within = |index: &&usize| (members[0]..members[1]).contains(*index);
        let other = found.others.iter().map(|set| set.points.iter().filter(within).count());
        assert!(other.max().unwrap() > 30, "{:?}", set.points);
    }
    assert!(one.view.error(&found.background.pose.camera_from_map).0 < 0.01);
}

#[test]
fn too_little_and_nonsense_is_refused() {
    let scene = scene(200, 0.5, Vector3::x(), 1);
    let few = &scene.view.points[..5];
    let config = RigidSetsConfig::default();
    assert!(matches!(
        split_rigid_sets(&kinect(), None, few, &[], &config, &RefineConfig::default()),
        Err(PnpError::TooFewPoints { usable: 5, points: 5, needed: 10 })
    ));
    let lost =
        PoseGuess { camera_from_map: Isometry3::translation(f64::NAN, 0.0, 0.0), covariance: None };
    assert!(matches!(
        split_rigid_sets(
            &kinect(),
            Some(&lost),
            &scene.view.points,
            &[],
            &config,
            &RefineConfig::default()
        ),
        Err(PnpError::Pose(PoseError::Guess))
    ));
}

#[test]
fn the_same_input_gives_the_same_sets() {
    let scene = scene(150, 0.5, WALK_M_PER_S * Vector3::x(), 2);
    assert_eq!(split(&scene, Some(&scene.prediction)), split(&scene, Some(&scene.prediction)));
}
