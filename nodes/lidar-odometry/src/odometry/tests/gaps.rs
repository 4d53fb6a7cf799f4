//! Scans that are missing.

use super::*;

const SCANS: usize = 46;
/// 2.1 s are missing from one of these scans to the other.
const GAP: [usize; 2] = [19, 40];

/// The poses of a drive with a gap, where wheels know the motion if `wheels`.
fn followed_over_the_gap(drive: &Drive, wheels: bool) -> Vec<(usize, LidarPose)> {
    let mut odometry =
        LidarOdometry::new(LidarOdometryConfig::default(), Arc::new(threads(1))).unwrap();
    let at = |stamp: Stamp| truth(stamp.seconds_since(Stamp::default()));
    let scans = (0..=GAP[0]).chain(GAP[1]..SCANS);
    let poses = scans.map(|number| {
        let scan = drive.scan(number);
        let known = odometry.interval(&scan).filter(|_| wheels);
        let motion = known.map(|(from, to)| at(from).inv_mul(&at(to)));
        (number, odometry.step_with(&scan, &MotionHint { motion, turn: None }).unwrap())
    });
    poses.collect()
}

/// Regression: the motion was predicted for one second, the scan matched the map 8 m short of the truth, and nothing was said.
#[test]
fn the_pose_after_a_gap_is_searched_for_and_the_gap_is_said() {
    let drive = Drive::new(&street(&mut Random::new(1)), SCANS, 12_000);
    let poses = followed_over_the_gap(&drive, false);
    for (number, pose) in &poses {
        let (metres, radians) = off(pose, &poses[0].1);
        assert!(metres < 0.1 && radians < 0.01, "scan {number}: {metres} m, {radians} rad");
        let said = pose.quality.trouble().unwrap_or_default();
        assert_eq!(said.contains("2.1 s without a scan"), *number == GAP[1], "{number}: {said}");
    }
}

#[test]
fn wheels_know_the_motion_in_a_gap() {
    let drive = Drive::new(&street(&mut Random::new(1)), SCANS, 12_000);
    let poses = followed_over_the_gap(&drive, true);
    for (number, pose) in &poses {
        assert!(off(pose, &poses[0].1).0 < 0.1, "scan {number}");
        assert_eq!(pose.quality.unknown_s, 0.0);
    }
}

#[test]
fn a_scanner_that_measures_every_two_seconds_has_no_gaps() {
    let mut random = Random::new(1);
    let scene = street(&mut random);
    let mut odometry =
        LidarOdometry::new(LidarOdometryConfig::default(), Arc::new(threads(1))).unwrap();
    let said = (0..5).map(|number| {
        let points_m = seen(&scene, &truth(0.0), 8_000, 0.02, &mut random);
        let stamp = Stamp::default().plus_seconds(2.0 * f64::from(number));
        let pose = odometry.step(&LidarScan { stamp, points_m: &points_m, times_s: None }).unwrap();
        pose.quality.unknown_s > 0.0
    });
    assert_eq!(said.collect::<Vec<_>>(), [false, true, false, false, false]);
}
