use geometry::{DepthImage, Distortion};
use nalgebra::Vector3;

use super::*;
use crate::CalibrationConfig;
use crate::testing::{Eye, Random, depth_of_plane_m, small_camera};

/// A lens as strong as that of Rec-HV Annex 2.
const PLUMB_BOB: Distortion =
    Distortion::PlumbBob([0.138_263, -0.279_976, 0.002_072, 0.008_884, 0.0]);

/// The plane around a point, by a camera of usual noise.
fn plane_at(
    point: &Point3<f64>,
    image: &DepthImage,
    optics: DepthOptics<'_>,
    config: &CalibrationConfig,
) -> Option<Surface> {
    Patch::around(point, image, optics, config)?.surface(point, ImageNoise::default(), config)
}

fn wall() -> (Vector3<f64>, f64) {
    (Vector3::new(0.4, -0.1, 1.0).normalize(), 2.5)
}

#[test]
fn a_plane_is_found_where_it_is_through_any_lens() {
    let (normal, offset_m) = wall();
    for distortion in [Distortion::None, PLUMB_BOB] {
        let eye = Eye::new(small_camera(distortion));
        let image = eye.image(|x, y| Some(depth_of_plane_m(&normal, offset_m, x, y)));
        for (x, y) in [(0.0, 0.0), (0.4, 0.2), (-0.45, -0.3)] {
            // 10 cm before the plane, along the ray.
            let depth_m = depth_of_plane_m(&normal, offset_m, x, y) - 0.1;
            let point = Point3::new(x * depth_m, y * depth_m, depth_m);
            let surface =
                plane_at(&point, &image, eye.optics(), &CalibrationConfig::default()).unwrap();
            assert!((surface.normal - normal).norm() < 1e-5, "{surface:?}");
            assert!((surface.offset_m - offset_m).abs() < 1e-5, "{surface:?}");
            let expected_m = normal.dot(&point.coords) - offset_m;
            assert!((surface.distance_m(&point) - expected_m).abs() < 1e-5 && expected_m < -0.05);
        }
    }
}

/// Pixels that are taken for those of a camera without distortion put the plane elsewhere: the lens matters.
#[test]
fn a_lens_that_is_left_out_shows() {
    let (normal, offset_m) = wall();
    let eye = Eye::new(small_camera(PLUMB_BOB));
    let image = eye.image(|x, y| Some(depth_of_plane_m(&normal, offset_m, x, y)));
    let straight = Eye::new(small_camera(Distortion::None));
    let depth_m = depth_of_plane_m(&normal, offset_m, 0.45, 0.3);
    let point = Point3::new(0.45 * depth_m, 0.3 * depth_m, depth_m);
    let config = CalibrationConfig::default();
    let right = plane_at(&point, &image, eye.optics(), &config).unwrap();
    let wrong = plane_at(&point, &image, straight.optics(), &config).unwrap();
    assert!(right.distance_m(&point).abs() < 1e-5);
    assert!(wrong.distance_m(&point).abs() > 5e-3, "{}", wrong.distance_m(&point));
}

#[test]
fn the_claimed_deviations_are_those_of_noise() {
    let config = CalibrationConfig::default();
    let eye = Eye::new(small_camera(Distortion::None));
    let (normal, offset_m) = wall();
    let depth_m = depth_of_plane_m(&normal, offset_m, 0.1, 0.05);
    let point = Point3::new(0.1 * depth_m, 0.05 * depth_m, depth_m);
    let mut noise = Random::new(3);
    let (mut claimed, mut found, mut tilt_claimed, mut tilt_found) = (0.0, 0.0, 0.0, 0.0);
    let mut planes = 0.0;
    for _ in 0..40 {
        let image = eye.image(|x, y| {
            let depth_m = depth_of_plane_m(&normal, offset_m, x, y);
            Some(depth_m + config.depth_std_dev_m(depth_m) * noise.normal())
        });
        let Some(surface) = plane_at(&point, &image, eye.optics(), &config) else { continue };
        planes += 1.0;
        claimed += surface.std_dev_m.powi(2);
        found += surface.distance_m(&point).powi(2);
        tilt_claimed += surface.normal_std_dev_rad.powi(2);
        // Two sides to which a normal can turn.
        tilt_found += 0.5 * (surface.normal - normal).norm_squared();
    }
    assert!(planes >= 36.0, "{planes} of 40 noisy planes pass for planes");
    assert!((0.5..2.0).contains(&(found / claimed)), "{found} {claimed}");
    assert!((0.3..2.0).contains(&(tilt_found / tilt_claimed)), "{tilt_found} {tilt_claimed}");
}

#[test]
fn what_is_no_plane_is_left_out() {
    let config = CalibrationConfig::default();
    let eye = Eye::new(small_camera(Distortion::None));
    let point = Point3::new(0.0, 0.0, 3.0);
    let at = |image: &DepthImage| plane_at(&point, image, eye.optics(), &config);
    let mut noise = Random::new(5);
    let mut noisy =
        |depth_m: f64| Some(depth_m + 0.5 * config.depth_std_dev_m(depth_m) * noise.normal());
    assert!(at(&eye.image(|_, _| noisy(3.0))).is_some());
    // A step of 10 cm in the middle, beside it, and lying.
    assert!(at(&eye.image(|x, _| noisy(if x < 0.0 { 3.0 } else { 3.1 }))).is_none());
    assert!(at(&eye.image(|x, _| noisy(if x < 0.01 { 3.0 } else { 3.1 }))).is_none());
    assert!(at(&eye.image(|_, y| noisy(if y < 0.0 { 3.0 } else { 3.1 }))).is_none());
    // A post of 10 cm.
    let post = |x: f64| 3.0 - (0.05_f64.powi(2) - (3.0 * x).powi(2)).max(0.0).sqrt();
    assert!(at(&eye.image(|x, _| noisy(post(x)))).is_none());
    // A wall along the view, more holes than pixels, and nothing at all.
    let along = Vector3::new(1.0, 0.0, 0.1).normalize();
    assert!(
        at(&eye.image(|x, y| noisy(depth_of_plane_m(&along, 0.298, x, y).clamp(0.5, 9.0))))
            .is_none()
    );
    assert!(at(&eye.image(|x, _| ((x * 1e3) as i64 % 3 == 0).then_some(3.0))).is_none());
    assert!(at(&eye.image(|_, _| None)).is_none());
    // Beside and behind the image.
    let wall = eye.image(|_, _| Some(3.0));
    for (x, z) in [(3.0, 3.0), (-1.64, 3.0), (0.0, -3.0)] {
        let aside = Point3::new(x, 0.0, z);
        assert!(plane_at(&aside, &wall, eye.optics(), &config).is_none(), "{aside}");
    }
}

/// A box before a wall, its right side at `x / z = 0.1`, slanting by `slant`; with a shadow to its right if requested.
fn edge(eye: &Eye, slant: f64, shadow: f64) -> DepthImage {
    eye.image(|x, y| {
        let beyond = x - 0.1 - slant * y;
        match beyond {
            _ if beyond <= 0.0 => Some(2.5),
            _ if beyond < shadow => None,
            _ => Some(4.0),
        }
    })
}

#[test]
fn an_edge_is_found_where_it_is() {
    let config = CalibrationConfig::default();
    for distortion in [Distortion::None, PLUMB_BOB] {
        let eye = Eye::new(small_camera(distortion));
        for (slant, shadow) in [(0.0, 0.0), (0.2, 0.0), (0.0, 0.03)] {
            let image = edge(&eye, slant, shadow);
            // The scanner has it 4 cm away.
            let point_in_camera_m = Point3::new(0.1 * 2.5 + 0.04, 0.02, 2.5);
            let sought = EdgeSought { point_in_camera_m, near_is_right: false, jump_m: 1.5 };
            let surface = edge_at(&sought, &image, eye.optics(), &config).unwrap();
            let on_edge = Point3::new((0.1 + slant * 0.008) * 2.5, 0.008 * 2.5, 2.5);
            let off_m = surface.distance_m(&on_edge).abs();
            assert!(off_m < 0.6 * 2.5 / eye.camera.fx_px, "{off_m} m with slant {slant}");
            let distance_m = surface.distance_m(&point_in_camera_m).abs();
            assert!((distance_m - 0.04).abs() < 0.01, "{distance_m}");
            // Seen from the other side there is none.
            let mirrored = EdgeSought { near_is_right: true, ..sought };
            assert!(edge_at(&mirrored, &image, eye.optics(), &config).is_none());
            // Nor at another depth, nor far away.
            let deeper = Point3::new(0.4, 0.02, 4.0);
            let elsewhere = EdgeSought { point_in_camera_m: deeper, jump_m: 0.5, ..sought };
            assert!(edge_at(&elsewhere, &image, eye.optics(), &config).is_none());
        }
    }
}

#[test]
fn what_is_no_edge_is_left_out() {
    let config = CalibrationConfig::default();
    let eye = Eye::new(small_camera(Distortion::None));
    let sought = EdgeSought {
        point_in_camera_m: Point3::new(0.25, 0.0, 2.5),
        near_is_right: false,
        jump_m: 0.3,
    };
    let none = |image: &DepthImage| edge_at(&sought, image, eye.optics(), &config).is_none();
    // A wall, a wall that recedes, a slanting edge, a hole, and a gap with the near surface behind it.
    assert!(none(&eye.image(|_, _| Some(2.5))));
    assert!(none(&eye.image(|x, _| Some(2.5 + (x - 0.1).max(0.0) * 4.0))));
    assert!(none(&edge(&eye, 1.0, 0.0)));
    assert!(none(&eye.image(|x, _| (x < 0.1).then_some(2.5))));
    assert!(none(&eye.image(|x, _| (!(0.1..0.13).contains(&x)).then_some(2.5))));
    assert!(!none(&edge(&eye, 0.0, 0.0)));
}
