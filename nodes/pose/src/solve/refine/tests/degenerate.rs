//! What is not seen is not guessed.

use estimation::perturbation::left::perturbation_between;
use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};

use crate::solve::testing::{
    KINECT_NOISE, NO_DEPTH, Noise, Random, View, any_pixel, kinect, ray_point,
};
use crate::solve::{PoseEstimate, PoseGuess, RefineConfig, refine_pose};

fn refined(view: &View, guess: &Isometry3<f64>) -> PoseEstimate {
    let guess = PoseGuess { camera_from_map: *guess, covariance: None };
    refine_pose(&kinect(), &guess, &view.points, &view.lines, &RefineConfig::default()).unwrap()
}

/// The motion from a guess to a pose, along a direction that is not estimated, in units of its limit: nothing.
fn check_held(guess: &Isometry3<f64>, found: &PoseEstimate) {
    let limits = RefineConfig::default().limits();
    let way = perturbation_between(guess, &found.camera_from_map).component_div(&limits);
    for direction in found.observability.weak() {
        let along = way.dot(&direction.in_units);
        // To first order: the limits are of a centimetre.
        assert!(along.abs() < 0.05 * way.norm().max(0.1), "{along} of {way}");
    }
}

/// Horizontal edges that go on beyond the image, as a shelf has them.
fn parallel_lines(noise: Noise, seed: u64) -> View {
    let mut view = View::empty(seed);
    let mut random = Random::new(seed);
    for _ in 0..20 {
        let (y, z) = (random.between(-0.6, 0.6), random.between(1.5, 4.0));
        view.see_line(Point3::new(-0.5 * z, y, z), Point3::new(0.5 * z, y, z), noise);
    }
    view
}

#[test]
fn parallel_lines_do_not_determine_the_position_along_them() {
    for noise in [NO_DEPTH, KINECT_NOISE] {
        for seed in 0..20 {
            let view = parallel_lines(noise, seed).noisy(1.0, seed);
            let guess = view.guess(&Random::new(seed).perturbation(0.01, 0.005));
            let found = refined(&view, &guess);
            let weak: Vec<_> = found.observability.weak().collect();
            assert_eq!(weak.len(), 1, "{:?}", found.observability);
            assert!(weak[0].shift().unwrap().x.abs() > 0.999, "{weak:?}");
            assert!(weak[0].std_dev_in_units() > 1e3);
            check_held(&guess, &found);
            // Across the lines the pose is right, and along them as wrong as the guess.
            let error = perturbation_between(&view.camera_from_map, &found.camera_from_map);
            let of_guess = perturbation_between(&view.camera_from_map, &guess);
            assert!(error.y.abs() < 0.01 && (error.x - of_guess.x).abs() < 0.002, "{error}");
            // The covariance says so: nothing supports the guess.
            assert!((found.covariance[(0, 0)].sqrt() - 1.0).abs() < 0.01);
            assert!(found.covariance[(1, 1)].sqrt() < 0.01);
        }
    }
}

#[test]
fn what_is_not_seen_has_the_covariance_of_the_guess() {
    let view = parallel_lines(KINECT_NOISE, 3).noisy(1.0, 3);
    let covariance = Matrix6::from_diagonal(&Vector6::new(4e-4, 1.0, 1.0, 1.0, 1.0, 1.0));
    let guess = PoseGuess { camera_from_map: view.camera_from_map, covariance: Some(covariance) };
    let found = refine_pose(&kinect(), &guess, &view.points, &view.lines, &RefineConfig::default())
        .unwrap();
    assert!((found.covariance[(0, 0)].sqrt() - 0.02).abs() < 0.001, "{}", found.covariance);
}

#[test]
fn a_plane_of_points_determines_all_and_a_plane_without_texture_reports_its_weak_directions() {
    // A poster on a wall: all six, with depths and without, also when the camera looks at it straight.
    for noise in [KINECT_NOISE, NO_DEPTH] {
        let mut view = View::empty(5);
        let mut random = Random::new(5);
        for _ in 0..300 {
            view.see_point(ray_point(&any_pixel(&mut random), 2.0), noise);
        }
        let noisy = view.noisy(1.0, 5);
        let found = refined(&noisy, &noisy.guess(&Random::new(6).perturbation(0.02, 0.01)));
        assert_eq!(found.observability.estimated(), 6, "{:?}", found.observability);
        let (off_m, off_rad) = view.error(&found.camera_from_map);
        assert!(off_m < 0.02 && off_rad < 0.01, "{off_m} {off_rad}");
    }
    // One far corner of a picture: its position determines rotations, not translations.
    let mut view = View::empty(8);
    let mut random = Random::new(8);
    for _ in 0..60 {
        let pixel =
            nalgebra::Point2::new(random.between(400.0, 430.0), random.between(200.0, 230.0));
        view.see_point(ray_point(&pixel, 20.0), NO_DEPTH);
    }
    let noisy = view.noisy(1.0, 8);
    let guess = noisy.guess(&Random::new(9).perturbation(0.01, 0.005));
    let found = refined(&noisy, &guess);
    assert!(found.observability.estimated() <= 3, "{:?}", found.observability);
    check_held(&guess, &found);
}

#[test]
fn few_features_determine_some_directions() {
    // A point with depth gives a place: three directions. Two hide the turn about the line between them.
    for (points, lines, noise, expected) in [
        (1, 0, NO_DEPTH, 2),
        (1, 0, KINECT_NOISE, 3),
        (2, 0, NO_DEPTH, 4),
        (2, 0, KINECT_NOISE, 5),
        (3, 0, KINECT_NOISE, 6),
        (0, 1, NO_DEPTH, 2),
        (0, 1, KINECT_NOISE, 4),
        (0, 2, KINECT_NOISE, 6),
        (1, 1, KINECT_NOISE, 6),
    ] {
        // Limits that any number of observations would reach: geometry alone remains.
        let config = RefineConfig {
            max_std_dev_m: 3.0,
            max_std_dev_rad: 1.5,
            inlier_probability: 0.999,
            ..RefineConfig::default()
        };
        for seed in 0..10 {
            let view = View::room(points, lines, noise, 100 + seed);
            let guess = view.guess(&Random::new(seed).perturbation(0.001, 0.0005));
            let guess = PoseGuess { camera_from_map: guess, covariance: None };
            let found = refine_pose(&kinect(), &guess, &view.points, &view.lines, &config).unwrap();
            let case = format!("{points} points, {lines} lines, {noise:?}, seed {seed}");
            assert_eq!(found.observability.estimated(), expected, "{case}: {found:?}");
            assert!(found.covariance.iter().all(|value| value.is_finite()));
            assert!(found.covariance.cholesky().is_some(), "{case}");
        }
    }
}

#[test]
fn a_weak_direction_is_weak_by_the_limits_that_are_asked_for() {
    let view = View::room(40, 0, KINECT_NOISE, 2);
    let guess = PoseGuess { camera_from_map: view.camera_from_map, covariance: None };
    let estimated = |max_std_dev_m, max_std_dev_rad| {
        let config = RefineConfig { max_std_dev_m, max_std_dev_rad, ..RefineConfig::default() };
        let found = refine_pose(&kinect(), &guess, &view.points, &[], &config).unwrap();
        found.observability.estimated()
    };
    assert_eq!(estimated(0.05, 0.025), 6);
    assert_eq!(estimated(1e-6, 1e-6), 0);
    let some = estimated(0.002, 0.001);
    assert!((1..6).contains(&some), "{some}");
}

#[test]
fn the_directions_are_those_of_the_camera_frame() {
    // A wall without texture but for vertical edges, before a rotated camera: the vertical direction is unobservable, wherever up is.
    let mut view = View::empty(4);
    let up = Vector3::new(0.3, 1.0, 0.1).normalize();
    let mut random = Random::new(4);
    for _ in 0..20 {
        let middle = ray_point(&any_pixel(&mut random), random.between(1.5, 4.0));
        view.see_line(middle - 0.3 * up, middle + 0.3 * up, KINECT_NOISE);
    }
    let found = refined(&view, &view.camera_from_map.clone());
    let weak: Vec<_> = found.observability.weak().collect();
    assert_eq!(weak.len(), 1);
    assert!(weak[0].shift().unwrap().dot(&up).abs() > 0.999, "{weak:?}");
}
#[test]
fn what_outliers_have_moved_before_they_were_known_is_taken_back() {
    for seed in 0..10 {
        let mut view = parallel_lines(KINECT_NOISE, seed).noisy(1.0, seed);
        let mut random = Random::new(seed);
        for _ in 0..6 {
            view.see_point(ray_point(&any_pixel(&mut random), random.between(2.0, 4.0)), NO_DEPTH);
        }
        // All the points there are wrong, each in its own direction: they pull along the lines at first.
        view.points.iter_mut().for_each(|point| point.pixel_px.x += random.between(8.0, 60.0));
        let guess = view.guess(&random.perturbation(0.005, 0.002));
        let found = refined(&view, &guess);
        if found.observability.estimated() < 6 {
            check_held(&guess, &found);
        }
        if seed == 0 {
            assert_eq!(found.observability.estimated(), 5, "{:?}", found.points);
        }
    }
}
