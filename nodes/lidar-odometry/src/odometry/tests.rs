//! Drives through scenes whose truth is known.

mod gaps;

use geometry::Stamp;
use nalgebra::{Isometry3, Point3, Vector3};

use super::*;
use crate::registration::{PreparationConfig, RegistrationConfig, RegistrationError};
use crate::testing::{Random, Rectangle, apart, seen, street, threads};

const PERIOD_S: f64 = 0.1;
/// A scan is seen from this many places, one after another.
const PLACES: usize = 20;

/// Along the street and gently from side to side, from -25 m on: 8 m/s from the first moment.
fn truth(time_s: f64) -> Isometry3<f64> {
    let (x_m, swing) = (-25.0 + 8.0 * time_s, 0.5 * time_s);
    Isometry3::new(Vector3::new(x_m, swing.sin(), 0.0), Vector3::new(0.0, 0.0, 0.06 * swing.cos()))
}

struct Drive {
    stamps: Vec<Stamp>,
    points_m: Vec<Vec<Point3<f32>>>,
    times_s: Vec<f32>,
}

impl Drive {
    fn new(scene: &[Rectangle], scans: usize, points: usize) -> Self {
        let mut random = Random::new(77);
        let after_s = |place: usize| PERIOD_S * (place as f64 + 0.5) / PLACES as f64;
        let scan = |scan: usize| {
            let from = |place: usize| truth(PERIOD_S * scan as f64 + after_s(place));
            (0..PLACES)
                .flat_map(|place| seen(scene, &from(place), points / PLACES, 0.02, &mut random))
                .collect()
        };
        let points_m = (0..scans).map(scan).collect();
        let per_place = points / PLACES;
        let times_s =
            (0..PLACES * per_place).map(|point| after_s(point / per_place) as f32).collect();
        let stamps =
            (0..scans).map(|scan| Stamp::default().plus_seconds(PERIOD_S * scan as f64)).collect();
        Self { stamps, points_m, times_s }
    }

    fn scan(&self, number: usize) -> LidarScan<'_> {
        let points_m = &self.points_m[number];
        LidarScan {
            stamp: self.stamps[number],
            points_m,
            times_s: Some(&self.times_s[..points_m.len()]),
        }
    }

    fn followed(&self, config: LidarOdometryConfig, count: usize) -> Vec<LidarPose> {
        let mut odometry = LidarOdometry::new(config, Arc::new(threads(count))).unwrap();
        (0..self.stamps.len()).map(|number| odometry.step(&self.scan(number)).unwrap()).collect()
    }
}

/// Every number of a `Drive` is in the street's frame, and the odometry begins at its own origin.
fn off(pose: &LidarPose, first: &LidarPose) -> (f64, f64) {
    let at = |pose: &LidarPose| truth(pose.stamp.seconds_since(Stamp::default()));
    apart(&pose.odom_from_lidar, &at(first).inv_mul(&at(pose)))
}

#[test]
fn a_drive_that_is_in_motion_from_the_first_scan_is_followed() {
    let drive = Drive::new(&street(&mut Random::new(1)), 30, 16_000);
    let poses = drive.followed(LidarOdometryConfig::default(), 1);
    assert_eq!(poses[0].quality.outcome, Outcome::Started);
    for (number, pose) in poses.iter().enumerate().skip(1) {
        assert_eq!(pose.quality.outcome, Outcome::Matched);
        assert!(pose.quality.degenerate.is_empty() && pose.quality.converged);
        let (metres, radians) = off(pose, &poses[0]);
        assert!(metres < 0.05 && radians < 0.003, "scan {number}: {metres} m, {radians} rad");
        // The middle of the scan.
        assert!((pose.stamp.seconds_since(drive.stamps[number]) - 0.05).abs() < 1e-6);
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let drive = Drive::new(&street(&mut Random::new(2)), 6, 12_000);
    let expected = drive.followed(LidarOdometryConfig::default(), 1);
    for count in [2, 5] {
        assert_eq!(drive.followed(LidarOdometryConfig::default(), count), expected);
    }
}

#[test]
fn what_does_not_fit_is_held_and_then_the_map_begins_anew() {
    let drive = Drive::new(&street(&mut Random::new(3)), 8, 12_000);
    let config = LidarOdometryConfig { max_held_scans: 2, ..Default::default() };
    let mut odometry = LidarOdometry::new(config, Arc::new(threads(1))).unwrap();
    for number in 0..4 {
        odometry.step(&drive.scan(number)).unwrap();
    }
    // Nothing but something far away, where the map is not.
    let far = vec![Point3::new(0.0, 0.0, 90.0); 500];
    let outcomes: Vec<LidarPose> = (4..8)
        .map(|number| {
            let times_s = &drive.times_s[..far.len()];
            odometry
                .step(&LidarScan { points_m: &far, times_s: Some(times_s), ..drive.scan(number) })
                .unwrap()
        })
        .collect();
    assert!(matches!(
        outcomes[0].quality.outcome,
        Outcome::Held(RegistrationError::NoOverlap { .. })
    ));
    assert!(matches!(outcomes[1].quality.outcome, Outcome::Held(_)));
    assert!(matches!(outcomes[2].quality.outcome, Outcome::BegunAnew(_)));
    // It went on as it did: 0.8 m a scan.
    let step_m = outcomes[1].odom_from_lidar.translation.vector
        - outcomes[0].odom_from_lidar.translation.vector;
    assert!((step_m.norm() - 0.8).abs() < 0.05, "{step_m}");
}

/// Regression: one wrong time of thousands moved the stamp of the pose to the end of time, or by half of what it was off.
#[test]
fn a_point_with_a_wrong_time_is_left_out_alone() {
    let drive = Drive::new(&street(&mut Random::new(3)), 3, 12_000);
    for wrong_s in [1e30, 3.0, -0.2] {
        let mut times_s = drive.times_s.to_vec();
        times_s[700] = wrong_s;
        let mut odometry =
            LidarOdometry::new(LidarOdometryConfig::default(), Arc::new(threads(1))).unwrap();
        let mut healthy = odometry.clone();
        for index in 0..3 {
            let scan = LidarScan { times_s: Some(&times_s), ..drive.scan(index) };
            let found = odometry.step(&scan).unwrap();
            let expected = healthy.step(&drive.scan(index)).unwrap();
            assert!(found.stamp.seconds_since(expected.stamp).abs() < 1e-3, "{found:?}");
            let apart = found.odom_from_lidar.inverse() * expected.odom_from_lidar;
            assert!(apart.translation.vector.norm() < 0.01, "{apart}");
        }
    }
}

#[test]
fn scans_of_no_use_are_refused_and_change_nothing() {
    let drive = Drive::new(&street(&mut Random::new(3)), 3, 12_000);
    let mut odometry =
        LidarOdometry::new(LidarOdometryConfig::default(), Arc::new(threads(1))).unwrap();
    odometry.step(&drive.scan(0)).unwrap();
    odometry.step(&drive.scan(1)).unwrap();
    let before = odometry.clone();
    assert!(matches!(odometry.step(&drive.scan(1)), Err(Refusal::NotLater { .. })));
    let stamp = drive.stamps[1].plus_seconds(1e-6);
    let twice = odometry.step(&LidarScan { stamp, ..drive.scan(1) });
    assert!(matches!(twice, Err(Refusal::NotLater { .. })), "{twice:?}");
    let nothing = LidarScan { points_m: &[], times_s: None, ..drive.scan(2) };
    assert_eq!(odometry.step(&nothing), Err(Refusal::NoPoints { points: 0 }));
    let near = [Point3::new(0.5, 0.0, 0.0), Point3::new(f32::NAN, 5.0, 0.0)];
    let near = LidarScan { points_m: &near, times_s: None, ..drive.scan(2) };
    assert_eq!(odometry.step(&near), Err(Refusal::NoPoints { points: 2 }));
    let half = LidarScan { times_s: Some(&drive.times_s[..7]), ..drive.scan(2) };
    assert!(matches!(odometry.step(&half), Err(Refusal::Times { times: 7, .. })));
    // Regression: times in nanoseconds, or of the day, moved the stamp of the pose by years, and no later scan was taken.
    let times_s: Vec<f32> = drive.times_s.iter().map(|time_s| time_s * 1e9).collect();
    let nanoseconds = LidarScan { times_s: Some(&times_s), ..drive.scan(2) };
    let refused = odometry.step(&nanoseconds);
    assert!(matches!(refused, Err(Refusal::FarTimes { points: 12_000, .. })), "{refused:?}");
    let mut before = before;
    assert_eq!(odometry.step(&drive.scan(2)), before.step(&drive.scan(2)));
}

#[test]
fn a_pause_is_bridged_where_the_vehicle_was_static() {
    let drive = Drive::new(&street(&mut Random::new(3)), 4, 12_000);
    let mut odometry =
        LidarOdometry::new(LidarOdometryConfig::default(), Arc::new(threads(1))).unwrap();
    for number in 0..4 {
        odometry.step(&drive.scan(number)).unwrap();
    }
    // An hour later, from nearly the same place.
    let stamp = drive.stamps[3].plus_seconds(3600.0);
    let pose = odometry.step(&LidarScan { stamp, ..drive.scan(3) }).unwrap();
    assert!(pose.odom_from_lidar.translation.vector.norm() < 20.0, "{:?}", pose.odom_from_lidar);
}

#[test]
fn the_map_keeps_its_bound() {
    let drive = Drive::new(&street(&mut Random::new(3)), 10, 12_000);
    let config = LidarOdometryConfig { max_map_voxels: 1000, ..Default::default() };
    let poses = drive.followed(config, 1);
    assert!(poses.iter().all(|pose| pose.quality.map_voxels <= 1000));
    assert!(poses.iter().any(|pose| pose.quality.map_voxels > 900));
    let (metres, _) = off(&poses[9], &poses[0]);
    assert!(metres < 0.1, "{metres}");
}

#[test]
fn the_thesis_method_follows_from_scan_to_scan() {
    let scene = street(&mut Random::new(5));
    let mut random = Random::new(6);
    for guess in [Guess::Standing, Guess::PreviousMotion] {
        let (preparation, registration) =
            (PreparationConfig::default(), RegistrationConfig::default());
        let mut odometry = ScanToScan::new(preparation, registration, guess, Arc::new(threads(1)));
        for scan in 0..8 {
            let at = truth(PERIOD_S * f64::from(scan));
            let points_m = seen(&scene, &at, 16_000, 0.02, &mut random);
            let (pose, registration) = odometry.step(&points_m).unwrap();
            assert_eq!(registration.is_some(), scan > 0);
            let (metres, radians) = apart(&pose, &truth(0.0).inv_mul(&at));
            assert!(metres < 0.03 && radians < 0.002, "scan {scan}: {metres} m, {radians} rad");
        }
    }
}

/// A vehicle that stops at once: only wheels know it before the scan does.
#[test]
fn wheel_odometry_predicts_the_scan_and_deskews_it() {
    let drive = Drive::new(&street(&mut Random::new(1)), 12, 16_000);
    let (mut odometry, mut blind) = (
        LidarOdometry::new(LidarOdometryConfig::default(), Arc::new(threads(1))).unwrap(),
        LidarOdometry::new(LidarOdometryConfig::default(), Arc::new(threads(1))).unwrap(),
    );
    let at = |stamp: Stamp| truth(stamp.seconds_since(Stamp::default()));
    for number in 0..10 {
        let scan = drive.scan(number);
        let motion = odometry.interval(&scan).map(|(from, to)| at(from).inv_mul(&at(to)));
        odometry.step_with(&scan, &MotionHint { motion, turn: None }).unwrap();
        blind.step(&scan).unwrap();
    }
    // Far away from anything: what is left is the prediction.
    let mut lost = drive.points_m[10].clone();
    lost.iter_mut().for_each(|point| point.z += 60.0);
    let scan = LidarScan { points_m: &lost, ..drive.scan(10) };
    let motion = Some(Isometry3::translation(0.1, 0.0, 0.0));
    let before = odometry.clone().local_map().len();
    assert!(before > 0);
    let held = odometry.step_with(&scan, &MotionHint { motion, turn: None }).unwrap();
    let held_blind = blind.step(&scan).unwrap();
    let travelled_m = |pose: &LidarPose| pose.odom_from_lidar.translation.vector.x;
    // It had come 9 steps of 0.8 m.
    assert!((travelled_m(&held) - 7.3).abs() < 0.1, "{}", travelled_m(&held));
    assert!((travelled_m(&held_blind) - 8.0).abs() < 0.1, "{}", travelled_m(&held_blind));
}
