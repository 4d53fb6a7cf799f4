//! A bag of a robot with a joint between scanner and camera, for tests.

use std::path::{Path, PathBuf};

use bag_player::{Bag, BagWriter, OfferedQos, Selection};
use geometry::{Stamp, pose_from_vector};
use laboratory::write_bag;
use msgs::convert::{stamp_from_time, time_from_stamp, transform_from_isometry};
use msgs::geometry_msgs::TransformStamped;
use msgs::sensor_msgs::LaserScan;
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;
use nalgebra::{Isometry3, Vector3};
use simulator::{Scenario, SceneName};

use crate::run::inputs::TF;
use crate::sensor_bag::{DEPTH_FRAME, SCAN};

/// By so much the joint turns the scanner.
pub(crate) const TURN_RAD: f64 = 0.08;
/// It does so after this time, of four seconds.
const TURNS_AFTER_S: f64 = 2.0;

/// Writes a simulated bag of a room, and parameters by which the mounts are those of tf: how far the joint turns, and by how much tf is wrong.
pub(crate) fn write(folder: &Path, [turn_rad, tf_error_rad]: [f64; 2]) -> [PathBuf; 2] {
    let mut scenario =
        Scenario::empty(SceneName::F, 2).with_depth_size(160, 120).with_duration_s(4.0);
    scenario.rig.depth_camera.rate_hz = 15.0;
    let still = folder.join("still.mcap");
    write_bag(&scenario, &still, &Default::default()).unwrap();
    let (path, parameters) = (folder.join("joint.mcap"), folder.join("joint.yaml"));
    std::fs::write(&parameters, "/**: {ros__parameters: {extrinsics: tf}}\n").unwrap();
    let rig_from_camera = pose_from_vector(&scenario.rig.depth_camera.rig_from_camera);
    let rig_from_lidar = pose_from_vector(&scenario.rig.lidar.rig_from_lidar);
    let turned = |at: Stamp| {
        if at.seconds_since(scenario.start) < TURNS_AFTER_S { 0.0 } else { turn_rad }
    };

    let mut writer = BagWriter::create(&path).unwrap();
    let tf = writer.channel::<TFMessage>(TF, OfferedQos::reliable(10)).unwrap();
    let bag = Bag::open(&still).unwrap();
    for message in bag.messages(&Selection::default()).unwrap() {
        let message = message.unwrap();
        let qos = OfferedQos::reliable(10).to_yaml();
        let channel = writer.raw_channel(&message.topic, &message.type_name, "", &qos).unwrap();
        if *message.topic != *SCAN {
            let at = message.log_time;
            writer.write_raw(channel, at, at, &message.data).unwrap();
            continue;
        }
        // A scanner that is turned has what is there at another angle.
        let mut scan = message.decode::<LaserScan>().unwrap();
        let stamp = stamp_from_time(scan.header.stamp);
        let turn = turned(stamp) as f32;
        (scan.angle_min, scan.angle_max) = (scan.angle_min - turn, scan.angle_max - turn);
        writer.write(channel, message.log_time, &scan).unwrap();
        let turn = Isometry3::rotation(Vector3::z() * (turned(stamp) + tf_error_rad));
        let camera_from_lidar = rig_from_camera.inverse() * rig_from_lidar * turn;
        let transform = TransformStamped {
            header: Header { stamp: time_from_stamp(stamp), frame_id: DEPTH_FRAME.to_owned() },
            child_frame_id: scan.header.frame_id,
            transform: transform_from_isometry(&camera_from_lidar),
        };
        writer.write(tf, message.log_time, &TFMessage { transforms: vec![transform] }).unwrap();
    }
    writer.finish().unwrap();
    [path, parameters]
}
