use geometry::{PathVertex, Track};
use nalgebra::{Isometry3, Matrix6, Point3, Vector3};
use report::Transport;

use super::*;

fn at(seconds: f64) -> Stamp {
    Stamp::default().plus_seconds(seconds)
}

fn detected(index: u32, x_m: f64) -> DetectedCycle {
    let stamp = at(f64::from(index));
    DetectedCycle {
        depth: None,
        scan_rays: std::sync::Arc::default(),
        index,
        scan_stamp: stamp,
        reduced_cloud: Cloud { stamp, frame_id: "rig".to_owned(), points_m: Vec::new() },
        voxel_points: Vec::new(),
        points_before_reduction: 0,
        map_from_rig: Isometry3::translation(x_m, 0.0, 0.0),
        map_from_continuous: None,
        map_frame_id: "map".to_owned(),
        setup: geometry::CycleSetup::default(),
        zones: Vec::new(),
        moving_beams: Vec::new(),
    }
}

fn track(id: u32, x_m: f64) -> Track {
    Track {
        id,
        position_m: Point3::new(x_m, 1.0, 0.0),
        velocity_m_per_s: Vector3::zeros(),
        extent_m: Vector3::zeros(),
        covariance: Matrix6::identity(),
        age_s: 0.0,
        unseen_cycles: 0,
    }
}

fn tracks(index: u32, tracks: Vec<Track>) -> CycleTracks {
    let stamp = at(f64::from(index));
    CycleTracks { index, stamp, map_frame_id: "map".to_owned(), tracks }
}

/// The messages of the other stages about a cycle, without its tracks.
fn report_other_stages(recorder: &mut Recorder, index: u32) {
    let stamp = at(f64::from(index));
    let cloud = Cloud { stamp, frame_id: "rig".to_owned(), points_m: Vec::new() };
    recorder.dynamic_cloud(Arc::new(cloud));
    recorder.counts(index, SegmentationCounts::default());
    recorder.reconstructed(stamp, 0, []);
}

fn finish(recorder: Recorder) -> RunRecord {
    let name = RunName {
        bag_name: "room.mcap".to_owned(),
        transport: Transport::Local,
        map_frame_id: "map".to_owned(),
    };
    recorder.finish(MapFile::default(), name)
}

fn recorder() -> Recorder {
    Recorder::new(&ReconstructionConfig::default()).unwrap()
}

#[test]
fn tracks_are_assigned_to_their_cycle_in_any_order() {
    let mut recorder = recorder();
    // Segmentation's message may be received before detection's.
    recorder.tracks(&tracks(0, vec![track(4, 2.0)]));
    recorder.detected(&detected(0, 0.0));
    recorder.detected(&detected(1, 0.0));
    report_other_stages(&mut recorder, 0);
    report_other_stages(&mut recorder, 1);
    assert_eq!(recorder.incomplete_cycles(), 1, "the second has no tracks yet");
    recorder.tracks(&tracks(1, vec![]));
    assert_eq!(recorder.incomplete_cycles(), 0);
    let record = finish(recorder);
    let tracks: Vec<_> = record.cycles.iter().map(|cycle| cycle.tracks_m.len()).collect();
    assert_eq!(tracks, [1, 0]);
    assert_eq!(record.cycles[0].tracks_m[&4], Point3::new(2.0, 1.0, 0.0));
}

#[test]
fn tracks_follow_a_correction_of_the_trajectory() {
    let mut recorder = recorder();
    recorder.detected(&detected(0, 1.0));
    recorder.tracks(&tracks(0, vec![track(4, 3.0)]));
    report_other_stages(&mut recorder, 0);
    for (since_s, x_m) in [(1.0, 1.0), (2.0, 0.5)] {
        let vertex = |seconds| PathVertex {
            stamp: at(seconds),
            map_from_rig: Isometry3::translation(x_m, 0.0, 0.0),
        };
        let vertices = vec![vertex(0.0), vertex(2.0)];
        recorder.path(MapPath::new(at(since_s), "map", vertices).unwrap());
    }
    let record = finish(recorder);
    // 2 m ahead of the rig, as it was seen.
    assert!((record.cycles[0].map_from_rig.translation.x - 0.5).abs() < 1e-9);
    assert!((record.cycles[0].tracks_m[&4].x - 2.5).abs() < 1e-9);
}

#[test]
fn a_scan_is_assigned_to_its_cycle_in_any_order() {
    let scan = |seconds, range_m| Scan {
        stamp: at(seconds),
        range_max_m: 10.0,
        ranges_m: vec![range_m],
        ..Scan::default()
    };
    let mut recorder = recorder();
    recorder.scan(&scan(0.0, 1.0));
    recorder.detected(&detected(0, 0.0));
    recorder.detected(&detected(1, 0.0));
    recorder.scan(&scan(1.0, 2.0));
    recorder.scan(&scan(9.0, 3.0));
    for index in [0, 1] {
        report_other_stages(&mut recorder, index);
        recorder.tracks(&tracks(index, vec![]));
    }
    let record = finish(recorder);
    let ranges = record.cycles.iter().map(|cycle| {
        cycle.view.as_ref().and_then(|view| view.scan.as_ref()).map(|scan| scan.ranges.clone())
    });
    assert_eq!(ranges.collect::<Vec<_>>(), [Some(vec![500]), Some(vec![1000])]);
}

#[test]
fn a_long_run_keeps_a_bounded_number_of_views_spread_over_all_of_it() {
    let mut recorder = recorder();
    for index in 0..1500 {
        recorder.detected(&detected(index, 0.0));
        report_other_stages(&mut recorder, index);
        recorder.tracks(&tracks(index, vec![]));
    }
    let record = finish(recorder);
    let viewed: Vec<u32> = record
        .cycles
        .iter()
        .filter(|cycle| cycle.view.is_some())
        .map(|cycle| cycle.index)
        .collect();
    assert_eq!((record.cycles.len(), viewed.len()), (1500, 375));
    assert_eq!(viewed[..3], [0, 4, 8]);
}
