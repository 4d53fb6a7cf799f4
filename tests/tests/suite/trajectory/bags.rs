//! Trajectories on the topics of bags.

use std::path::{Path, PathBuf};

use geometry::Stamp;
use msgs::convert::{message_from_pose, time_from_stamp};
use msgs::geometry_msgs::{PoseStamped, PoseWithCovariance, Transform, TransformStamped, Vector3};
use msgs::nav_msgs::Odometry;
use msgs::tf2_msgs::TFMessage;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::{data, score};
use crate::bags::bag_of;
use crate::program::stillmap;

/// The poses of `estimate.tum`.
fn estimate() -> Vec<(Stamp, PoseStamped)> {
    let text = std::fs::read_to_string(data("estimate.tum")).unwrap();
    text.lines()
        .map(|line| {
            let (stamp, rest) = line.split_once(' ').unwrap();
            let (whole, micros) = stamp.split_once('.').unwrap();
            let nanos = micros.parse::<u32>().unwrap() * 1000;
            let stamp = Stamp::from_secs_nanos(whole.parse().unwrap(), nanos);
            let numbers: Vec<f64> = rest.split(' ').map(|number| number.parse().unwrap()).collect();
            let [x, y, z, qx, qy, qz, qw] = numbers.try_into().unwrap();
            let map_from_rig = Isometry3::from_parts(
                Translation3::new(x, y, z),
                UnitQuaternion::from_quaternion(Quaternion::new(qw, qx, qy, qz)),
            );
            let frame_id = "map".to_owned();
            (stamp, message_from_pose(&geometry::StampedPose { stamp, frame_id, map_from_rig }))
        })
        .collect()
}

fn odometry(pose: &PoseStamped) -> Odometry {
    Odometry {
        header: pose.header.clone(),
        pose: PoseWithCovariance { pose: pose.pose, ..Default::default() },
        ..Default::default()
    }
}

fn transform(stamp: Stamp, pose: &PoseStamped, child: &str) -> TransformStamped {
    let at = &pose.pose.position;
    let mut transform = TransformStamped {
        child_frame_id: child.to_owned(),
        transform: Transform {
            translation: Vector3 { x: at.x, y: at.y, z: at.z },
            rotation: pose.pose.orientation,
        },
        ..Default::default()
    };
    transform.header.frame_id = "map".to_owned();
    transform.header.stamp = time_from_stamp(stamp);
    transform
}

/// A bag with the estimate as three kinds of messages.
fn bag(folder: &Path) -> PathBuf {
    let poses = estimate();
    bag_of(folder, "estimate.mcap", |topics| {
        topics.messages("/pose", poses.clone());
        topics.messages("/odom", poses.iter().map(|(stamp, pose)| (*stamp, odometry(pose))));
        topics.messages(
            "/tf",
            poses.iter().map(|(stamp, pose)| {
                let still = (*stamp, PoseStamped::default());
                let transforms = vec![
                    transform(still.0, &still.1, "laser"),
                    transform(*stamp, pose, "base_link"),
                ];
                (*stamp, TFMessage { transforms })
            }),
        );
    })
}

#[test]
fn all_kinds_of_messages_give_the_score_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag(folder.path());
    let of_file = score(&data("estimate.tum"), &data("truth.tum"), &[]);
    for topic in ["/pose", "odom", "/tf:map:base_link"] {
        let of_bag = score(&bag, &data("truth.tum"), &["--est-topic", topic]);
        for of in ["translation_m", "rotation_deg"] {
            for score in ["/absolute", "/relative/0"] {
                let rmse = |json: &serde_json::Value| {
                    json.pointer(&format!("{score}/{of}/rmse"))
                        .and_then(serde_json::Value::as_f64)
                        .unwrap()
                };
                // The bag's quaternions were made unit ones once more.
                assert!((rmse(&of_bag) - rmse(&of_file)).abs() < 1e-9, "{topic} {of}");
            }
        }
        assert_eq!(of_bag["estimate_format"], "bag");
    }
    let itself = score(&bag, &bag, &["--est-topic", "/pose", "--ref-topic", "/odom"]);
    assert!(itself["absolute"]["translation_m"]["max"].as_f64().unwrap() < 1e-9, "{itself}");
}

#[test]
fn the_only_topic_with_poses_needs_no_name() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "one.mcap", |topics| topics.messages("/pose", estimate()));
    assert_eq!(score(&bag, &data("truth.tum"), &[])["association"]["matched"], 95);
}

#[test]
fn a_topic_that_is_not_clear_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag(folder.path());
    for (topic, wanted) in [
        (None, "choose with --est-topic: /odom, /pose"),
        (Some("/tf"), "give --est-topic /tf:PARENT:CHILD"),
        (Some("/tf:map:camera"), "no transform from map to camera on /tf"),
        (Some("/nothing"), "has no topic /nothing"),
    ] {
        let truth = data("truth.tum");
        let mut arguments = vec!["eval", "trajectory", bag.to_str().unwrap()];
        arguments.extend(["--ref", truth.to_str().unwrap()]);
        arguments.extend(topic.into_iter().flat_map(|topic| ["--est-topic", topic]));
        let output = stillmap(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains(wanted), "{wanted}: {stderr}");
    }
}
