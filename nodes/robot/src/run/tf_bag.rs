//! A bag of a robot with tf, for tests: a message of each sensor and the transforms.

use std::path::Path;

use bag_player::{BagWriter, OfferedQos};
use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert::{time_from_stamp, transform_from_isometry};
use msgs::geometry_msgs::TransformStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan};
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;
use nalgebra::Isometry3;

use super::inputs::{TF, TF_STATIC};

/// The moment of all messages.
fn at() -> Stamp {
    Stamp::from_secs_nanos(100, 0)
}

fn header(frame: &str) -> Header {
    Header { stamp: time_from_stamp(at()), frame_id: frame.to_owned() }
}

fn transform(parent: &str, child: &str, parent_from_child: &Isometry3<f64>) -> TransformStamped {
    TransformStamped {
        header: header(parent),
        child_frame_id: child.to_owned(),
        transform: transform_from_isometry(parent_from_child),
    }
}

fn put<M: RosMessage>(writer: &mut BagWriter, topic: &str, message: &M) {
    let channel = writer.channel::<M>(topic, OfferedQos::reliable(10)).unwrap();
    writer.write(channel, at(), message).unwrap();
}

/// Writes a bag with a scan in the frame `laser`, a depth image in `camera`, `base_link` in `map`, and these frames on `base_link`.
pub(crate) fn write(path: &Path, on_robot: &[(&str, Isometry3<f64>)]) {
    let mut writer = BagWriter::create(path).unwrap();
    put(&mut writer, "/scan", &LaserScan { header: header("laser"), ..LaserScan::default() });
    let image = Image {
        header: header("camera"),
        encoding: "16UC1".to_owned(),
        height: 1,
        width: 1,
        step: 2,
        data: vec![1, 1],
        ..Image::default()
    };
    put(&mut writer, "/depth/image", &image);
    put(&mut writer, "/depth/camera_info", &CameraInfo::default());
    let robot = transform("map", "base_link", &Isometry3::translation(0.1, 0.2, 0.3));
    put(&mut writer, TF, &TFMessage { transforms: vec![robot] });
    let mounts = on_robot.iter().map(|(frame, pose)| transform("base_link", frame, pose));
    put(&mut writer, TF_STATIC, &TFMessage { transforms: mounts.collect() });
    writer.finish().unwrap();
}
