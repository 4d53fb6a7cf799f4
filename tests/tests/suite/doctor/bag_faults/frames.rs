//! Frames and tf.

use msgs::sensor_msgs::LaserScan;
use msgs::tf2_msgs::TFMessage;

use super::SCAN;
use crate::doctor::bags::{Base, Fault, fault};
use crate::doctor::plant::{CAMERA, transform};

pub(super) const FAULTS: &[Fault] = &[
    fault(
        "no frame_id",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| scan.header.frame_id.clear());
        },
        ["error", "frames"],
        &[SCAN, "empty in"],
    ),
    fault(
        "a slash before the frame",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| scan.header.frame_id = "/laser".to_owned());
        },
        ["warn", "frames"],
        &[SCAN, "leading slash"],
    ),
    fault(
        "a frame that tf does not know",
        Base::RoomWithTf,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| scan.header.frame_id = "rplidar".to_owned());
        },
        ["warn", "frames"],
        &[SCAN, "rplidar", "static_transform_publisher"],
    ),
    fault(
        "tf in two parts",
        Base::RoomWithTf,
        |bag| {
            bag.edit("/tf_static", |_, tf: &mut TFMessage| {
                tf.transforms[1].header.frame_id = "camera_link".to_owned();
            });
        },
        ["warn", "transforms"],
        &["2 parts", "laser", CAMERA, "camera_link"],
    ),
    fault(
        "tf in a loop",
        Base::RoomWithTf,
        |bag| {
            let start = bag.start();
            let odom = transform(start, "laser", "odom", [0.0; 6]);
            bag.add("/tf", [(start, TFMessage { transforms: vec![odom] })]);
        },
        ["error", "transforms"],
        &["base_link -> odom -> laser -> base_link is a loop"],
    ),
    fault(
        "a frame with two parents",
        Base::RoomWithTf,
        |bag| {
            let start = bag.start();
            let moments = (0..20).map(|tenth| start.plus_seconds(f64::from(tenth) / 10.0));
            let tf = |stamp| TFMessage {
                transforms: vec![transform(stamp, "map", "base_link", [0.0; 6])],
            };
            bag.add("/tf", moments.map(|stamp| (stamp, tf(stamp))));
        },
        ["error", "transforms"],
        &["base_link has 2 parents", "map (20 messages)", "REP-105"],
    ),
    fault(
        "a rotation that is none",
        Base::RoomWithTf,
        |bag| {
            bag.edit("/tf", |_, tf: &mut TFMessage| {
                tf.transforms[0].transform.rotation = Default::default();
                tf.transforms[0].transform.rotation.w = 0.0;
            });
        },
        ["error", "transforms"],
        &["40 transforms are invalid", "quaternion"],
    ),
    fault(
        "fixed transforms that are not latched",
        Base::RoomWithTf,
        |bag| {
            bag.unlatch();
        },
        ["warn", "qos"],
        &["/tf_static", "volatile", "transient local"],
    ),
];
