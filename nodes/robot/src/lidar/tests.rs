//! Recorded scans through the node to the files of a run.

use std::path::{Path, PathBuf};

use clap::Parser;

use super::*;
use crate::failure::Outcome;
use crate::interrupt::Interrupt;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    lidar: LidarArgs,
    #[command(flatten)]
    road: RoadArgs,
}

fn no_arguments() -> Line {
    Line::parse_from(["run"])
}

/// Recorded data beside the repository, if it is there.
fn shared(path: &str) -> Option<PathBuf> {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(path);
    if !found.exists() {
        eprintln!("skipped: {} is not there", found.display());
    }
    found.exists().then_some(found)
}

#[test]
fn scans_of_kitti_become_a_map_a_trajectory_and_a_report() {
    let Some(scans) = shared("kitti360-50") else { return };
    let folder = tempfile::tempdir().unwrap();
    let line = Line::parse_from(["run", "--road-memory", "20000", "--colour", "height"]);
    let outcome = run_road(
        &scans,
        folder.path(),
        (&line.lidar, &line.road),
        &[],
        true,
        &Interrupt::default(),
    )
    .unwrap();
    assert_eq!(outcome, Outcome::Complete);
    let file = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&file("summary.json")).unwrap();
    assert_eq!(
        (&summary["odometry"]["poses"], &summary["odometry"]["predicted"]),
        (&12.into(), &0.into())
    );
    let path_m = summary["odometry"]["path_m"].as_f64().unwrap();
    assert!((path_m - 11.17).abs() < 0.15, "{path_m}");
    let points = summary["map_points"].as_u64().unwrap();
    assert!(points > 50_000 && summary["map"]["spilled_tiles"].as_u64().unwrap() > 5, "{summary}");
    assert_eq!(geometry::ply::decode(&file("map.ply")).unwrap().len() as u64, points);
    assert_eq!(geometry::pcd::decode(&file("map.pcd")).unwrap().len() as u64, points);
    assert!(file("map.las").starts_with(b"LASF"));
    assert_eq!(String::from_utf8(file("trajectory.txt")).unwrap().lines().count(), 13);
    for name in [
        "drive_from_above.png",
        "whole_drive.png",
        "map_intensity.png",
        "map_height.png",
        "panorama_intensity.png",
        "panorama_range.png",
        "panorama_intensity_pink.png",
        "panorama_range_hsv.png",
    ] {
        let picture = image::load_from_memory(&file(name)).unwrap().into_rgb8();
        let first = *picture.get_pixel(0, 0);
        assert!(picture.pixels().any(|pixel| *pixel != first), "{name} shows nothing");
    }
    let report = String::from_utf8(file("report.html")).unwrap();
    assert!(report.contains("12 of 12 scans have a pose"));
    // RESULTS has every file that a run writes, and no tiles are left.
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(ROAD_RESULTS.contains(&name.as_str()), "{name}");
    }
}

#[test]
fn an_input_that_is_no_lidar_recording_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("cut.pcap"), [0xd4, 0xc3, 0xb2, 0xa1, 2]).unwrap();
    std::fs::write(path("text.mcap"), "no bag").unwrap();
    let line = no_arguments();
    for (name, expected) in [("cut.pcap", "cut.pcap"), ("text.mcap", "bag"), ("none", "none")] {
        let how = (&line.lidar, &line.road);
        let error = run_road(&path(name), &path("out"), how, &[], true, &Interrupt::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains(expected), "{name}: {error}");
    }
    let line = Line::parse_from(["run", "--road-voxel", "0"]);
    let Some(scans) = shared("kitti360-50") else { return };
    let error =
        run_road(&scans, &path("out"), (&line.lidar, &line.road), &[], true, &Interrupt::default())
            .unwrap_err();
    assert!(error.to_string().contains("voxel_edge_m"), "{error}");
}
