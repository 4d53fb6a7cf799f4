//! Single scans to a road map.

use geometry::{LidarReturn, Revolution};
use lidar_odometry::shell::TimeUnitChoice;
use msgs::convert::message_from_revolution;
use msgs::sensor_msgs::PointCloud2;
use nalgebra::{Point3, Rotation3};

use super::super::findings::without_times;
use super::*;

const COLUMNS: usize = 200;
const ELEVATIONS_RAD: [f32; 8] = [0.3, 0.2, 0.1, 0.05, -0.05, -0.1, -0.2, -0.3];

fn drive(parameters: &LidarOdometryParameters) -> (Drive, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let map = RoadArgs::default().map(parameters).unwrap();
    (Drive::new(parameters, map, folder.path()).unwrap(), folder)
}

/// A turn of `turn_s`, half of whose columns see something at one range, the others at another.
fn scan(stamp: Stamp, turn_s: f32, ranges_m: [f32; 2]) -> PointCloud2 {
    let azimuth_rad = |column: usize| std::f32::consts::TAU * column as f32 / COLUMNS as f32;
    let seen = |elevation_rad: f32, column: usize| {
        let ray = Rotation3::from_euler_angles(0.0, -elevation_rad, azimuth_rad(column));
        let range_m = ranges_m[usize::from(column >= COLUMNS / 2)];
        let time_s = turn_s * column as f32 / COLUMNS as f32;
        Some(LidarReturn {
            position_m: ray * Point3::new(range_m, 0.0, 0.0),
            intensity: 9.0,
            time_s,
        })
    };
    let returns = ELEVATIONS_RAD.iter().flat_map(|row| (0..COLUMNS).map(move |at| seen(*row, at)));
    let revolution = Revolution::new(
        stamp,
        "velodyne".to_owned(),
        ELEVATIONS_RAD.to_vec(),
        (0..COLUMNS).map(azimuth_rad).collect(),
        returns.collect(),
    );
    message_from_revolution(&revolution.unwrap())
}

/// How many points of a scan are in its map.
fn mapped(parameters: &LidarOdometryParameters, ranges_m: [f32; 2]) -> u64 {
    let (mut drive, _folder) = drive(parameters);
    drive.take(Sensed::Cloud(scan(Stamp::from_secs_nanos(7, 0), 0.1, ranges_m))).unwrap();
    drive.map.finish().unwrap();
    drive.map.map().counts().points
}

/// Regression: the map had limits of its own, 2.5 and 60 m: a small room was missing, a vehicle's own points were not.
#[test]
fn the_ranges_of_the_odometry_are_those_of_the_map() {
    let (half, all) = (800, 1600);
    let within = |min_range_m: f64, max_range_m: f64| LidarOdometryParameters {
        min_range_m,
        max_range_m,
        scan_voxel_edge_m: 0.1,
        ..LidarOdometryParameters::default()
    };
    assert_eq!(mapped(&within(0.3, 100.0), [1.6, 5.0]), all);
    assert_eq!(mapped(&within(1.5, 100.0), [1.6, 5.0]), half);
    assert_eq!(mapped(&within(4.1, 100.0), [8.0, 5.0]), half);
    assert_eq!(mapped(&within(0.3, 4.0), [1.6, 5.0]), half);
    // The map's own limit, and what it has without parameters.
    assert_eq!(mapped(&within(0.3, 100.0), [61.0, 5.0]), half);
    assert_eq!(LidarOdometryParameters::default().road_map(), RoadMapConfig::default());
    let beyond = RoadArgs::default().map(&within(70.0, 100.0)).unwrap_err().to_string();
    assert!(beyond.contains("min_range_m"), "{beyond}");
}

/// Regression: the map read the times of points in the unit that makes a revolution of them, whatever `time_unit` said.
#[test]
fn the_times_of_points_have_the_unit_of_the_odometry_in_the_map_too() {
    // A turn in 1 ms: in no unit one that is usual.
    let message = scan(Stamp::from_secs_nanos(7, 0), 0.001, [3.0, 5.0]);
    for (time_unit, turn_s) in [(TimeUnitChoice::S, 1e-3), (TimeUnitChoice::Us, 1e-9)] {
        let parameters = LidarOdometryParameters { time_unit, ..Default::default() };
        let (mut drive, _folder) = drive(&parameters);
        drive.take(Sensed::Cloud(message.clone())).unwrap();
        let times_s = drive.shown.times_s.unwrap();
        let last_s = times_s.into_iter().fold(0.0, f32::max);
        assert!((last_s - turn_s).abs() < 0.01 * turn_s, "{last_s} {turn_s}");
    }
}

/// Regression: two drives of one bag were put upon each other, in a trajectory whose stamps go back.
#[test]
fn a_drive_ends_where_its_stamps_go_back() {
    let (mut drive, _folder) = drive(&LidarOdometryParameters::default());
    let at = |tenths: u32| Stamp::from_secs_nanos(100, 0).plus_seconds(0.1 * f64::from(tenths));
    for stamp in [at(20), at(21), at(22), at(0), at(1), at(2), at(23)] {
        drive.take(Sensed::Cloud(scan(stamp, 0.1, [5.0, 8.0]))).unwrap();
    }
    assert_eq!((drive.trajectory.len(), drive.follower.poses().len()), (3, 3));
    let lost = drive.follower.lost_after_the_end().unwrap();
    assert!(lost.contains("go back by 2.1 s after 3 poses") && lost.contains("3 scans"), "{lost}");
}

/// Regression: the summary had the last trouble alone, of one scan or of all.
#[test]
fn the_summary_counts_the_doubtful_poses() {
    let (mut drive, _folder) = drive(&LidarOdometryParameters::default());
    let mut doubtful_after = |scans: std::ops::Range<u32>, ranges_m: [f32; 2]| {
        for tenths in scans {
            let stamp = Stamp::from_secs_nanos(100, 0).plus_seconds(0.1 * f64::from(tenths));
            drive.take(Sensed::Cloud(scan(stamp, 0.1, ranges_m))).unwrap();
        }
        LidarSummary::of(&drive.follower).doubtful
    };
    let before = doubtful_after(0..4, [5.0, 8.0]);
    // Where the map has nothing.
    assert_eq!(doubtful_after(4..7, [50.0, 55.0]), before + 3);
}

/// Regression: a drive of which half of the scans were dropped was complete.
#[test]
fn many_dropped_scans_are_a_finding() {
    let (mut drive, _folder) = drive(&LidarOdometryParameters::default());
    let mut found_after = |scans: std::ops::Range<u32>, wrong_by_s: f64| {
        for tenths in scans {
            let at_s = 0.1 * f64::from(tenths) + if tenths % 2 == 1 { wrong_by_s } else { 0.0 };
            let stamp = Stamp::from_secs_nanos(100, 0).plus_seconds(at_s);
            drive.take(Sensed::Cloud(scan(stamp, 0.1, [5.0, 8.0]))).unwrap();
        }
        findings(&LidarSummary::of(&drive.follower)).iter().map(ToString::to_string).collect()
    };
    let none: Vec<String> = found_after(0..6, 0.0);
    assert!(none.is_empty(), "{none:?}");
    let found = found_after(6..18, 3600.0);
    assert!(found.len() == 1 && found[0].starts_with("6 scans were dropped, 12 have"), "{found:?}");
}

/// Regression: of clouds without times of points only the node's diagnostics said it; the path of a fast drive was short without a word.
#[test]
fn the_summary_says_what_is_known_of_the_times_of_points() {
    let after = |turn_s: f32| {
        let (mut drive, _folder) = drive(&LidarOdometryParameters::default());
        for tenths in 0..3 {
            let stamp = Stamp::from_secs_nanos(100, 0).plus_seconds(0.1 * f64::from(tenths));
            drive.take(Sensed::Cloud(scan(stamp, turn_s, [5.0, 8.0]))).unwrap();
        }
        drive.take(Sensed::Cloud(PointCloud2::default())).unwrap();
        LidarSummary::of(&drive.follower)
    };
    let (known, none) = (after(0.1), after(0.0));
    assert_eq!((known.without_times, none.without_times), (0, 3));
    assert_eq!(known.point_times.unwrap(), "time is in seconds, from the stamp");
    let said = without_times(&none);
    assert!(said.contains("3 of 3") && said.contains("velodyne_driver"), "{said}");
    assert!(none.point_times.unwrap().contains("the same for all points"));
}

/// Regression: sixths of turns became a path of kilometres, and the exit code was 0.
#[test]
fn clouds_of_sectors_and_many_predictions_are_findings() {
    let found_of = |sectors: u8, moved_m: f32| -> Vec<String> {
        let (mut drive, _folder) = drive(&LidarOdometryParameters::default());
        for number in 0..16_u8 {
            let stamp = Stamp::from_secs_nanos(100, 0).plus_seconds(0.1 * f64::from(number));
            let near_m = 5.0 + moved_m * f32::from(number % 2);
            let mut cloud = scan(stamp, 0.1, [near_m, near_m + 3.0]);
            // Only the points of one sector are finite.
            let (step, width) = (cloud.point_step as usize, COLUMNS / usize::from(sectors));
            for (index, point) in cloud.data.chunks_exact_mut(step).enumerate() {
                if index % COLUMNS / width != usize::from(number % sectors) {
                    point[..4].copy_from_slice(&f32::NAN.to_le_bytes());
                }
            }
            drive.take(Sensed::Cloud(cloud)).unwrap();
        }
        findings(&LidarSummary::of(&drive.follower)).iter().map(ToString::to_string).collect()
    };
    let whole = found_of(1, 0.0);
    assert!(whole.is_empty(), "{whole:?}");
    let halves = found_of(2, 0.0);
    assert!(halves[0].contains("15 of 16 clouds see another sector"), "{halves:?}");
    // A room that is another one at each scan.
    let predicted = found_of(1, 40.0);
    assert!(
        predicted.len() == 1 && predicted[0].contains("poses are predictions"),
        "{predicted:?}"
    );
}
