use std::f64::consts::PI;

use geometry::{CameraModel, DepthPixels, Distortion, RayTable};

use super::*;

const CAMERA: CameraModel = CameraModel {
    width_px: 160,
    height_px: 120,
    fx_px: 144.0,
    fy_px: 144.0,
    cx_px: 79.5,
    cy_px: 59.5,
    distortion: Distortion::None,
};
/// Cycles a second.
const RATE_HZ: f64 = 7.0;

/// A wall across the view, `away_m` from the camera.
fn image(away_m: f64) -> DepthImage {
    let pixels = vec![(away_m * 1e3) as u16; CAMERA.width_px * CAMERA.height_px];
    let size_px = (CAMERA.width_px, CAMERA.height_px);
    let pixels = DepthPixels::Millimetres(pixels);
    DepthImage::new(Stamp::default(), String::new(), size_px, pixels).unwrap()
}

/// The same wall as seen by the scanner, which is straight below the camera.
fn scan(stamp: Stamp, away_m: f64) -> Scan {
    let beams = 360;
    let ranges_m = (0..beams)
        .map(|beam| {
            let azimuth_rad = -PI + f64::from(beam) * PI / 180.0;
            let range_m = away_m / azimuth_rad.cos();
            if (0.0..8.0).contains(&range_m) { range_m as f32 } else { f32::INFINITY }
        })
        .collect();
    Scan {
        stamp,
        angle_min_rad: -PI as f32,
        angle_increment_rad: PI as f32 / 180.0,
        range_min_m: 0.1,
        range_max_m: 12.0,
        ranges_m,
        ..Scan::default()
    }
}

fn check(parameters: &DetectionParameters) -> (ExtrinsicsCheck, Counters) {
    let counters = Counters::default();
    let check =
        ExtrinsicsCheck::new(parameters, &RigMounts::default(), counters.clone()).unwrap().unwrap();
    (check, counters)
}

/// Ten seconds of cycles; where the rig is at each, and how far the scanner has the wall.
fn verdicts(
    check: &mut ExtrinsicsCheck,
    pose: impl Fn(f64) -> Isometry3<f64>,
    away_m: impl Fn(f64) -> f64,
) -> Vec<(f64, Extrinsics)> {
    let rays = RayTable::new(&CAMERA).unwrap();
    let optics = DepthOptics { camera: &CAMERA, rays: &rays };
    let seen = image(3.0);
    (0..70)
        .filter_map(|cycle| {
            let time_s = f64::from(cycle) / RATE_HZ;
            let scan = scan(Stamp::default().plus_seconds(time_s), away_m(time_s));
            let verdict = check.look(&scan, &seen, optics, &pose(time_s))?;
            Some((time_s, verdict))
        })
        .collect()
}

#[test]
fn one_cycle_a_second_is_checked_and_a_displacement_is_reported() {
    let (mut check, _) = check(&DetectionParameters::default());
    let still = |_: f64| Isometry3::identity();
    let right = verdicts(&mut check, still, |_| 3.0);
    assert!((9..=10).contains(&right.len()), "{right:?}");
    assert!(right.iter().all(|(_, verdict)| !verdict.is_wrong()), "{right:?}");
    assert!(matches!(right.last(), Some((_, Extrinsics::Right { .. }))), "{right:?}");

    let (mut check, _) = self::check(&DetectionParameters::default());
    let knocked = verdicts(&mut check, still, |time_s| if time_s < 2.5 { 3.0 } else { 3.06 });
    let told = knocked.iter().find(|(_, verdict)| verdict.is_wrong());
    assert!(told.is_some_and(|(time_s, _)| (3.0..9.0).contains(time_s)), "{knocked:?}");
    check.forget();
    assert!(check.before.is_none() && check.looked.is_none());
}

#[test]
fn no_cycle_is_checked_while_the_platform_moves() {
    let (mut check, _) = check(&DetectionParameters::default());
    let driving =
        verdicts(&mut check, |time_s| Isometry3::translation(0.5 * time_s, 0.0, 0.0), |_| 3.3);
    assert!(driving.is_empty(), "{driving:?}");
    let (mut check, _) = self::check(&DetectionParameters::default());
    let turning = |time_s: f64| Isometry3::rotation(nalgebra::Vector3::z() * 0.3 * time_s);
    assert!(verdicts(&mut check, turning, |_| 3.3).is_empty());
}

#[test]
fn the_check_can_be_turned_off_and_bad_values_are_named() {
    let new = |parameters: DetectionParameters| {
        ExtrinsicsCheck::new(&parameters, &RigMounts::default(), Counters::default())
    };
    let usual = DetectionParameters::default;
    assert!(
        new(DetectionParameters { extrinsics_check_period_s: 0.0, ..usual() }).unwrap().is_none()
    );
    assert!(new(DetectionParameters { input: CloudInput::Points, ..usual() }).unwrap().is_none());
    for (parameters, name) in [
        (
            DetectionParameters { extrinsics_check_period_s: -1.0, ..usual() },
            "extrinsics_check_period_s",
        ),
        (
            DetectionParameters { extrinsics_check_period_s: f64::NAN, ..usual() },
            "extrinsics_check_period_s",
        ),
        (DetectionParameters { extrinsics_limit_m: 0.0, ..usual() }, "extrinsics_limit_m"),
    ] {
        let Err(error) = new(parameters) else { panic!("{name}") };
        assert!(error.to_string().contains(name), "{error}");
    }
}
