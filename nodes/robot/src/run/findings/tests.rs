use std::sync::Arc;

use geometry::{Cloud, CycleTracks, DetectedCycle, Scan, SegmentationCounts, Stamp};
use msgs::sensor_msgs::CameraInfo;
use nalgebra::Isometry3;
use reconstruction::ReconstructionConfig;
use report::Transport;

use super::*;
use crate::map_file::MapFile;
use crate::run::pose_topics::{PoseSource, PoseTopicKind};
use crate::run::recorder::{Recorder, RunName};

/// Up to half of a recording could be missing from the map without a word.
#[test]
fn more_than_a_tenth_without_a_cycle_are_many() {
    for (dropped, cycles, are) in [
        (0, 0, false),
        (5, 3, false),
        (6, 3, true),
        (20, 36, true),
        (10, 100, false),
        (12, 100, true),
    ] {
        assert_eq!(are_many(dropped, cycles), are, "{dropped} {cycles}");
    }
}

/// Regression: for two empty images of 200, in a hall full of people, the exit code was 3.
#[test]
fn few_doubtful_cycles_of_many_are_sound() {
    for (count, cycles, are) in [
        (0, 0, false),
        (2, 200, false),
        (5, 8, false),
        (21, 200, true),
        (3, 3, true),
        (10, 10, true),
    ] {
        assert_eq!(are_many_of(count, cycles), are, "{count} of {cycles}");
    }
}

/// Regression: with poses of the camera's optical frame, inverted or frozen ones, 31 to 67 % of what stands still was removed, without
/// a word and with exit code 0.
#[test]
fn more_removed_than_moves_is_said_with_what_to_check() {
    assert_eq!(said_of(100, 18, |_| {}), Vec::<String>::new(), "a hall full of people");
    assert_eq!(said_by(Method::RecHv, 100, 38, |_| {}), Vec::<String>::new(), "the platform moves");
    let said = said_of(100, 38, |_| {});
    assert_eq!(said.len(), 1, "{said:?}");
    for wanted in ["38 % of all points", "/pose", "optical", "inverted", "stamps"] {
        assert!(said[0].contains(wanted), "{wanted}: {said:?}");
    }
}

/// Regression: of scans in millimetres none shows what moves; `run` and `filter` said nothing.
#[test]
fn scans_in_millimetres_are_said() {
    let of_scans = |range_m: f32| {
        said_of(100, 0, |recorder| {
            recorder.scan(&Scan {
                range_max_m: 12_000.0,
                ranges_m: vec![range_m, f32::INFINITY, range_m],
                ..Scan::default()
            });
        })
    };
    assert_eq!(of_scans(8.0), Vec::<String>::new());
    let said = of_scans(2328.0);
    assert!(said.len() == 1 && said[0].contains("1 scans on /scan"), "{said:?}");
    assert!(said[0].contains("divide by 1000"), "{said:?}");
}

/// Regression: the map was torn where the poses jumped, and only `doctor` said so.
#[test]
fn jumps_of_the_poses_are_said() {
    let said = said_of(100, 0, Recorder::pose_jump);
    assert!(
        said.len() == 1 && said[0].contains("/pose: the poses jump before 1 of 1 cycles"),
        "{said:?}"
    );
}

/// Regression: with the calibration of another resolution 10 to 21 % of what stands still was removed, and only `doctor` said so.
#[test]
fn a_calibration_of_another_resolution_is_said() {
    let of_centre = |cx_px: f64, cy_px: f64| {
        said_of(100, 0, |recorder| {
            recorder.calibration(&CameraInfo {
                width: 160,
                height: 120,
                k: [140.0, 0.0, cx_px, 0.0, 140.0, cy_px, 0.0, 0.0, 1.0],
                ..CameraInfo::default()
            });
        })
    };
    assert_eq!(of_centre(79.5, 59.5), Vec::<String>::new());
    for (cx_px, cy_px, wanted) in
        [(159.5, 119.5, "2.0 times as many columns"), (319.5, 239.5, "lies outside the image")]
    {
        let said = of_centre(cx_px, cy_px);
        assert_eq!(said.len(), 1, "{said:?}");
        for part in ["/depth/camera_info: ", wanted] {
            assert!(said[0].contains(part), "{said:?}");
        }
    }
}

/// Regression: of a camera whose calibration came 3 s late, 58 images were counted as scans without a cycle, and the exit code was 3.
#[test]
fn images_without_a_calibration_are_no_scans() {
    let said = |cause: &str| said_of(100, 0, |recorder| recorder.unusable(cause, 58));
    assert_eq!(said(IMAGE_WITHOUT_CALIBRATION), Vec::<String>::new());
}

/// What is said of a cycle of so many points, some of which were removed.
fn said_of(points: usize, removed: usize, also: impl Fn(&mut Recorder)) -> Vec<String> {
    said_by(Method::FreeSpace, points, removed, also)
}

fn said_by(
    method: Method,
    points: usize,
    removed: usize,
    also: impl Fn(&mut Recorder),
) -> Vec<String> {
    let mut map = ReconstructionConfig::default();
    map.pipeline.method = method;
    let mut recorder = Recorder::new(&map).unwrap();
    let stamp = Stamp::default();
    let cloud = || Cloud { stamp, frame_id: "rig".to_owned(), points_m: Vec::new() };
    recorder.detected(&DetectedCycle {
        depth: None,
        scan_rays: Arc::default(),
        index: 0,
        scan_stamp: stamp,
        reduced_cloud: cloud(),
        voxel_points: Vec::new(),
        points_before_reduction: points,
        map_from_rig: Isometry3::identity(),
        map_from_continuous: None,
        map_frame_id: "map".to_owned(),
        setup: geometry::CycleSetup::default(),
        zones: Vec::new(),
        moving_beams: Vec::new(),
    });
    recorder.dynamic_cloud(Arc::new(cloud()));
    recorder.counts(0, SegmentationCounts { reduced: points, in_zone: removed, dynamic: removed });
    let tracks = Vec::new();
    recorder.tracks(&CycleTracks { index: 0, stamp, map_frame_id: "map".to_owned(), tracks });
    recorder.reconstructed(stamp, 0, []);
    also(&mut recorder);
    let doubtful = recorder.doubtful();
    let name = RunName {
        bag_name: "room.mcap".to_owned(),
        transport: Transport::Local,
        map_frame_id: "map".to_owned(),
    };
    let record = recorder.finish(MapFile::default(), name);
    let pose = PoseSource::Topic { topic: "/pose".to_owned(), kind: PoseTopicKind::Pose };
    let inputs = Inputs {
        scan: "/scan".to_owned(),
        view: ViewTopics::Depth {
            image: "/depth/image".to_owned(),
            camera_info: "/depth/camera_info".to_owned(),
        },
        pose,
        colour: None,
        labels: None,
        transforms: Vec::new(),
    };
    let losses =
        InputLosses { bag: Vec::new(), doubtful, lost: Vec::new(), bounds_reached: Vec::new() };
    findings(&losses, &record, &inputs).iter().map(ToString::to_string).collect()
}
