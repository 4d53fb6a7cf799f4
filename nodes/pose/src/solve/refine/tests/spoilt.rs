//! Invalid input, and its results.

use geometry::Distortion;
use nalgebra::{Isometry3, Matrix6, Point2, Point3, Translation3, Vector3};
use proptest::prelude::*;

use crate::solve::testing::{KINECT_NOISE, Random, View, kinect};
use crate::solve::{
    LineObservation, PointObservation, PoseError, PoseGuess, RefineConfig, Verdict, refine_pose,
};

fn guess_at(camera_from_map: Isometry3<f64>) -> PoseGuess {
    PoseGuess { camera_from_map, covariance: None }
}

#[test]
fn nothing_to_go_by_is_said() {
    let guess = guess_at(Isometry3::identity());
    let config = RefineConfig::default();
    let nothing = refine_pose(&kinect(), &guess, &[], &[], &config);
    assert_eq!(nothing, Err(PoseError::NothingSeen { points: 0, lines: 0 }));
    let mut view = View::room(2, 1, KINECT_NOISE, 1);
    view.points.iter_mut().for_each(|point| point.pixel_px.x = f64::NAN);
    view.lines[0].end_in_map_m.y = f64::INFINITY;
    let unusable = refine_pose(&kinect(), &guess, &view.points, &view.lines, &config);
    assert_eq!(unusable, Err(PoseError::NothingSeen { points: 2, lines: 1 }));
}

#[test]
fn a_camera_and_a_guess_that_cannot_be_used_are_refused() {
    let view = View::room(20, 0, KINECT_NOISE, 1);
    let config = RefineConfig::default();
    let run = |camera: &geometry::CameraModel, guess: &PoseGuess| {
        refine_pose(camera, guess, &view.points, &[], &config)
    };
    let guess = guess_at(view.camera_from_map);
    let bent = geometry::CameraModel {
        distortion: Distortion::PlumbBob([0.1, 0.0, 0.0, 0.0, 0.0]),
        ..kinect()
    };
    assert_eq!(run(&bent, &guess), Err(PoseError::NotRectified));
    let no_camera = geometry::CameraModel { fx_px: 0.0, ..kinect() };
    assert!(matches!(run(&no_camera, &guess), Err(PoseError::Camera(_))));
    let lost = guess_at(Isometry3::translation(f64::NAN, 0.0, 0.0));
    assert_eq!(run(&kinect(), &lost), Err(PoseError::Guess));
    let far = guess_at(Isometry3::translation(0.0, 1e10, 0.0));
    assert_eq!(run(&kinect(), &far), Err(PoseError::Guess));
    let negative = PoseGuess { covariance: Some(-Matrix6::identity()), ..guess };
    assert_eq!(run(&kinect(), &negative), Err(PoseError::Guess));
    let bad = RefineConfig { max_std_dev_m: -1.0, ..config };
    let refused = refine_pose(&kinect(), &guess, &view.points, &[], &bad);
    assert!(matches!(refused, Err(PoseError::Config(_))));
}

#[test]
fn unusable_and_behind_observations_change_nothing() {
    let view = View::room(60, 20, KINECT_NOISE, 3).noisy(1.0, 3);
    let guess = guess_at(view.guess(&Random::new(3).perturbation(0.02, 0.01)));
    let config = RefineConfig::default();
    let expected = refine_pose(&kinect(), &guess, &view.points, &view.lines, &config).unwrap();
    let mut spoilt = view.clone();
    let map_from_camera = view.camera_from_map.inverse();
    for (index, bad) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().enumerate() {
        let mut point = view.points[index];
        point.point_in_map_m.z = bad;
        spoilt.points.push(point);
        let mut line = view.lines[index];
        line.start_depth_m = Some(bad);
        spoilt.lines.push(line);
    }
    let behind = PointObservation {
        point_in_map_m: map_from_camera * Point3::new(0.0, 0.0, -2.0),
        pixel_px: Point2::new(kinect().cx_px, kinect().cy_px),
        depth_m: None,
        ..view.points[0]
    };
    let line_behind = LineObservation {
        start_in_map_m: map_from_camera * Point3::new(-1.0, 0.1, -2.0),
        end_in_map_m: map_from_camera * Point3::new(1.0, 0.1, -2.0),
        start_px: Point2::new(100.0, kinect().cy_px - 0.05 * kinect().fy_px),
        end_px: Point2::new(500.0, kinect().cy_px - 0.05 * kinect().fy_px),
        ..view.lines[0]
    };
    spoilt.points.push(behind);
    spoilt.lines.push(line_behind);
    let found = refine_pose(&kinect(), &guess, &spoilt.points, &spoilt.lines, &config).unwrap();
    assert_eq!(found.camera_from_map, expected.camera_from_map);
    assert_eq!(found.covariance, expected.covariance);
    let last = [Verdict::Unusable, Verdict::Unusable, Verdict::Unusable, Verdict::Outlier];
    assert_eq!(found.points[60..], last);
    assert_eq!(found.lines[20..], last);
}

#[test]
fn a_depth_at_the_edge_of_a_thing_is_left_out_and_its_point_kept() {
    let mut view = View::room(60, 10, KINECT_NOISE, 6).noisy(0.5, 6);
    let off = |depth_m: &mut Option<f64>| *depth_m = depth_m.map(|depth_m| depth_m + 0.7);
    view.points[..6].iter_mut().for_each(|point| off(&mut point.depth_m));
    off(&mut view.lines[0].end_depth_m);
    let guess = guess_at(view.camera_from_map);
    let config = RefineConfig::default();
    let found = refine_pose(&kinect(), &guess, &view.points, &view.lines, &config).unwrap();
    assert_eq!(found.points[..6], [Verdict::FitsWithoutDepth; 6]);
    assert_eq!(found.lines[0], Verdict::FitsWithoutDepth);
    assert!(found.points[6..].iter().filter(|verdict| **verdict == Verdict::Fits).count() > 50);
    assert!(view.error(&found.camera_from_map).0 < 0.02);
    let strict = RefineConfig { keep_without_depth: false, ..config };
    let found = refine_pose(&kinect(), &guess, &view.points, &view.lines, &strict).unwrap();
    assert_eq!(found.points[..6], [Verdict::Outlier; 6]);
}

#[test]
fn a_guess_that_explains_nothing_is_said() {
    let view = View::room(30, 0, KINECT_NOISE, 2);
    let turned = Isometry3::rotation(Vector3::y() * std::f64::consts::PI) * view.camera_from_map;
    let found =
        refine_pose(&kinect(), &guess_at(turned), &view.points, &[], &RefineConfig::default());
    assert_eq!(found, Err(PoseError::NothingFits { usable: 30 }));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_numbers_are_no_panic(values in prop::collection::vec(any::<f64>(), 60), seed in any::<u64>()) {
        let mut view = View::room(8, 4, KINECT_NOISE, seed);
        let mut values = values.into_iter();
        let mut next = || values.next().unwrap_or(1e300);
        for point in view.points.iter_mut().take(4) {
            point.point_in_map_m = Point3::new(next(), next(), next());
            point.pixel_px = Point2::new(next(), next());
            point.depth_m = Some(next());
            point.pixel_std_dev_px = next().abs();
        }
        for line in view.lines.iter_mut().take(2) {
            line.start_in_map_m = Point3::new(next(), next(), next());
            line.end_px = Point2::new(next(), next());
            line.start_depth_m = Some(next().abs());
        }
        let far = Isometry3::from_parts(Translation3::new(next(), next(), next()), view.camera_from_map.rotation);
        for guess in [view.camera_from_map, far] {
            let found = refine_pose(&kinect(), &guess_at(guess), &view.points, &view.lines, &RefineConfig::default());
            if let Ok(found) = found {
                prop_assert!(found.covariance.iter().all(|value| value.is_finite()));
                prop_assert!(found.camera_from_map.translation.vector.iter().all(|value| value.is_finite()));
            }
        }
    }
}
