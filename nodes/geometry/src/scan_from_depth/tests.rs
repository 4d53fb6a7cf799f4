use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;
use crate::{CameraModel, DepthPixels, Distortion, Stamp, pose_from_vector};

/// A Kinect at a quarter of its resolution.
fn camera() -> CameraModel {
    CameraModel {
        width_px: 160,
        height_px: 120,
        fx_px: 130.5,
        fy_px: 129.5,
        cx_px: 79.5,
        cy_px: 59.5,
        distortion: Distortion::None,
    }
}

fn rays() -> RayTable {
    RayTable::new(&camera()).unwrap()
}

/// A camera on the rig that looks down by `pitch_rad` and left by `yaw_rad`.
fn rig_from_camera(yaw_rad: f64, pitch_rad: f64) -> Isometry3<f64> {
    let optical = pose_from_vector(&[0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2]);
    pose_from_vector(&[0.0, 0.0, 0.0, yaw_rad, pitch_rad, 0.0]) * optical
}

/// What the camera sees of a scene that gives the distance along a direction in the rig.
fn render(rig_from_camera: &Isometry3<f64>, distance: impl Fn(&Vector3<f64>) -> f64) -> DepthImage {
    let rays = rays();
    let mut depths_m = Vec::new();
    for row_px in 0..rays.height_px() {
        for column_px in 0..rays.width_px() {
            let ray = rays.ray(column_px, row_px).unwrap().cast::<f64>().push(1.0);
            // Scaled to a depth of 1 m, so the distance along it is the depth.
            depths_m.push(distance(&(rig_from_camera.rotation * ray)) as f32);
        }
    }
    let size_px = (rays.width_px(), rays.height_px());
    let pixels = DepthPixels::Metres(depths_m);
    DepthImage::new(Stamp::from_nanos(5), "camera".to_owned(), size_px, pixels).unwrap()
}

/// The distance to an endless wall `x_m` ahead.
fn wall(x_m: f64) -> impl Fn(&Vector3<f64>) -> f64 {
    move |direction| x_m / direction.x
}

#[test]
fn a_wall_is_scanned_as_a_wall_in_whichever_direction_the_camera_looks() {
    for (yaw_rad, pitch_rad) in [(0.0, 0.0), (0.0, 0.2), (0.3, 0.0), (-0.2, -0.15)] {
        let rig_from_camera = rig_from_camera(yaw_rad, pitch_rad);
        // At this resolution a row is 2.3 cm high at 3 m.
        let band = ScanBand::Height { plane_height_m: -0.05, band_height_m: 0.06 };
        let parameters = ScanFromDepth { band, beams: 40, ..ScanFromDepth::default() };
        let cutter = ScanCutter::new(rays(), &rig_from_camera, &parameters).unwrap();
        let scan = cutter.cut(&render(&rig_from_camera, wall(3.0))).unwrap();
        assert_eq!((scan.stamp.as_nanos(), scan.frame_id.as_str()), (5, "laser"));
        assert_eq!(scan.ranges_m.len(), 40);
        let mut returns = 0;
        for beam in 0..40 {
            let Some(range_m) = scan.measured_range_m(beam) else { continue };
            returns += 1;
            // The beam takes the nearest point of its width.
            let half_rad = f64::from(scan.angle_increment_rad) / 2.0 + 1e-4;
            let azimuth_rad = scan.azimuth_rad(beam).abs();
            let nearest_m = 3.0 / (azimuth_rad - half_rad).max(0.0).cos();
            let farthest_m = 3.0 / (azimuth_rad + half_rad).cos();
            let range_m = f64::from(range_m);
            assert!(
                nearest_m - 1e-4 <= range_m && range_m <= farthest_m + 1e-4,
                "{beam}: {range_m}"
            );
        }
        // A pitched camera's view is wider above or below the plane than in it.
        assert!(
            returns >= 36,
            "{returns} returns at a yaw of {yaw_rad} and a pitch of {pitch_rad}"
        );
    }
}

#[test]
fn the_first_beam_is_the_rightmost_and_the_aperture_is_the_view() {
    let rig_from_camera = rig_from_camera(0.0, 0.0);
    let cutter = ScanCutter::new(rays(), &rig_from_camera, &ScanFromDepth::default()).unwrap();
    // A pillar to the left of y = x / 4, before a wall.
    let pillar = |direction: &Vector3<f64>| if direction.y > 0.25 { 1.0 } else { 4.0 };
    let scan = cutter.cut(&render(&rig_from_camera, pillar)).unwrap();
    let half_view_rad = (79.5_f64 / 130.5).atan();
    assert!((scan.azimuth_rad(0) + half_view_rad).abs() < 1e-6);
    assert!((scan.azimuth_rad(89) - half_view_rad).abs() < 1e-6);
    let edge_rad = 0.25_f64.atan();
    let increment_rad = f64::from(scan.angle_increment_rad);
    for beam in 0..90 {
        let Some(range_m) = scan.measured_range_m(beam) else {
            panic!("beam {beam} has no return")
        };
        let azimuth_rad = scan.azimuth_rad(beam);
        if (azimuth_rad - edge_rad).abs() > 2.0 * increment_rad {
            assert_eq!(range_m < 2.0, azimuth_rad > edge_rad, "beam {beam} at {azimuth_rad}");
        }
    }
}

#[test]
fn only_the_layer_counts() {
    let rig_from_camera = rig_from_camera(0.0, 0.0);
    // A shelf that hangs 0.1 m above the plane of the scan, a wall behind it.
    let shelf = |direction: &Vector3<f64>| if direction.z > 0.05 { 1.0 } else { 3.0 };
    let image = render(&rig_from_camera, shelf);
    let nearest = |band| {
        let parameters = ScanFromDepth { band, ..ScanFromDepth::default() };
        let scan =
            ScanCutter::new(rays(), &rig_from_camera, &parameters).unwrap().cut(&image).unwrap();
        scan.ranges_m.iter().copied().fold(f32::INFINITY, f32::min)
    };
    let below = nearest(ScanBand::Height { plane_height_m: -0.05, band_height_m: 0.06 });
    assert!((below - 3.0).abs() < 1e-3, "{below}");
    let above = nearest(ScanBand::Height { plane_height_m: 0.1, band_height_m: 0.06 });
    assert!((above - 1.0).abs() < 1e-3, "{above}");
    let rows = nearest(ScanBand::Rows { first_px: 60, count: 2 });
    assert!((rows - 3.0).abs() < 1e-3, "{rows}");
    let rows = nearest(ScanBand::Rows { first_px: 0, count: 120 });
    assert!((rows - 1.0).abs() < 1e-3, "{rows}");
}

#[test]
fn what_returns_nothing_is_infinite() {
    let rig_from_camera = rig_from_camera(0.0, 0.0);
    let cutter = ScanCutter::new(rays(), &rig_from_camera, &ScanFromDepth::default()).unwrap();
    for nothing in [0.0, 0.3, 20.0, f64::NAN, f64::INFINITY] {
        let scan = cutter.cut(&render(&rig_from_camera, |_| nothing)).unwrap();
        assert!(scan.ranges_m.iter().all(|&range_m| range_m == f32::INFINITY), "{nothing}");
    }
}

proptest! {
    #[test]
    fn each_direction_falls_into_its_nearest_beam(
        (min_rad, width_rad) in (-PI..PI, 0.1..6.2_f64), beams in 2..400_usize, share in 0.0..1.0_f64,
    ) {
        let aperture_rad = Some((min_rad, min_rad + width_rad));
        let parameters = ScanFromDepth { aperture_rad, beams, ..ScanFromDepth::default() };
        let cutter = ScanCutter::new(rays(), &rig_from_camera(0.0, 0.0), &parameters).unwrap();
        let azimuth_rad = min_rad + share * width_rad;
        let (sin, cos) = azimuth_rad.sin_cos();
        let beam = cutter.beam(sin.atan2(cos)).unwrap();
        let increment_rad = width_rad / (beams - 1) as f64;
        let beam_rad = min_rad + beam as f64 * increment_rad;
        // A full turn's first and last beam are one direction.
        let apart_rad = (azimuth_rad - beam_rad + PI).rem_euclid(2.0 * PI) - PI;
        prop_assert!(apart_rad.abs() <= increment_rad / 2.0 + 1e-5);
    }
}

#[test]
fn a_camera_that_looks_to_the_rear_crosses_no_seam() {
    let rig_from_camera = rig_from_camera(PI, 0.0);
    let cutter = ScanCutter::new(rays(), &rig_from_camera, &ScanFromDepth::default()).unwrap();
    let scan = cutter.cut(&render(&rig_from_camera, wall(-2.0))).unwrap();
    assert!(scan.ranges_m.iter().all(|range_m| (2.0..2.5).contains(range_m)), "{scan:?}");
}

#[test]
fn parameters_that_describe_no_scan_are_refused() {
    let good = ScanFromDepth::default();
    let layer = |plane_height_m, band_height_m| ScanBand::Height { plane_height_m, band_height_m };
    for (parameters, part) in [
        (ScanFromDepth { beams: 1, ..good.clone() }, "1 beams"),
        (ScanFromDepth { beams: usize::MAX, ..good.clone() }, "between 2 and 14400"),
        (ScanFromDepth { range_min_m: -0.1, ..good.clone() }, "-0.1"),
        (ScanFromDepth { range_max_m: f32::NAN, ..good.clone() }, "NaN"),
        (ScanFromDepth { band: layer(f64::NAN, 0.1), ..good.clone() }, "height of NaN"),
        (ScanFromDepth { band: layer(0.0, 0.0), ..good.clone() }, "layer of 0 m"),
        (
            ScanFromDepth { band: ScanBand::Rows { first_px: 119, count: 2 }, ..good.clone() },
            "rows 0 to 119",
        ),
        (
            ScanFromDepth { band: ScanBand::Rows { first_px: 3, count: 0 }, ..good.clone() },
            "0 rows",
        ),
        (ScanFromDepth { aperture_rad: Some((0.5, 0.5)), ..good.clone() }, "0.5 to 0.5"),
        (ScanFromDepth { aperture_rad: Some((-4.0, 4.0)), ..good }, "by a turn at most"),
    ] {
        let error = ScanCutter::new(rays(), &rig_from_camera(0.0, 0.0), &parameters).unwrap_err();
        assert!(error.to_string().contains(part), "{error}");
    }
    let column = CameraModel { width_px: 1, height_px: 1, ..camera() };
    let error = ScanCutter::new(
        RayTable::new(&column).unwrap(),
        &rig_from_camera(0.0, 0.0),
        &ScanFromDepth::default(),
    );
    assert_eq!(error.unwrap_err(), ScanFromDepthError::NoView);
}

/// A band thinner than the distance between two rows once fell between them, and the scan was empty.
#[test]
fn a_band_thinner_than_a_row_intersects_one_at_any_distance() {
    let rig_from_camera = rig_from_camera(0.0, 0.0);
    for distance_m in [0.6, 1.5, 3.0, 5.0, 7.5] {
        for plane_height_m in [-0.05, -0.013, 0.0, 0.031] {
            let band = ScanBand::Height { plane_height_m, band_height_m: 1e-3 };
            let parameters = ScanFromDepth { band, beams: 40, ..ScanFromDepth::default() };
            let cutter = ScanCutter::new(rays(), &rig_from_camera, &parameters).unwrap();
            let scan = cutter.cut(&render(&rig_from_camera, wall(distance_m))).unwrap();
            let middle_m = scan.measured_range_m(20);
            assert!(
                middle_m.is_some(),
                "nothing at {distance_m} m in a plane at {plane_height_m} m"
            );
        }
    }
}
