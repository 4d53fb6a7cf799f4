use nalgebra::{Matrix6x4, Vector4, Vector6};
use proptest::prelude::*;

use super::*;
use crate::solve::testing::{any_pose, kinect};

fn any_point() -> impl Strategy<Value = Point3<f64>> {
    prop::array::uniform3(-3.0..3.0_f64).prop_map(Point3::from)
}

/// Points in front of the camera.
fn any_seen_point() -> impl Strategy<Value = Point3<f64>> {
    (-1.0..1.0_f64, -0.7..0.7_f64, 1.0..6.0_f64)
        .prop_map(|(x, y, z)| Point3::new(0.5 * x * z, 0.5 * y * z, z))
}

fn pixel_of(point: &Point3<f64>) -> Point2<f64> {
    let camera = kinect();
    let (x, y) = (point.x / point.z, point.y / point.z);
    Point2::new(camera.fx_px * x + camera.cx_px, camera.fy_px * y + camera.cy_px)
}

fn stacked(line: &PluckerLine) -> Vector6<f64> {
    Vector6::from_iterator(line.moment.iter().chain(line.direction.iter()).copied())
}

proptest! {
    #[test]
    fn all_points_of_a_line_lie_on_it_in_every_frame(
        start in any_point(), end in any_point(), share in -2.0..2.0_f64, pose in any_pose(),
    ) {
        prop_assume!((start - end).norm() > 0.1);
        let line = PluckerLine::through(&start, &end).unwrap();
        let point = start + share * (end - start);
        prop_assert!(line.distance_to(&point) < 1e-9);
        prop_assert!(line.transformed(&pose).distance_to(&(pose * point)) < 1e-9);
        prop_assert!(line.distance_to(&line.nearest_to_origin()) < 1e-9);
        prop_assert!(line.nearest_to_origin().coords.dot(&line.direction).abs() < 1e-9);
        let aside = point + line.direction.cross(&Vector3::new(0.3, -0.5, 0.7)).normalize() * 0.25;
        prop_assert!((line.distance_to(&aside) - 0.25).abs() < 1e-9);
    }

    #[test]
    fn the_image_of_a_line_holds_the_images_of_its_points(
        start in any_seen_point(), end in any_seen_point(), share in 0.0..1.0_f64, off in -20.0..20.0_f64,
    ) {
        prop_assume!((pixel_of(&start) - pixel_of(&end)).norm() > 5.0);
        let line = PluckerLine::through(&start, &end).unwrap();
        let pixel = pixel_of(&(start + share * (end - start)));
        let image = line.image(&kinect());
        let across = image.xy().normalize();
        let (distance, _) = line.distance_px(&kinect(), &(pixel + off * across)).unwrap();
        prop_assert!((distance - off).abs() < 1e-6, "{distance} {off}");
    }

    #[test]
    fn the_distance_in_the_image_changes_as_its_derivative_says(
        start in any_seen_point(), end in any_seen_point(), off in prop::array::uniform2(-20.0..20.0_f64),
    ) {
        const SMALL: f64 = 1e-6;
        prop_assume!((pixel_of(&start) - pixel_of(&end)).norm() > 20.0);
        let line = PluckerLine::through(&start, &end).unwrap();
        let pixel = pixel_of(&start) + nalgebra::Vector2::from(off);
        let (_, by_moment) = line.distance_px(&kinect(), &pixel).unwrap();
        for axis in 0..3 {
            let at = |step: f64| {
                let mut moved = line;
                moved.moment[axis] += step * line.moment.norm();
                moved.distance_px(&kinect(), &pixel).unwrap().0
            };
            let slope = (at(SMALL) - at(-SMALL)) / (2.0 * SMALL * line.moment.norm());
            let size = by_moment.norm();
            prop_assert!((by_moment[axis] - slope).abs() < 1e-5 * size, "{by_moment} {slope}");
        }
    }

    #[test]
    fn the_orthonormal_form_is_the_same_line_and_changes_as_its_jacobian_says(
        start in any_point(), end in any_point(),
    ) {
        const SMALL: f64 = 1e-6;
        let line = PluckerLine::through(&start, &end);
        prop_assume!(line.is_some_and(|line| line.direction.norm() > 0.1 && line.moment.norm() > 0.1));
        let orthonormal = OrthonormalLine::new(&line.unwrap()).unwrap();
        prop_assert!(orthonormal.plucker().distance_to(&start) < 1e-9);
        prop_assert!(orthonormal.plucker().distance_to(&end) < 1e-9);
        let numeric = Matrix6x4::from_columns(&[0, 1, 2, 3].map(|axis| {
            let at = |step: f64| {
                let mut correction = Vector4::zeros();
                correction[axis] = step;
                stacked(&orthonormal.corrected(&correction).plucker())
            };
            (at(SMALL) - at(-SMALL)) / (2.0 * SMALL)
        }));
        prop_assert!((orthonormal.jacobian() - numeric).norm() < 1e-8, "{numeric}");
    }

    #[test]
    fn a_corrected_line_is_a_line(
        start in any_point(), end in any_point(), correction in prop::array::uniform4(-2.0..2.0_f64),
    ) {
        let line = PluckerLine::through(&start, &end);
        prop_assume!(line.is_some_and(|line| line.direction.norm() > 0.1 && line.moment.norm() > 0.1));
        let corrected = OrthonormalLine::new(&line.unwrap()).unwrap().corrected(&Vector4::from(correction));
        let plucker = corrected.plucker();
        prop_assert!(plucker.moment.dot(&plucker.direction).abs() < 1e-12);
        prop_assert!((stacked(&plucker).norm() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_ends_of_a_segment_are_found_again(start in any_seen_point(), end in any_seen_point(), off in -5.0..5.0_f64) {
        let (start_px, end_px) = (pixel_of(&start), pixel_of(&end));
        prop_assume!((start_px - end_px).norm() > 20.0);
        let line = PluckerLine::through(&start, &end).unwrap();
        // The segment was seen beside the line: its ends still lead to the points across from them.
        let across = off * nalgebra::Vector2::new(start_px.y - end_px.y, end_px.x - start_px.x).normalize();
        let ends = line.ends_of(&kinect(), &(start_px + across), &(end_px + across)).unwrap();
        prop_assert!((ends[0] - start).norm() < 1e-6 && (ends[1] - end).norm() < 1e-6);
    }
}

#[test]
fn what_is_no_line_and_what_has_no_image_is_said() {
    let point = Point3::new(1.0, 2.0, 3.0);
    assert_eq!(PluckerLine::through(&point, &point), None);
    assert_eq!(PluckerLine::through(&point, &Point3::new(f64::NAN, 0.0, 0.0)), None);
    let towards_camera = PluckerLine::through(&point, &(2.0 * point.coords).into()).unwrap();
    assert_eq!(OrthonormalLine::new(&towards_camera), None);
    let pixel = Point2::new(100.0, 200.0);
    assert_eq!(towards_camera.distance_px(&kinect(), &pixel), None);
    let line = PluckerLine::through(&point, &Point3::new(2.0, 2.0, 3.0)).unwrap();
    assert_eq!(line.ends_of(&kinect(), &pixel, &pixel), None);
    assert_eq!(line.intersection(&Vector3::y()), None);
}
