//! Depth images become organised clouds, and these depth images again.

use nalgebra::{Point2, Point3};
use proptest::prelude::*;

use super::super::CloudCamera;
use super::super::pinhole_fit::PinholeFit;
use crate::{CameraModel, Distortion, OrganisedCloud, PinholeFitError, Stamp};

pub(super) const STAMP: Stamp = Stamp::from_nanos(7);

fn camera((width_px, height_px): (usize, usize), focal_px: f64, off_px: [f64; 2]) -> CameraModel {
    CameraModel {
        width_px,
        height_px,
        fx_px: focal_px,
        fy_px: 1.01 * focal_px,
        cx_px: 0.5 * width_px as f64 + off_px[0],
        cy_px: 0.5 * height_px as f64 + off_px[1],
        distortion: Distortion::None,
    }
}

/// A point for each pixel, as a driver computes it; not a number where nothing was measured.
fn points(camera: &CameraModel, depth_m: impl Fn(usize, usize) -> f32) -> Vec<Point3<f32>> {
    let pixels = (0..camera.height_px).flat_map(|row| (0..camera.width_px).map(move |c| (c, row)));
    let point = |(column, row): (usize, usize)| {
        let ray = camera.ray(&Point2::new(column as f64, row as f64)).unwrap();
        let depth_m = depth_m(column, row);
        Point3::new(ray.x as f32 * depth_m, ray.y as f32 * depth_m, depth_m)
    };
    pixels.map(point).collect()
}

fn organised(camera: &CameraModel, points: &[Point3<f32>]) -> OrganisedCloud {
    OrganisedCloud::from_rows(STAMP, "camera".to_owned(), camera.width_px, points)
}

/// A wall with a box before it, and nothing measured here and there.
fn scene(column: usize, row: usize) -> f32 {
    match (column, row) {
        (20..=40, 10..=30) => 1.25,
        _ if (column * 7 + row * 3).is_multiple_of(29) => f32::NAN,
        _ => 2.0 + 0.01 * column as f32,
    }
}

proptest! {
    /// Each depth comes back in its pixel, and the camera with it.
    #[test]
    fn an_organised_cloud_gives_back_its_depth_image(
        depths_m in proptest::collection::vec(prop_oneof![4 => 0.4..9.0_f32, 1 => Just(f32::NAN)], 40 * 30),
        focal_px in 20.0..60.0_f64,
        off_px in proptest::array::uniform2(-5.0..5.0_f64),
    ) {
        let camera = camera((40, 30), focal_px, off_px);
        let cloud = organised(&camera, &points(&camera, |column, row| depths_m[row * 40 + column]));
        let frame = CloudCamera::default().frame_of_organised(&cloud).unwrap();
        let fitted = frame.camera();
        prop_assert!((fitted.fx_px - camera.fx_px).abs() < 1e-3, "{fitted:?}");
        prop_assert!((fitted.fy_px - camera.fy_px).abs() < 1e-3, "{fitted:?}");
        prop_assert!((fitted.cx_px - camera.cx_px).abs() < 1e-3, "{fitted:?}");
        prop_assert!((fitted.cy_px - camera.cy_px).abs() < 1e-3, "{fitted:?}");
        for (depth_mm, depth_m) in frame.depths_mm().iter().zip(&depths_m) {
            let expected_mm = if depth_m.is_nan() { 0.0 } else { depth_m * 1e3 };
            prop_assert!((f32::from(*depth_mm) - expected_mm).abs() <= 0.51);
        }
    }

    #[test]
    fn any_organised_points_make_an_image_of_their_size_or_none(
        points_m in proptest::collection::vec(proptest::array::uniform3(any::<f32>()), 0..200),
        width_px in 0..20_usize,
    ) {
        let points_m: Vec<Point3<f32>> = points_m.into_iter().map(Point3::from).collect();
        let cloud = OrganisedCloud::from_rows(STAMP, String::new(), width_px, &points_m);
        if let Ok(frame) = CloudCamera::default().frame_of_organised(&cloud) {
            prop_assert_eq!(frame.camera().width_px, width_px);
        }
    }
}

#[test]
fn what_no_pinhole_camera_made_is_refused() {
    let camera = camera((64, 48), 60.0, [0.0; 2]);
    let seen = points(&camera, scene);
    let fitted = PinholeFit::of(&organised(&camera, &seen)).camera().unwrap();
    assert!((fitted.fx_px - 60.0).abs() < 1e-3, "{fitted:?}");
    // In a frame with x forward, as clouds of the rig.
    let forward: Vec<_> = seen.iter().map(|point| Point3::new(point.z, -point.x, 3.0)).collect();
    let error = PinholeFit::of(&organised(&camera, &forward)).camera().unwrap_err();
    assert!(matches!(error, PinholeFitError::Residual { .. }), "{error}");
    // A lens whose distortion was not removed.
    let lens =
        CameraModel { distortion: Distortion::PlumbBob([0.6, 0.4, 0.0, 0.0, 0.0]), ..camera };
    let error = PinholeFit::of(&organised(&lens, &points(&lens, scene))).camera().unwrap_err();
    assert!(matches!(error, PinholeFitError::Residual { .. }), "{error}");
    let few = PinholeFit::of(&organised(&camera, &seen[..64])).camera().unwrap_err();
    assert!(matches!(few, PinholeFitError::TooFewPoints { points: 61 | 62 }), "{few}");
    let column: Vec<_> = (0..48 * 64).map(|row| Point3::new(0.0, 0.01 * row as f32, 1.0)).collect();
    let error = PinholeFit::of(&organised(&camera, &column)).camera().unwrap_err();
    assert!(matches!(error, PinholeFitError::Camera(_)), "{error}");
}

#[test]
fn the_camera_stays_while_it_fits() {
    let camera = camera((64, 48), 60.0, [0.0; 2]);
    let mut known = CloudCamera::default();
    let first = known.frame_of_organised(&organised(&camera, &points(&camera, scene))).unwrap();
    // Rounded to millimetres, and nearly nothing measured: too little for a camera of its own.
    let rounded = |column: usize, row: usize| {
        if row == 10 { (scene(column, row) * 1e3).round() / 1e3 } else { f32::NAN }
    };
    let sparse = organised(&camera, &points(&camera, rounded));
    let second = known.frame_of_organised(&sparse).unwrap();
    assert_eq!(second.camera(), first.camera());
    let zoomed = CameraModel { fx_px: 80.0, fy_px: 80.0, ..camera };
    let third = known.frame_of_organised(&organised(&zoomed, &points(&zoomed, scene))).unwrap();
    assert!((third.camera().fx_px - 80.0).abs() < 1e-3);
}
