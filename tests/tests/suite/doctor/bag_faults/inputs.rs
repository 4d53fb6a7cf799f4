//! What is there, of which type, and whether it can be read.

use msgs::RosMessage;
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Path;
use msgs::sensor_msgs::{Image, LaserScan};

use super::{DEPTH, POSE, SCAN};
use crate::doctor::bags::{Base, Fault, fault};

pub(super) const FAULTS: &[Fault] = &[
    fault(
        "no pose",
        Base::Room,
        |bag| {
            bag.keep(POSE, |_| false);
        },
        ["error", "inputs"],
        &["PoseStamped", "--pose"],
    ),
    fault(
        "poses of another type",
        Base::Room,
        |bag| {
            bag.retype(POSE, |pose: PoseStamped| Path {
                header: pose.header.clone(),
                poses: vec![pose],
            });
        },
        ["error", "inputs"],
        &["geometry_msgs/msg/PoseStamped"],
    ),
    fault(
        "colour for depth",
        Base::Room,
        |bag| {
            bag.edit(DEPTH, |_, image: &mut Image| {
                image.encoding = "rgb8".to_owned();
                image.step = image.width * 3;
                image.data = vec![9; (image.step * image.height) as usize];
            });
        },
        ["error", "messages"],
        &[DEPTH, "rgb8", "16UC1"],
    ),
    fault(
        "messages cut short",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |index, scan: &mut LaserScan| {
                if index % 4 == 1 {
                    scan.ranges.clear()
                }
            });
        },
        ["warn", "messages"],
        &[SCAN, "of 14 messages"],
    ),
    fault(
        "a definition of another release",
        Base::Room,
        |bag| {
            bag.define(LaserScan::TYPE_NAME, |text| {
                text.replace("string frame_id", "uint32 seq\nstring frame_id")
            });
        },
        ["error", "versions"],
        &[SCAN, "'uint32 seq' there"],
    ),
];
