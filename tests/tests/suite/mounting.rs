//! A scanner far below the camera: what it finds is cut out at the height at which it sees it, by whichever way its mount is
//! known.

use std::path::{Path, PathBuf};

use bag_player::Bag;
use msgs::tf2_msgs::TFMessage;
use serde_json::Value;

use crate::bags::bag_of;
use crate::program::{stillmap, succeed, summary};
use crate::transforms::{copy_readings, on_robot};

/// How long before the first message the robot's tf begins.
const EARLIER_S: f64 = 0.5;

/// A post crosses a hall whose walls are out of the camera's reach: nothing is known of the space around it, and the points
/// that its growth starts from are those at the height of the scan.
fn hall(folder: &Path, name: &str, scanner_z_m: f64, post_m: f64) -> PathBuf {
    let half_m = post_m / 2.0;
    let scene = format!(
        "name: {name}\nseed: 1\nduration_s: 6.0\nscene:\n  bodies:\n    - name: floor\n      shape: {{box: {{size_m: \
         [30.0, 30.0, 0.1]}}}}\n      pose: [10, 0, -0.05, 0, 0, 0]\n      material: {{reflectivity: 0.01, \
         max_incidence_rad: 1.0}}\n  objects:\n    - id: 1\n      name: post\n      figure:\n        rigid:\n          - \
         name: post\n            shape: {{box: {{size_m: [0.5, 0.5, {post_m}]}}}}\n            pose: [0, 0, {half_m}, 0, \
         0, 0]\n            material: {{reflectivity: 0.8, max_incidence_rad: 1.396}}\n      path:\n        waypoints:\n  \
         \x20       - {{time_s: 0.5, pose: [2.8, -2.6, 0, 1.5707963, 0, 0]}}\n          - {{time_s: 5.5, pose: [2.8, 2.6, \
         0, 1.5707963, 0, 0]}}\nrig:\n  lidar:\n    rig_from_lidar: [0, 0, {scanner_z_m}, 0, 0, 0]\n  depth_camera:\n    \
         camera: {{width_px: 160, height_px: 120, fx_px: 144.0, fy_px: 144.0, cx_px: 79.5, cy_px: 59.5, distortion: \
         None}}\n    rate_hz: 15.0\n"
    );
    let yaml = folder.join(format!("{name}.yaml"));
    std::fs::write(&yaml, scene).unwrap();
    let bag = folder.join(format!("{name}.mcap"));
    succeed(["simulate", yaml.to_str().unwrap(), "-o", bag.to_str().unwrap()]);
    bag
}

/// The readings of a bag with the scanner's mount on tf.
fn with_tf(folder: &Path, bag: &Path, scanner_z_m: f64) -> PathBuf {
    let source = Bag::open(bag).unwrap();
    let start = source.info().unwrap().start.unwrap().plus_seconds(-EARLIER_S);
    let camera = geometry::RigConfig::default().rig_from_camera;
    bag_of(folder, "with_tf.mcap", |topics| {
        let laser = [0.0, 0.0, scanner_z_m, 0.0, 0.0, 0.0];
        let transforms = vec![
            on_robot(start, "camera_depth_optical_frame", camera),
            on_robot(start, "laser", laser),
        ];
        topics.messages("/tf_static", [(start, TFMessage { transforms })]);
        copy_readings(&source, topics);
    })
}

/// What a run over DDS leaves.
fn summary_of(bag: &Path, rig: &str) -> Value {
    let parameters = bag.with_extension("parameters.yaml");
    std::fs::write(&parameters, format!("/**:\n  ros__parameters:\n    {rig}\n")).unwrap();
    let out = bag.with_extension("out");
    let [bag, parameters, out_text] = [bag, &parameters, &out].map(|path| path.to_str().unwrap());
    // That nothing else is there to map is said at the end, and no fault here.
    stillmap(["run", bag, "--transport", "dds", "--params-file", parameters, "--out", out_text]);
    let told = summary(&out);
    assert_eq!(told["drops"], serde_json::json!([]), "{rig}");
    told
}

/// How well the post was found, removed and kept out of the map.
struct Score {
    found: f64,
    removed: f64,
    left: u64,
}

fn score(summary: &Value) -> Score {
    let post = &summary["truth"]["objects"][0];
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{post:#}"));
    Score {
        found: number(&post["found_or_removed_share"]),
        removed: number(&post["points"]["share"]),
        left: post["own_voxels_left"].as_u64().unwrap(),
    }
}

/// A post of the scanner's height had no seeds where segmentation took the scan for 5 cm below the camera.
#[test]
fn a_scanner_far_below_the_camera_is_as_good_as_one_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let beside = hall(folder.path(), "beside", -0.05, 1.7);
    let beside = score(&summary_of(&beside, "rig_from_lidar: [0.0, 0.0, -0.05, 0.0, 0.0, 0.0]"));
    // Its top is 0.5 m below the camera.
    let below = hall(folder.path(), "below", -0.8, 0.7);
    let by_parameter = summary_of(&below, "rig_from_lidar: [0.0, 0.0, -0.8, 0.0, 0.0, 0.0]");
    let low = score(&by_parameter);
    for (what, there, here) in
        [("found", beside.found, low.found), ("removed", beside.removed, low.removed)]
    {
        assert!(here >= there - 0.05, "{what}: {here} below, {there} beside");
    }
    assert!(beside.found > 0.9 && beside.removed > 0.9, "{} {}", beside.found, beside.removed);
    assert_eq!((beside.left, low.left), (0, 0));

    let by_tf = summary_of(&with_tf(folder.path(), &below, -0.8), "extrinsics: \"tf\"");
    for key in ["cycles", "points", "zone_shares", "map"] {
        assert_eq!(by_tf[key], by_parameter[key], "{key}");
    }
}
