mod depth_images;
mod robot;

use std::f64::consts::{PI, TAU};

use geometry::{
    CameraModel, DepthImage, DepthPixels, Distortion, Method, OrganisedCloud, PipelineConfig,
    Stamp, UnusablePose, ZoneSource,
};
use nalgebra::{Isometry3, Point3};

use super::*;
use crate::config::{RecHvConfig, RunBound};
use crate::zone_finder::Unmeasured;

const WALL_X_M: f64 = 4.5;
const OBJECT_M: f64 = 2.5;

/// The A1's turn of 360 beams in front of a wall, with an object across `object_deg` in between.
fn scan(object_deg: Option<(f64, f64)>) -> Scan {
    let range_m = |beam: usize| {
        let azimuth_deg = beam as f64 - 180.0;
        let covered = object_deg.is_some_and(|(min, max)| azimuth_deg >= min && azimuth_deg <= max);
        let wall_m = WALL_X_M / azimuth_deg.to_radians().cos();
        if covered {
            OBJECT_M as f32
        } else if wall_m > 0.0 && wall_m < 8.0 {
            wall_m as f32
        } else {
            f32::INFINITY
        }
    };
    Scan {
        stamp: Stamp::from_nanos(1),
        frame_id: "laser".to_owned(),
        angle_min_rad: -PI as f32,
        angle_increment_rad: (TAU / 360.0) as f32,
        range_min_m: 0.15,
        range_max_m: 8.0,
        ranges_m: (0..360).map(range_m).collect(),
        ..Scan::default()
    }
}

fn cloud(points_m: Vec<Point3<f32>>) -> Cloud {
    Cloud { stamp: Stamp::from_nanos(2), frame_id: "camera".to_owned(), points_m }
}

fn step_with(
    detector: &mut Detector,
    scan: &Scan,
    view: View<'_>,
) -> Result<Detected, DetectionError> {
    let map_from_rig = Isometry3::translation(1.0, 2.0, 3.0);
    let input = CycleInput { scan, view, map_from_rig: &map_from_rig, map_frame_id: "map" };
    detector.step(&input, |_| ())
}

fn step(detector: &mut Detector, scan: &Scan) -> Detected {
    step_with(detector, scan, View::PointsInCamera(&cloud(vec![]))).unwrap()
}

/// The published method.
fn rec_hv() -> DetectionConfig {
    let pipeline = PipelineConfig { method: Method::RecHv, ..PipelineConfig::default() };
    DetectionConfig { pipeline, ..DetectionConfig::default() }
}

fn detector() -> Detector {
    Detector::new(rec_hv()).unwrap()
}

/// An object of 15 degrees that goes 3 degrees a cycle to the left, as the thesis' robot does at 2.5 m.
fn object_at(cycle: u32) -> (f64, f64) {
    let right_deg = -30.0 + 3.0 * f64::from(cycle);
    (right_deg, right_deg + 15.0)
}

#[test]
fn the_zone_goes_with_the_object() {
    let of_outer_end = RecHvConfig { run_bound: RunBound::OuterEnd, ..RecHvConfig::default() };
    let outer_end = DetectionConfig { rec_hv: of_outer_end, ..rec_hv() };
    for config in [rec_hv(), outer_end] {
        let run_bound = config.rec_hv.run_bound;
        let mut detector = Detector::new(config).unwrap();
        for cycle in 0..15 {
            let (right_deg, left_deg) = object_at(cycle);
            let detected = step(&mut detector, &scan(Some((right_deg, left_deg))));
            if cycle < 2 {
                assert!(detected.cycle.zones.is_empty());
                assert!(matches!(
                    detected.statistics.unmeasured,
                    Some(Unmeasured::WindowFilling { window_scans: 3, .. })
                ));
                continue;
            }
            let [zone] = detected.cycle.zones[..] else { panic!("{:?}", detected.cycle.zones) };
            assert_eq!((zone.source, detected.statistics.unmeasured), (ZoneSource::Measured, None));
            let middle_deg = 0.5 * (right_deg + left_deg);
            assert!(zone.contains_azimuth(middle_deg.to_radians()), "{cycle}: {zone:?}");
            // The trailing run is the scenery that the object has left: at most two steps behind it.
            assert!(zone.azimuth_min_rad.to_degrees() > right_deg - 6.0 - 1.1);
            assert!(zone.azimuth_max_rad.to_degrees() < left_deg + 1.1);
            // (0, 0, d) and (0, d, d) both deviate by d * sqrt(2) / 3, here with d > 2 m.
            assert!(detected.statistics.max_std_dev_m.unwrap() > 0.94);
            if run_bound == RunBound::OuterEnd {
                assert!(zone.contains_azimuth(right_deg.to_radians()));
                assert!(zone.contains_azimuth(left_deg.to_radians()));
            }
        }
    }
}

/// The mounts of a detector, turned about the rig's z axis.
fn turned(mounts: &RigMounts, aside_deg: f64) -> RigMounts {
    let turn = Isometry3::rotation(aside_deg.to_radians() * Vector3::z());
    RigMounts {
        rig_from_camera: turn * mounts.rig_from_camera,
        rig_from_lidar: turn * mounts.rig_from_lidar,
    }
}

/// Regression: what moved before a camera that looks aside or back had no zone.
#[test]
fn a_camera_that_looks_beside_the_aperture_has_zones_all_around() {
    let config = DetectionConfig::default();
    let ahead = *Detector::new(config.clone()).unwrap().mounts();
    for (aside_deg, beams) in [(20.0, 90), (60.0, 360), (-100.0, 360), (180.0, 360)] {
        let mounts = turned(&ahead, aside_deg);
        let mut by_parameters = config.clone();
        by_parameters.pipeline.rig.rig_from_camera = pose_vector(&mounts.rig_from_camera);
        by_parameters.pipeline.rig.rig_from_lidar = pose_vector(&mounts.rig_from_lidar);
        let mut mounted = Detector::new(config.clone()).unwrap();
        step(&mut mounted, &scan(None));
        mounted.mount(&mounts).unwrap();
        for mut detector in [Detector::new(by_parameters).unwrap(), mounted] {
            let (mut detected, mut object) = (None, None);
            for cycle in 0..20_u32 {
                object = cycle.checked_sub(10).map(object_at);
                let mut scan = scan(object);
                scan.stamp = Stamp::from_nanos(i64::from(cycle) * 143_000_000);
                let cloud = Cloud { stamp: scan.stamp, ..cloud(vec![]) };
                let view = View::PointsInCamera(&cloud);
                detected = Some(step_with(&mut detector, &scan, view).unwrap());
            }
            let (detected, (right_deg, left_deg)) = (detected.unwrap(), object.unwrap());
            assert_eq!(detected.statistics.beams, beams, "{aside_deg}");
            let [zone] = detected.cycle.zones[..] else { panic!("{:?}", detected.cycle.zones) };
            let middle_rad = (aside_deg + 0.5 * (right_deg + left_deg)).to_radians();
            let middle_rad = if middle_rad > PI { middle_rad - TAU } else { middle_rad };
            assert!(zone.contains_azimuth(middle_rad), "{aside_deg}: {zone:?}");
        }
    }
}

/// A joint moves it there and back: the window of scans goes on.
#[test]
fn a_camera_that_turns_aside_keeps_what_was_seen() {
    let mut detector = Detector::new(DetectionConfig::default()).unwrap();
    let ahead = *detector.mounts();
    for aside_deg in [0.0, 20.0, 30.0, 20.0, 30.0] {
        let camera = turned(&ahead, aside_deg).rig_from_camera;
        detector.follow_mounts(&RigMounts { rig_from_camera: camera, ..ahead }).unwrap();
        let statistics = step(&mut detector, &scan(None)).statistics;
        assert_eq!(statistics.beams, if aside_deg > 25.0 { 360 } else { 90 });
        assert!(!statistics.window_restarted);
    }
}

#[test]
fn a_still_scene_has_no_zone() {
    let mut detector = detector();
    for cycle in 0..5 {
        let detected = step(&mut detector, &scan(Some((-5.0, 5.0))));
        assert_eq!((detected.cycle.index, detected.cycle.zones.len()), (cycle, 0));
        assert_eq!((detected.statistics.beams, detected.statistics.filled_beams), (90, 0));
        if cycle >= 2 {
            assert!(matches!(detected.statistics.unmeasured, Some(Unmeasured::Quiet { .. })));
        }
    }
}

#[test]
fn a_scan_without_returns_makes_a_cycle_and_says_why_it_has_no_zone() {
    let mut detector = detector();
    for (ranges_m, returns) in [(f32::NAN, 0), (f32::INFINITY, 0), (f32::NEG_INFINITY, 0)] {
        let mut blind = scan(None);
        blind.ranges_m.fill(ranges_m);
        let detected = step(&mut detector, &blind);
        assert!(detected.cycle.zones.is_empty());
        assert_eq!(detected.statistics.unmeasured, Some(Unmeasured::TooFewReturns { returns }));
    }
    let mut one_eyed = scan(None);
    one_eyed.ranges_m.fill(0.0);
    one_eyed.ranges_m[180] = 3.0;
    let why = step(&mut detector, &one_eyed).statistics.unmeasured;
    assert_eq!(why, Some(Unmeasured::TooFewReturns { returns: 1 }));
}

#[test]
fn a_blind_scan_holds_the_zone_and_stays_out_of_the_window() {
    let mut detector = detector();
    for cycle in 0..3 {
        step(&mut detector, &scan(Some(object_at(cycle))));
    }
    let mut blind = scan(None);
    blind.ranges_m.fill(f32::INFINITY);
    let held = step(&mut detector, &blind);
    assert_eq!(held.cycle.zones.len(), 1);
    assert_eq!(held.cycle.zones[0].source, ZoneSource::Held { cycles: 1 });
    let measured = step(&mut detector, &scan(Some(object_at(3))));
    assert_eq!(measured.cycle.zones[0].source, ZoneSource::Measured);
}

#[test]
fn another_geometry_of_the_scan_starts_the_window_anew() {
    let mut detector = detector();
    for _ in 0..3 {
        assert!(!step(&mut detector, &scan(None)).statistics.window_restarted);
    }
    let mut turned = scan(None);
    turned.angle_min_rad += 0.001;
    let first = step(&mut detector, &turned).statistics;
    assert!(first.window_restarted);
    assert_eq!(first.unmeasured, Some(Unmeasured::WindowFilling { scans: 1, window_scans: 3 }));
    assert!(!step(&mut detector, &turned).statistics.window_restarted);
}

#[test]
fn forgetting_keeps_the_count() {
    let mut detector = detector();
    for cycle in 0..3 {
        step(&mut detector, &scan(Some(object_at(cycle))));
    }
    detector.forget();
    let detected = step(&mut detector, &scan(Some(object_at(3))));
    assert_eq!((detected.cycle.index, detected.cycle.zones.len()), (3, 0));
    assert!(!detected.statistics.window_restarted);
}

#[test]
fn gaps_are_filled_and_counted() {
    let mut detector = detector();
    let mut gappy = scan(None);
    for beam in [135, 136, 170, 171, 172, 224] {
        gappy.ranges_m[beam] = f32::INFINITY;
    }
    // Beam 10 points backwards and is none of ours.
    gappy.ranges_m[10] = f32::INFINITY;
    assert_eq!(step(&mut detector, &gappy).statistics.filled_beams, 6);
}

#[test]
fn clouds_are_reduced_in_the_rig_frame() {
    // Two points of one voxel and one of another, 2 m ahead and a little to the left and above.
    let in_rig = [
        Point3::new(2.01, 0.33, 0.09),
        Point3::new(2.03, 0.35, 0.11),
        Point3::new(3.01, 0.33, 0.09),
    ];
    let expected = [Point3::new(2.02, 0.34, 0.10), Point3::new(3.01, 0.33, 0.09)];
    // The optical frame: x right, y down, z forward.
    let in_camera = in_rig.iter().map(|p| Point3::new(-p.y, -p.z, p.x)).collect();
    let in_camera = cloud(in_camera);
    let organised = organised(3, &in_camera.points_m);
    for view in [View::OrganisedPoints(&organised), View::PointsInCamera(&in_camera)] {
        let cycle = step_with(&mut detector(), &scan(None), view).unwrap().cycle;
        assert_eq!(
            (&*cycle.reduced_cloud.frame_id, cycle.reduced_cloud.stamp),
            ("rig", Stamp::from_nanos(2))
        );
        assert_eq!((cycle.points_before_reduction, cycle.reduced_cloud.points_m.len()), (3, 2));
        for (got, expected) in cycle.reduced_cloud.points_m.iter().zip(expected) {
            assert!((got - expected).norm() < 1e-5, "{got} is not {expected}");
        }
        assert_eq!((cycle.scan_stamp, &*cycle.map_frame_id), (Stamp::from_nanos(1), "map"));
        assert_eq!(cycle.map_from_rig, Isometry3::translation(1.0, 2.0, 3.0));
    }
}

fn organised(width_px: usize, points_m: &[Point3<f32>]) -> OrganisedCloud {
    OrganisedCloud::from_rows(Stamp::from_nanos(2), "camera".to_owned(), width_px, points_m)
}

/// A camera of 4 x 2 pixels whose rays are easily told.
const CAMERA: CameraModel = CameraModel {
    width_px: 4,
    height_px: 2,
    fx_px: 2.0,
    fy_px: 2.0,
    cx_px: 1.0,
    cy_px: 0.0,
    distortion: Distortion::None,
};

fn depth_image(size_px: (usize, usize), depths_mm: Vec<u16>) -> DepthImage {
    let stamp = Stamp::from_nanos(2);
    DepthImage::new(stamp, "camera".to_owned(), size_px, DepthPixels::Millimetres(depths_mm))
        .unwrap()
}

#[test]
fn depth_images_are_reduced_in_the_rig_frame() {
    let mut detector = detector();
    let projector = detector.depth_projector(RayTable::new(&CAMERA).unwrap());
    let image = Arc::new(depth_image((4, 2), vec![0, 2000, 0, 0, 0, 0, 0, 3000]));
    let view = View::Depth(projector.image(&image).unwrap());
    let cycle = step_with(&mut detector, &scan(None), view).unwrap().cycle;
    // Pixel (1, 0) looks straight ahead; (3, 1) by (2 / 2, 1 / 2) of its depth to the right and down.
    let expected = [Point3::new(2.0, 0.0, 0.0), Point3::new(3.0, -3.0, -1.5)];
    assert_eq!((cycle.points_before_reduction, cycle.reduced_cloud.points_m.len()), (2, 2));
    for (got, expected) in cycle.reduced_cloud.points_m.iter().zip(expected) {
        assert!((got - expected).norm() < 1e-5, "{got} is not {expected}");
    }
    assert_eq!(cycle.reduced_cloud.frame_id, "rig");
}

#[test]
fn what_means_nothing_is_told_and_takes_no_number() {
    let mut detector = detector();
    let nothing = cloud(vec![]);
    let no_pose = Isometry3::translation(f64::NAN, 0.0, 0.0);
    let still = scan(None);
    let input = CycleInput {
        scan: &still,
        view: View::PointsInCamera(&nothing),
        map_from_rig: &no_pose,
        map_frame_id: "map",
    };
    assert_eq!(detector.step(&input, |_| ()), Err(DetectionError::Pose(UnusablePose::NotFinite)));

    // Regression: of degrees for radians, and of limits that were left at 0, nothing was said, and no object was found.
    for aimless in [
        Scan { angle_increment_rad: 0.0, ..scan(None) },
        Scan { angle_increment_rad: 1.0, ..scan(None) },
        Scan { range_min_m: 0.0, range_max_m: 0.0, ..scan(None) },
        Scan { ranges_m: vec![], ..scan(None) },
    ] {
        let error = step_with(&mut detector, &aimless, View::PointsInCamera(&nothing)).unwrap_err();
        assert!(matches!(error, DetectionError::Scan(_)));
    }

    assert_eq!(step(&mut detector, &still).cycle.index, 0);
}

#[test]
fn the_stages_are_told_in_their_order() {
    let mut steps = Vec::new();
    let (still, nothing, map_from_rig) = (scan(None), cloud(vec![]), Isometry3::identity());
    let input = CycleInput {
        scan: &still,
        view: View::PointsInCamera(&nothing),
        map_from_rig: &map_from_rig,
        map_frame_id: "map",
    };
    detector().step(&input, |step| steps.push(step.name())).unwrap();
    assert_eq!(steps, ["gap_fill", "variability", "zone_search", "reduction"]);
}
