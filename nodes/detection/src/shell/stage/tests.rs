use geometry::{RigMounts, pose_from_vector};
use node_shell::{Host, RosArguments};

use super::*;

/// Regression: the check that began anew with a changed parameter had the parameters' mounts in place of those of tf.
#[tokio::test]
async fn a_check_that_begins_anew_keeps_the_mounts_of_tf() {
    let arguments = RosArguments::parse([""; 0]).unwrap();
    let node = Host::in_process().node("detection", &arguments).unwrap();
    let usual = DetectionParameters::default;
    let mut stage = Stage::new(&node, &usual()).unwrap();
    let of_tf = RigMounts {
        rig_from_lidar: pose_from_vector(&[0.0, 0.25, -0.05, 0.0, 0.0, 0.0]),
        ..RigMounts::default()
    };
    stage.detector.mount(&of_tf).unwrap();
    stage.change(&DetectionParameters { extrinsics_limit_m: 0.031, ..usual() }).unwrap();
    assert_eq!(stage.extrinsics.as_ref().map(|check| check.mounts), Some(of_tf));
    drop(stage);
    node.close().await;
}

/// Regression: the scans of a second scanner on the topic were taken as those of the first, and nothing said so.
#[tokio::test]
async fn scans_of_a_second_scanner_on_the_topic_are_dropped_and_counted() {
    let host = Host::in_process();
    let arguments = RosArguments::parse([""; 0]).unwrap();
    let node = host.node("detection", &arguments).unwrap();
    let drivers = host.node("drivers", &arguments).unwrap();
    let mut stage = Stage::new(&node, &DetectionParameters::default()).unwrap();
    let qos = node_shell::Qos::sensor(10);
    let scans = drivers.publisher::<msgs::sensor_msgs::LaserScan>("scan", &qos).unwrap();
    for tenth in 0..4 {
        for frame_id in ["front", "rear"] {
            let scan = Scan {
                stamp: Stamp::from_nanos(100_000_000 * tenth),
                frame_id: frame_id.to_owned(),
                angle_increment_rad: 0.1,
                range_max_m: 8.0,
                ranges_m: vec![2.0; 21],
                ..Scan::default()
            };
            scans.publish(convert::message_from_scan(&scan)).unwrap();
        }
        stage.take_waiting();
    }
    assert_eq!(node.counters().drops().get(ANOTHER_SCANNER), Some(&4));
    drop((stage, scans));
    drivers.close().await;
    node.close().await;
}
