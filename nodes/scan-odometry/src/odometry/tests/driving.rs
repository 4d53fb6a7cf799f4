//! A platform that moves through a room with furniture.

use std::f64::consts::PI;

use proptest::prelude::*;
use simulator::{Platform, Sample, Scenario, SceneName};

use super::*;
use crate::testing::{Post, Random, Scanner, World, follow, legs};
use crate::{ScanOdometry, ScanOdometryConfig};
use geometry::BeamOrder;

const SCANS: usize = 200;
const WAY_M: f64 = 10.0;

fn along(time_s: f64) -> Vec<Post> {
    legs(-3.0 + time_s % 6.0, 1.8, time_s)
}

fn across(time_s: f64) -> Vec<Post> {
    legs(2.2, 2.0 - 0.7 * (time_s % 6.5), time_s)
}

/// Forward and back, with turns to both sides: accelerations of up to 0.5 m/s2 and 0.5 rad/s2.
fn swaying(time_s: f64) -> Isometry2<f64> {
    let turn_rad = 0.5 * (1.0 - time_s.cos());
    Isometry2::new(Vector2::new(0.5 * (1.0 - time_s.cos()), 0.2 * (0.7 * time_s).sin()), turn_rad)
}

#[test]
fn ends_near_where_it_is() {
    let found = follow(&Scanner::default(), &World::furnished(), &circling, SCANS, 1);
    assert_within("circling", end(&found), (0.002 * WAY_M, 0.3));
    assert_within("circling, worst", worst(&found), (0.002 * WAY_M, 0.3));
}

#[test]
fn people_do_not_carry_it_along() {
    let world = World::furnished().with_walker(along).with_walker(across);
    let found = follow(&Scanner::default(), &world, &circling, SCANS, 1);
    assert_within("circling, two people", worst(&found), (0.002 * WAY_M, 0.3));
}

#[test]
fn scanners_of_all_kinds_do() {
    let degrees = |beams: usize, width: f64| {
        let step_rad = width.to_radians() / (beams as f64 - 1.0);
        Scanner { beams, first_rad: -0.5 * width.to_radians(), step_rad, ..Scanner::default() }
    };
    let clockwise =
        Scanner { first_rad: PI, step_rad: -2.0 * PI / 360.0, ..Scanner::full_turn(360) };
    let from_zero = Scanner { first_rad: 0.0, ..Scanner::full_turn(720) };
    for (name, scanner) in [
        ("90 degrees", degrees(180, 90.0)),
        ("180 degrees", degrees(181, 180.0)),
        ("270 degrees", degrees(1081, 270.0)),
        ("full turn of 360", Scanner::full_turn(360)),
        ("full turn of 1440", Scanner::full_turn(1440)),
        ("full turn of 180", Scanner::full_turn(180)),
        ("clockwise", clockwise),
        ("from zero", from_zero),
        ("last to first", Scanner { order: BeamOrder::LastToFirst, ..Scanner::full_turn(400) }),
        ("seven turns a second", Scanner { period_s: 1.0 / 7.0, ..Scanner::full_turn(360) }),
        ("three centimetres of noise", Scanner { noise_m: 0.03, ..Scanner::default() }),
        ("no noise", Scanner { noise_m: 0.0, ..Scanner::default() }),
    ] {
        let found = follow(&scanner, &World::furnished(), &circling, SCANS, 1);
        assert_within(name, end(&found), (0.02 * WAY_M, 1.0));
        let found = follow(&scanner, &World::furnished(), &swaying, SCANS, 2);
        assert_within(&format!("{name}, swaying"), worst(&found), (0.02 * WAY_M, 1.0));
    }
}

#[test]
fn deskewing_pays_when_the_order_of_the_beams_is_known() {
    let world = World::furnished();
    let scanner = Scanner::full_turn(720);
    let error = |used: BeamOrder| {
        let config = ScanOdometryConfig { beam_order: used, ..ScanOdometryConfig::default() };
        let mut odometry = ScanOdometry::new(config).unwrap();
        let (mut random, start) = (Random::new(1), swaying(scanner.middle_s(0)));
        let mut squares = 0.0;
        for scan in 0..SCANS {
            let pose = odometry.step(&scanner.scan(&world, &swaying, scan, &mut random));
            let truth = start.inv_mul(&swaying(scanner.middle_s(scan)));
            squares += truth.inv_mul(&pose.odom_from_lidar).translation.vector.norm_squared();
        }
        (squares / SCANS as f64).sqrt()
    };
    let [right, unknown, wrong] =
        [BeamOrder::FirstToLast, BeamOrder::Unknown, BeamOrder::LastToFirst].map(error);
    println!("{right} {unknown} {wrong}");
    assert!(right < 0.5 * unknown && unknown < wrong, "{right} {unknown} {wrong}");
}

#[test]
fn follows_the_simulated_scanner_of_the_thesis() {
    for scene in [SceneName::B, SceneName::F] {
        let scenario = Scenario::empty(scene, 1)
            .with_platform(Platform::Sway)
            .with_duration_s(20.0)
            .with_depth_size(4, 3);
        let mount = scenario.rig.lidar.rig_from_lidar;
        // The scanner turns clockwise and its driver turns the readings round.
        let config = ScanOdometryConfig {
            beam_order: BeamOrder::LastToFirst,
            ..ScanOdometryConfig::default()
        };
        let mut odometry = ScanOdometry::new(config).unwrap();
        let mut first = None;
        let (mut worst_m, mut worst_deg) = (0.0, 0.0);
        for sample in scenario.samples().unwrap() {
            let Sample::Scan { scan, .. } = sample else { continue };
            let pose = odometry.step(&scan);
            assert!(pose.is_measured(), "{:?}", pose.quality);
            let truth = scenario.map_from_rig(pose.stamp.seconds_since(scenario.start));
            let first = *first.get_or_insert(truth);
            let found = pose.stamped_pose(&mount, "map").unwrap().map_from_rig;
            let error = (first.inverse() * truth).inverse() * found;
            worst_m = f64::max(worst_m, error.translation.vector.norm());
            worst_deg = f64::max(worst_deg, error.rotation.angle().to_degrees());
        }
        assert_within(&format!("scene {scene}"), (worst_m, worst_deg), (0.05, 1.0));
    }
}

#[test]
fn the_same_scans_give_the_same_poses_to_the_bit() {
    let run = || follow(&Scanner::default(), &World::furnished(), &circling, 40, 1);
    for (one, other) in run().iter().zip(run()) {
        assert_eq!(one.pose, other.pose);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// A scanner that is mounted turned sees the world turned: its motion is the same, in its own frame. The map's
    /// grid lies otherwise, and changes nothing.
    #[test]
    fn a_turned_scanner_finds_the_same_motion(mounted_rad in -3.1..3.1_f64, seed in 0..100_u64) {
        let scanner = Scanner::full_turn(360);
        let turned = Scanner { first_rad: scanner.first_rad - mounted_rad, ..scanner.clone() };
        let mount = Isometry2::rotation(mounted_rad);
        let world = World::furnished();
        let straight = follow(&scanner, &world, &circling, 30, seed);
        let on_turned_mount = |time_s: f64| circling(time_s) * mount;
        let askew = follow(&turned, &world, &on_turned_mount, 30, seed);
        for (one, other) in straight.iter().zip(&askew) {
            let back = mount * other.pose.odom_from_lidar * mount.inverse();
            let (shift_m, turn_deg) = shift_and_turn(&one.pose.odom_from_lidar.inv_mul(&back));
            prop_assert!(shift_m < 1e-3 && turn_deg < 0.03, "{} m, {} degrees", shift_m, turn_deg);
        }
    }
}
