use std::path::Path;

use bag_player::{BagWriter, OfferedQos};
use geometry::{RigMounts, Stamp};
use msgs::RosMessage;
use msgs::convert::{time_from_stamp, transform_from_isometry};
use msgs::geometry_msgs::TransformStamped;
use msgs::sensor_msgs::{CameraInfo, Image};
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;
use nalgebra::Isometry3;

use super::super::inputs::TF_STATIC;
use super::*;

fn header(frame: &str) -> Header {
    let stamp = time_from_stamp(Stamp::from_secs_nanos(100, 0));
    Header { stamp, frame_id: frame.to_owned() }
}

fn transforms(edges: &[(&str, &str)]) -> TFMessage {
    let one = |(parent, child): &(&str, &str)| TransformStamped {
        header: header(parent),
        child_frame_id: (*child).to_owned(),
        transform: transform_from_isometry(&Isometry3::translation(0.1, 0.2, 0.3)),
    };
    TFMessage { transforms: edges.iter().map(one).collect() }
}

fn put<M: RosMessage>(writer: &mut BagWriter, topic: &str, message: &M) {
    let channel = writer.channel::<M>(topic, OfferedQos::reliable(10)).unwrap();
    writer.write(channel, Stamp::from_secs_nanos(100, 0), message).unwrap();
}

/// Writes a bag of a robot whose tf has these frames on the robot.
fn write(path: &Path, on_robot: &[&str]) {
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
    put(&mut writer, TF, &transforms(&[("map", "base_link")]));
    let mounts: Vec<(&str, &str)> = on_robot.iter().map(|frame| ("base_link", *frame)).collect();
    put(&mut writer, TF_STATIC, &transforms(&mounts));
    writer.finish().unwrap();
}

/// Regression: with poses by tf the mounts were those of tf whatever the user said, where that was the default, and also where tf had none.
#[test]
fn mounts_are_those_of_tf_where_it_has_them_and_no_parameter_says_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    let states = folder.path().join("states.yaml");
    std::fs::write(&states, "/**:\n  ros__parameters:\n    extrinsics: parameters\n").unwrap();
    let bag = folder.path().join("robot.mcap");
    for (on_robot, files, extrinsics, note) in [
        (&["camera", "laser"][..], vec![], ExtrinsicsSource::TfFromRig, "by tf, too"),
        (
            &["camera", "laser"],
            vec![states.clone()],
            ExtrinsicsSource::Parameters,
            "those of the parameters",
        ),
        (
            &["camera"],
            vec![],
            ExtrinsicsSource::Parameters,
            "since tf does not connect base_link with laser",
        ),
    ] {
        write(&bag, on_robot);
        let opened = Bag::open(&bag).unwrap();
        let mut args = ParameterArgs::default();
        args.files = files;
        let mut parameters = PipelineParameters::load(&args).unwrap();
        let mut topics = TopicArgs::default();
        topics.pose = Some("tf".to_owned());
        let info = opened.info().unwrap();
        let (inputs, said) = choose_inputs(&opened, &info, &topics, &mut parameters).unwrap();
        assert_eq!(inputs.pose, PoseSource::Tf);
        let said = said.unwrap_or_default();
        assert!(said.contains(note), "{on_robot:?}: {said}");
        let rig = &parameters.pipeline().rig;
        assert_eq!((rig.extrinsics, rig.rig_frame_id.as_str()), (extrinsics, "base_link"));
        assert_eq!(rig.mounts(), RigMounts::default());
    }
}
