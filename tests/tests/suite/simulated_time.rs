//! A bag three times as fast as it was recorded, over and over, to a node that goes by the bag's clock.

use std::path::{Path, PathBuf};
use std::time::Duration;

use geometry::{Stamp, StampedPose};
use msgs::convert::{self, stamp_from_time};
use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::stillmap_msgs::ReducedCloud;
use nalgebra::Isometry3;
use node_shell::{Node, Qos, RosArguments};
use tokio::time::timeout;

use crate::bags::{bag_of, scan, wall};
use crate::playing::play;
use crate::program::Running;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);

const START: Stamp = Stamp::from_secs_nanos(1000, 0);
const SECONDS: u16 = 6;
/// Scans and clouds a second, and twice as many poses.
const RATE_HZ: u16 = 10;
/// By how much a cloud is later than its scan.
const CLOUD_AFTER_SCAN_S: f64 = 0.01;
/// The first cloud has so many points, and each one more than the last.
const FIRST_POINTS: u16 = 100;
/// For all nodes, and for this one in its namespace.
const PARAMETERS: &str = "/**:
  ros__parameters:
    use_sim_time: true
/**/detection:
  ros__parameters:
    input: points
    extrinsics_check_period_s: 0.0
";
/// Passes of the bag that are looked at.
const PASSES: usize = 3;

fn moment(index: u16, rate_hz: u16) -> Stamp {
    START.plus_seconds(f64::from(index) / f64::from(rate_hz))
}

/// The rig goes one metre a second: its pose tells the time.
fn pose_at(stamp: Stamp) -> StampedPose {
    let x_m = stamp.seconds_since(START);
    let map_from_rig = Isometry3::translation(x_m, 0.0, 0.0);
    StampedPose { stamp, frame_id: "map".to_owned(), map_from_rig }
}

fn moving_bag(folder: &Path) -> PathBuf {
    bag_of(folder, "moving.mcap", |topics| {
        let cycles = || 0..SECONDS * RATE_HZ;
        topics.messages(
            "/pose",
            (0..2 * SECONDS * RATE_HZ).map(|index| {
                let stamp = moment(index, 2 * RATE_HZ);
                (stamp, convert::message_from_pose(&pose_at(stamp)))
            }),
        );
        topics.messages(
            "/scan",
            cycles().map(|index| {
                let stamp = moment(index, RATE_HZ);
                (stamp, scan(stamp, 3.0))
            }),
        );
        topics.messages(
            "/points",
            cycles().map(|index| {
                let stamp = moment(index, RATE_HZ).plus_seconds(CLOUD_AFTER_SCAN_S);
                (stamp, wall(stamp, FIRST_POINTS + index))
            }),
        );
    })
}

/// Cloud, pose and scan of a cycle are of one moment of one pass.
fn assert_is_of_one_moment(cycle: &ReducedCloud) {
    let (scan, cloud) = (stamp_from_time(cycle.scan_stamp), stamp_from_time(cycle.header.stamp));
    let offset_s = cloud.seconds_since(scan);
    assert!((offset_s - CLOUD_AFTER_SCAN_S).abs() < 1e-6, "cloud {offset_s} s after its scan");
    let index = (scan.seconds_since(START) * f64::from(RATE_HZ)).round() as u64;
    assert_eq!(cycle.points_before_reduction, u64::from(FIRST_POINTS) + index, "another cloud");
    let travelled_m = cycle.map_from_rig.position.x;
    let expected_m = cloud.seconds_since(START);
    assert!((travelled_m - expected_m).abs() < 1e-6, "pose of {travelled_m} s at {expected_m} s");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_bag_that_starts_anew_pairs_nothing_of_two_passes() {
    let folder = tempfile::tempdir().unwrap();
    let bag = moving_bag(folder.path());
    let namespace = format!("/simulated_time_{}", std::process::id());
    let rule = format!("__ns:={namespace}");
    let clock_rule = format!("/clock:={namespace}/clock");
    let ear =
        Node::start("ear", &RosArguments::parse(["--ros-args", "-r", &rule]).unwrap()).unwrap();
    let reduced = ear.subscription::<ReducedCloud>("reduced_cloud", &Qos::reliable(200)).unwrap();
    let reports = ear.subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(50)).unwrap();
    let parameters = folder.path().join("parameters.yaml");
    std::fs::write(&parameters, PARAMETERS).unwrap();
    let detection = Running::start([
        "node",
        "detection",
        "--ros-args",
        "-r",
        &rule,
        "-r",
        &clock_rule,
        "-r",
        "detection:scan:=laser/scan",
        "--params-file",
        parameters.to_str().unwrap(),
    ]);
    timeout(PATIENCE, reduced.wait_for_publishers(1)).await.unwrap();
    let topics = [("/scan", "laser/scan"), ("/pose", "pose"), ("/points", "points")];
    let mut arguments = play(&bag, &namespace, &topics);
    arguments.extend(["--clock", "--rate=3", "--loop"].map(str::to_owned));
    arguments.extend(["--ros-args", "-r", &clock_rule].map(str::to_owned));
    let player = Running::start(&arguments);

    // A machine that is out of time loses cycles, of some passes most: one that is whole enough is waited for, after a first one.
    let is_whole = |cycles: &u16| *cycles > SECONDS * RATE_HZ / 2;
    let (mut cycles, mut last) = (vec![0], START);
    let passes = async {
        while cycles.len() <= PASSES || !cycles[1..].iter().any(is_whole) {
            let received = reduced.next().await;
            assert_is_of_one_moment(&received.message);
            let stamp = stamp_from_time(received.message.header.stamp);
            if stamp < last {
                cycles.push(0);
            }
            last = stamp;
            *cycles.last_mut().unwrap() += 1;
        }
    };
    let has_ended = timeout(PATIENCE, passes).await;
    println!("cycles of the passes: {cycles:?} of {}", SECONDS * RATE_HZ);
    assert!(has_ended.is_ok(), "no cycles, or too few in each pass: {cycles:?}");

    // What the node says of itself has the time of the bag.
    let name = format!("{namespace}/detection");
    let latest = async {
        loop {
            let report = reports.next().await.message;
            if report.part(&name).is_some() && report.header.stamp.sec > 0 {
                break stamp_from_time(report.header.stamp);
            }
        }
    };
    let reported = timeout(PATIENCE, latest).await.unwrap().seconds_since(START);
    assert!((0.0..=f64::from(SECONDS) + 1.0).contains(&reported), "{reported}");

    drop(player);
    assert!(detection.interrupt());
    drop((reduced, reports));
    ear.close().await;
}
