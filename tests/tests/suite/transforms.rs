//! A bag that says by tf where its sensors are.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};

use bag_player::{Bag, Selection};
use geometry::{RigMounts, Stamp, pose_from_vector, pose_vector};
use msgs::geometry_msgs::{PoseStamped, TransformStamped};
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan};
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;
use msgs::{RosMessage, convert};

use crate::bags::{Topics, bag_of, pose, scan, small_room, ten_stamps, wall};
use crate::local_run::files_of;
use crate::program::{stillmap, succeed, summary};

pub(crate) fn on_robot(stamp: Stamp, child: &str, pose: [f64; 6]) -> TransformStamped {
    TransformStamped {
        header: Header { stamp: convert::time_from_stamp(stamp), frame_id: "base_link".to_owned() },
        child_frame_id: child.to_owned(),
        transform: convert::transform_from_isometry(&pose_from_vector(&pose)),
    }
}

fn tf(stamp: Stamp, child: &str, pose: [f64; 6]) -> TFMessage {
    TFMessage { transforms: vec![on_robot(stamp, child, pose)] }
}

/// An optical frame on a robot: x to the right, y down, z forward (REP-103).
const OPTICAL: [f64; 6] = [0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2];

/// Another mount than the room's scanner has: turned to the left by more than a person is wide.
const LASER: [f64; 6] = [0.05, -0.1, -0.08, 0.4, 0.0, 0.0];

/// How long before the first message the robot's tf begins.
const EARLIER_S: f64 = 0.5;

/// The small simulated room as a robot would have recorded it that says by tf where its sensors are: the scanner is fixed
/// to it, the camera stands on a mast that is told of again and again.
fn room_with_tf(folder: &Path) -> PathBuf {
    let room = Bag::open(&small_room(folder)).unwrap();
    let start = room.info().unwrap().start.unwrap().plus_seconds(-EARLIER_S);
    bag_of(folder, "with_tf.mcap", |topics| {
        // Not latched, as converters write it; no listener of tf2 would take it so.
        topics.messages("/tf_static", [(start, tf(start, "laser", LASER))]);
        let moments = (0..100).map(|tenth| start.plus_seconds(f64::from(tenth) / 10.0));
        let mast = |stamp| (stamp, tf(stamp, "camera_depth_optical_frame", OPTICAL));
        topics.messages("/tf", moments.map(mast));
        copy_readings(&room, topics);
    })
}

/// What the sensors of a simulated bag have read, and where it was.
pub(crate) fn copy_readings(from: &Bag, topics: &mut Topics) {
    copy_sensors(from, topics);
    copy::<PoseStamped>(from, "/pose", topics);
}

/// What the sensors of a simulated bag have read.
pub(crate) fn copy_sensors(from: &Bag, topics: &mut Topics) {
    copy::<LaserScan>(from, "/scan", topics);
    copy::<Image>(from, "/camera/depth/image_raw", topics);
    copy::<CameraInfo>(from, "/camera/depth/camera_info", topics);
}

fn copy<M: RosMessage>(from: &Bag, topic: &str, topics: &mut Topics) {
    let selection = Selection { topics: Some(vec![topic.to_owned()]), ..Selection::default() };
    let messages = from.messages(&selection).unwrap().map(|message| {
        let message = message.unwrap();
        (message.log_time, message.decode::<M>().unwrap())
    });
    topics.messages(topic, messages);
}

/// A parameter file for all nodes.
fn parameters(folder: &Path, name: &str, line: &str) -> PathBuf {
    let path = folder.join(name);
    let text = format!("/**:\n  ros__parameters:\n    {line}\n");
    std::fs::write(&path, text).unwrap();
    path
}

/// What a run makes of a bag, but for what names the transport and the parameters.
fn result_of(bag: &Path, transport: &str, parameters: &Path) -> BTreeMap<String, Vec<u8>> {
    let out = parameters.with_extension(transport);
    let [bag, parameters, out_text] = [bag, parameters, &out].map(|path| path.to_str().unwrap());
    let given = ["--transport", transport, "--params-file", parameters, "--out", out_text];
    // The published method cuts out nothing but zones: what comes of it hangs on where the scanner is.
    let given = given.into_iter().chain(["--method", "rec_hv"]);
    succeed(["run", bag].into_iter().chain(given));
    let told = summary(&out);
    assert_eq!(told["drops"], serde_json::json!([]), "{transport} {parameters}");
    let mut files = files_of(&out);
    files.retain(|name, _| !["summary.json", "report.html", "parameters.yaml"].contains(&&**name));
    assert!(files.contains_key("map.ply"));
    files
}

/// It was once left out of what is played over DDS, and every scan waited for it in vain.
#[test]
fn the_mount_of_tf_is_that_of_the_parameter_over_either_transport() {
    let folder = tempfile::tempdir().unwrap();
    let bag = room_with_tf(folder.path());
    let tf = parameters(folder.path(), "tf.yaml", "extrinsics: tf");
    let [optical, laser] = [OPTICAL, LASER].map(|pose| pose_from_vector(&pose));
    let rig_from_camera = RigMounts::default().rig_from_camera;
    let rig_from_lidar = pose_vector(&(rig_from_camera * optical.inverse() * laser));
    let line = format!("rig_from_lidar: {rig_from_lidar:?}");
    let same = parameters(folder.path(), "same.yaml", &line);
    let other = parameters(folder.path(), "other.yaml", "extrinsics: parameters");

    let by_tf = result_of(&bag, "local", &tf);
    assert!(by_tf == result_of(&bag, "local", &same), "tf and the parameter say the same");
    assert!(by_tf == result_of(&bag, "dds", &tf), "the transport changes nothing");
    assert!(by_tf != result_of(&bag, "local", &other), "and the mount matters");
}

#[test]
fn a_run_that_takes_its_mount_from_the_parameters_does_not_read_tf() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "broken_tf.mcap", |topics| {
        topics.cut_off::<TFMessage>("/tf_static", ten_stamps());
        topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
        topics.messages("/points", ten_stamps().map(|stamp| (stamp, wall(stamp, 9))));
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
    });
    let parameters = parameters(folder.path(), "default.yaml", "extrinsics: parameters");
    result_of(&bag, "local", &parameters);
}

/// A scanner of which tf tells nothing has no mount, and the run says so.
#[test]
fn a_scanner_that_tf_does_not_name_makes_no_map() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "part.mcap", |topics| {
        let mast = |stamp| (stamp, tf(stamp, "camera_depth_optical_frame", OPTICAL));
        topics.messages("/tf", ten_stamps().map(mast));
        topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
        topics.messages("/points", ten_stamps().map(|stamp| (stamp, wall(stamp, 9))));
        topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
    });
    let parameters = parameters(folder.path(), "tf.yaml", "extrinsics: tf");
    let out = folder.path().join("out");
    let [bag, parameters, out] = [&bag, &parameters, &out].map(|path| path.to_str().unwrap());
    let output = stillmap(["run", bag, "--params-file", parameters, "--out", out]);
    assert!(!output.status.success(), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("no transform names frame \"laser\""), "{said}");
}
