//! The derivatives against differences, and the quick errors against those that come with derivatives.

use estimation::perturbation::left::perturbed;
use nalgebra::{Matrix2, Point2, Vector2, Vector6};
use proptest::prelude::*;

use super::*;
use crate::solve::PointObservation;
use crate::solve::testing::{KINECT_NOISE, NO_DEPTH, Random, View, kinect};

fn check_derivatives(term: &impl Term, pose: &Isometry3<f64>) -> Result<(), TestCaseError> {
    const SMALL: f64 = 1e-6;
    let camera = kinect();
    let at = |pose: &Isometry3<f64>| term.block(&camera, &Placed::new(pose));
    let Some(block) = at(pose) else { return Ok(()) };
    prop_assert_eq!(block.rows, term.rows());
    // A line that is seen along itself is left to the descent that uses it already.
    let Some(errors) = term.errors(&camera, &Placed::new(pose)) else { return Ok(()) };
    let rounding = 1e-9 * (1.0 + errors.chi2);
    prop_assert!((errors.chi2 - block.chi2(MAX_ROWS)).abs() < rounding);
    prop_assert!((errors.pixel_chi2 - block.chi2(PIXEL_ROWS)).abs() < rounding);
    for column in 0..6 {
        let moved = |step: f64| {
            let mut perturbation = Vector6::zeros();
            perturbation[column] = step;
            at(&perturbed(pose, &perturbation))
        };
        let (Some(after), Some(before)) = (moved(SMALL), moved(-SMALL)) else { return Ok(()) };
        for row in 0..block.rows {
            let slope = (after.errors[row] - before.errors[row]) / (2.0 * SMALL);
            let size =
                block.jacobian[row].iter().fold(1.0, |size: f64, value| size.max(value.abs()));
            let found = block.jacobian[row][column];
            prop_assert!((found - slope).abs() < 1e-5 * size, "{row} {column}: {found} {slope}");
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn derivatives_are_those_of_the_errors(seed in any::<u64>(), with_depth in any::<bool>()) {
        let noise = if with_depth { KINECT_NOISE } else { NO_DEPTH };
        let view = View::room(5, 5, noise, seed).noisy(3.0, seed);
        let guess = view.guess(&Random::new(seed).perturbation(0.1, 0.05));
        let mut random = Random::new(seed);
        for point in &view.points {
            check_derivatives(&PointTerm::new(point).unwrap(), &guess)?;
            let spread_px = Vector2::new(random.between(-9.0, 9.0), random.between(-9.0, 9.0));
            let unsure = PointObservation { spread_px, ..*point };
            check_derivatives(&PointTerm::new(&unsure).unwrap(), &guess)?;
        }
        for line in &view.lines {
            if let Some(term) = LineTerm::new(&kinect(), line) {
                check_derivatives(&term, &guess)?;
            }
        }
    }

    #[test]
    fn a_spread_weighs_errors_by_the_covariance_that_it_makes(seed in any::<u64>()) {
        let view = View::room(5, 0, NO_DEPTH, seed).noisy(3.0, seed);
        let mut random = Random::new(seed);
        for point in &view.points {
            let spread_px = Vector2::new(random.between(-9.0, 9.0), random.between(-9.0, 9.0));
            let unsure = PointObservation { spread_px, ..*point };
            let pose = Placed::new(&view.camera_from_map);
            let errors = PointTerm::new(&unsure).unwrap().errors(&kinect(), &pose).unwrap();
            let place = view.camera_from_map * point.point_in_map_m;
            let off = kinect().project(&place).unwrap() - point.pixel_px;
            let covariance = Matrix2::identity() * point.pixel_std_dev_px.powi(2)
                + spread_px * spread_px.transpose();
            let chi2 = off.dot(&(covariance.try_inverse().unwrap() * off));
            prop_assert!((errors.chi2 - chi2).abs() < 1e-9 * (1.0 + chi2));
        }
    }

    #[test]
    fn without_noise_nothing_is_off_at_the_true_pose(seed in any::<u64>()) {
        let view = View::room(5, 5, KINECT_NOISE, seed);
        let pose = Placed::new(&view.camera_from_map);
        for point in &view.points {
            let errors = PointTerm::new(point).unwrap().errors(&kinect(), &pose).unwrap();
            prop_assert!(errors.chi2 < 1e-12);
        }
        for line in &view.lines {
            let Some(term) = LineTerm::new(&kinect(), line) else { continue };
            // Lines that run nearly through the camera have none.
            let Some(errors) = term.errors(&kinect(), &pose) else { continue };
            prop_assert!(errors.chi2 < 1e-9);
        }
    }
}

#[test]
fn a_line_is_off_by_the_distance_of_its_seen_ends_whatever_part_of_it_the_map_has() {
    let mut view = View::empty(3);
    view.camera_from_map = Isometry3::identity();
    view.see_line(Point3::new(-1.0, 0.0, 2.0), Point3::new(1.0, 0.0, 3.0), KINECT_NOISE);
    let mut line = view.lines[0];
    // Another part of the same line.
    line.start_in_map_m = Point3::new(3.0, 0.0, 4.0);
    line.end_in_map_m = Point3::new(2.0, 0.0, 3.5);
    line.start_px.y += 2.0;
    line.end_px.y -= 1.0;
    line.start_depth_m = Some(2.0 + 2.0 * line.depth_std_dev_m);
    let term = LineTerm::new(&kinect(), &line).unwrap();
    let errors = term.errors(&kinect(), &Placed::new(&Isometry3::identity())).unwrap();
    assert!((errors.pixel_chi2 - 5.0).abs() < 1e-9, "{errors:?}");
    assert!((errors.chi2 - 9.0).abs() < 1e-3, "{errors:?}");
    // Behind the camera it has the same image.
    let turned = Isometry3::rotation(Vector3::y() * std::f64::consts::PI);
    assert!(term.errors(&kinect(), &Placed::new(&turned)).is_none());
    assert!(term.block(&kinect(), &Placed::new(&turned)).is_none());
}

#[test]
fn what_has_no_numbers_is_not_used() {
    let view = View::room(1, 1, KINECT_NOISE, 5);
    let (point, line) = (view.points[0], view.lines[0]);
    assert!(PointTerm::new(&point).is_some() && LineTerm::new(&kinect(), &line).is_some());
    for bad in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        let mut spoilt = point;
        spoilt.pixel_std_dev_px = bad;
        assert!(PointTerm::new(&spoilt).is_none());
        spoilt = point;
        spoilt.depth_m = Some(bad);
        assert!(PointTerm::new(&spoilt).is_none());
        let mut spoilt = line;
        spoilt.depth_std_dev_m = bad;
        assert!(LineTerm::new(&kinect(), &spoilt).is_none());
    }
    let mut spoilt = line;
    spoilt.end_in_map_m = spoilt.start_in_map_m;
    assert!(LineTerm::new(&kinect(), &spoilt).is_none());
    spoilt = line;
    spoilt.end_px = spoilt.start_px;
    assert!(LineTerm::new(&kinect(), &spoilt).is_none());
    spoilt.end_px = Point2::new(f64::NAN, 0.0);
    assert!(LineTerm::new(&kinect(), &spoilt).is_none());
}
