//! A bag that says by tf where its sensors are.

use std::f64::consts::FRAC_PI_2;

use geometry::{Stamp, pose_from_vector};
use msgs::convert;
use msgs::geometry_msgs::TransformStamped;
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;

use crate::bags::{bag_of, pose, scan, ten_stamps, wall};
use crate::program::{stillmap, succeed, summary};

fn on_robot(stamp: Stamp, child: &str, pose: [f64; 6]) -> TransformStamped {
    TransformStamped {
        header: Header { stamp: convert::time_from_stamp(stamp), frame_id: "base_link".to_owned() },
        child_frame_id: child.to_owned(),
        transform: convert::transform_from_isometry(&pose_from_vector(&pose)),
    }
}

/// An optical frame on a robot: x to the right, y down, z forward (REP-103).
const OPTICAL: [f64; 6] = [0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2];

/// The scanner is fixed to the robot, the camera on a mast that is told of again and again.
#[test]
fn the_scanner_of_a_bag_is_where_its_tf_says() {
    let folder = tempfile::tempdir().unwrap();
    let bag = |name: &str, has_scanner: bool| {
        bag_of(folder.path(), name, |topics| {
            let scanner = |stamp| TFMessage {
                transforms: vec![on_robot(stamp, "laser", [0.0, 0.0, -0.05, 0.3, 0.0, 0.0])],
            };
            let mast = |stamp| TFMessage {
                transforms: vec![on_robot(stamp, "camera_depth_optical_frame", OPTICAL)],
            };
            let fixed = ten_stamps().take(usize::from(has_scanner));
            topics.messages("/tf_static", fixed.map(|stamp| (stamp, scanner(stamp))));
            topics.messages("/tf", ten_stamps().map(|stamp| (stamp, mast(stamp))));
            topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
            topics.messages("/points", ten_stamps().map(|stamp| (stamp, wall(stamp, 9))));
            topics.messages("/scan", ten_stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        })
    };
    let parameters = folder.path().join("tf.yaml");
    std::fs::write(&parameters, "/**/detection:\n  ros__parameters:\n    extrinsics: tf\n")
        .unwrap();
    let run = |bag: &std::path::Path| {
        let out = bag.with_extension("out");
        let arguments = ["run", bag.to_str().unwrap(), "--out", out.to_str().unwrap()];
        let parameters = ["--params-file", parameters.to_str().unwrap()];
        (arguments.map(str::to_owned), parameters.map(str::to_owned), out)
    };
    let (arguments, with_parameters, out) = run(&bag("whole.mcap", true));
    succeed(arguments.iter().chain(&with_parameters));
    let told = summary(&out);
    assert_eq!(told["cycles"]["total"], 10, "{}", told["drops"]);

    let (arguments, with_parameters, _) = run(&bag("part.mcap", false));
    let output = stillmap(arguments.iter().chain(&with_parameters));
    assert!(!output.status.success(), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("no transform names frame \"laser\""), "{said}");
}
