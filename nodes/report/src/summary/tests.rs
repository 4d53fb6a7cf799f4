use geometry::{DynamicZone, SegmentationCounts};
use nalgebra::Point3;

use super::*;
use crate::DropCount;
use crate::run_record::tests::{cycle, run};

fn zone(source: ZoneSource) -> DynamicZone {
    DynamicZone {
        azimuth_min_rad: -0.1,
        azimuth_max_rad: 0.1,
        peak_std_dev_m: 0.5,
        source,
        returns: None,
    }
}

fn counted(
    index: u32,
    zones: Vec<DynamicZone>,
    (reduced, in_zone, dynamic): (usize, usize, usize),
    map_points: usize,
) -> CycleRecord {
    let counts = SegmentationCounts { reduced, in_zone, dynamic };
    let step_durations_s = vec![("step".to_owned(), 0.001)];
    CycleRecord { zones, counts, map_points, points_in: 1000, step_durations_s, ..cycle(index) }
}

fn example() -> RunRecord {
    let (measured, held) = (zone(ZoneSource::Measured), zone(ZoneSource::Held { cycles: 2 }));
    let mut run = run(vec![
        counted(0, vec![], (100, 0, 0), 100),
        counted(1, vec![measured, held], (100, 40, 10), 130),
        counted(2, vec![held], (50, 20, 5), 125),
        counted(3, vec![measured, measured], (50, 30, 15), 145),
    ]);
    run.static_map = vec![Point3::new(0.05, 0.05, 0.05), Point3::new(1.0, 0.0, 0.0)];
    run.unfiltered_map = vec![Point3::new(0.01, 0.02, 0.03), Point3::new(5.0, 0.0, 0.0)];
    run
}

#[test]
fn cycles_points_and_shares_are_those_counted_by_hand() {
    let summary = Summary::of_run(&example(), None, true).unwrap();
    assert_eq!(
        summary.cycles,
        CycleCounts {
            total: 4,
            with_measured_zone: 2,
            with_held_zone_only: 1,
            without_zone: 1,
            detections: 3
        }
    );
    let statistics = |median, min, max| Some(PointStatistics { median, min, max });
    assert_eq!(summary.points.before_reduction, statistics(1000.0, 1000, 1000));
    assert_eq!(summary.points.reduced, statistics(75.0, 50, 100));
    assert_eq!(summary.points.in_zone, statistics(25.0, 0, 40));
    assert_eq!(summary.points.dynamic, statistics(7.5, 0, 15));
    // 100, then 30, -5, 20.
    assert_eq!(summary.points.map_growth, statistics(25.0, -5, 100));
    // Over the three cycles with a zone: 90 and 30 of 200.
    assert_eq!(summary.zone_shares.in_zone, Some(0.45));
    assert_eq!(summary.zone_shares.dynamic, Some(0.15));
    // The first points of the maps share a voxel; the one at 5 m only the unfiltered map has.
    assert_eq!((summary.map.voxels_kept_out, summary.kept_out.len()), (1, 1));
    assert_eq!(summary.map.kept_out, KeptOutCounts { seen_once: 1, ..KeptOutCounts::default() });
    assert!((summary.duration_s - 0.3).abs() < 1e-9);
}

#[test]
fn drops_are_merged_and_sorted_whatever_their_order() {
    let drop = |place: &str, reason: &str, count| DropCount {
        topic_or_stage: place.to_owned(),
        reason: reason.to_owned(),
        count,
    };
    let mut one = example();
    one.drops = vec![
        drop("scan", "no pose", 2),
        drop("pose", "late", 0),
        drop("depth", "no scan", 1),
        drop("scan", "no pose", 3),
    ];
    let mut other = one.clone();
    other.drops.reverse();
    let summary = Summary::of_run(&one, None, false).unwrap();
    let drops: Vec<_> =
        summary.drops.iter().map(|d| (d.topic_or_stage.as_str(), d.count)).collect();
    assert_eq!(drops, [("depth", 1), ("scan", 5)]);
    assert_eq!(summary.dropped(), 6);
    assert_eq!(summary, Summary::of_run(&other, None, false).unwrap());
}

#[test]
fn without_timing_the_bytes_do_not_depend_on_the_durations() {
    let fast = example();
    let mut slow = example();
    for cycle in &mut slow.cycles {
        cycle.step_durations_s = vec![("step".to_owned(), 0.5)];
    }
    let json =
        |run: &RunRecord, timing| Summary::of_run(run, None, timing).unwrap().to_json().unwrap();
    assert_eq!(json(&fast, false), json(&slow, false));
    assert!(!json(&fast, false).contains("timing"));
    assert_ne!(json(&fast, true), json(&slow, true));
}

#[test]
fn keys_come_in_the_order_of_the_fields_and_the_text_reads_back() {
    let summary = Summary::of_run(&example(), None, true).unwrap();
    let json = summary.to_json().unwrap();
    let keys: Vec<_> =
        json.lines().filter_map(|line| line.strip_prefix("  \"")?.split('"').next()).collect();
    assert_eq!(
        keys,
        [
            "bag",
            "transport",
            "method",
            "voxel_edge_m",
            "duration_s",
            "cycles",
            "points",
            "zone_shares",
            "map",
            "drops",
            "truth",
            "timing"
        ]
    );
    // The voxels themselves are not in the file.
    let read: Summary = serde_json::from_str(&json).unwrap();
    assert_eq!(read, Summary { kept_out: Vec::new(), ..summary });
}

#[test]
fn an_empty_run_has_a_summary_too() {
    let summary = Summary::of_run(&run(vec![]), None, true).unwrap();
    assert_eq!(summary.cycles, CycleCounts::default());
    assert_eq!((summary.points.reduced, summary.timing.clone()), (None, None));
    assert_eq!(summary.zone_shares, ZoneShares::default());
    assert!(summary.to_json().unwrap().ends_with("}\n"));
}
