//! Visual odometry on a real recording: a hand turns a Kinect about all axes (TUM RGB-D, freiburg1_rpy, the first 100 pairs).
//! Where the recording is absent, the tests say so and end.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde_json::Value;

use crate::bags::made_once;
use crate::program::{succeed, summary};

const RECORDING: &str = "../shared/data/tum-fr1-rpy/rgbd_dataset_freiburg1_rpy";

/// The recording as a bag, and the file with its true poses.
pub(crate) fn recording(folder: &Path) -> Option<(PathBuf, PathBuf)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(RECORDING);
    if !path.is_dir() {
        println!("skipped: the recording tum-fr1-rpy is not here");
        return None;
    }
    static BAG: OnceLock<Vec<u8>> = OnceLock::new();
    let import = ["import", "tum", path.to_str().unwrap(), "--scan-from-depth"];
    let bag = made_once(&BAG, folder.join("rpy.mcap"), &import);
    Some((bag, path.join("groundtruth.txt")))
}

/// The root of the mean squared error of the positions, in metres.
pub(crate) fn error_m(estimate: &Path, truth: &Path) -> f64 {
    let (estimate, truth) = (estimate.to_str().unwrap(), truth.to_str().unwrap());
    let json = succeed(["eval", "trajectory", estimate, "--ref", truth, "--json"]);
    let scored: Value = serde_json::from_str(&json).unwrap();
    scored["absolute"]["translation_m"]["rmse"].as_f64().unwrap_or_else(|| panic!("{scored}"))
}

#[test]
fn a_camera_that_a_hand_turns_is_followed_by_points_by_lines_and_by_both() {
    let folder = tempfile::tempdir().unwrap();
    let Some((bag, truth)) = recording(folder.path()) else { return };
    let followed_m = |features: &str| {
        let poses = folder.path().join(format!("{features}.txt"));
        let (bag, to) = (bag.to_str().unwrap(), poses.to_str().unwrap());
        let told = succeed(["odometry", bag, "--features", features, "--json", "-o", to]);
        let told: Value = serde_json::from_str(&told).unwrap();
        assert_eq!((&told["image_pairs"], &told["poses"]), (&100.into(), &100.into()), "{told}");
        error_m(&poses, &truth)
    };
    let [points_m, lines_m, both_m] = ["points", "lines", "both"].map(followed_m);
    println!("points {points_m} m, lines {lines_m} m, both {both_m} m");
    // Keyframes and PnP alone make 0.068 m of it.
    assert!(both_m <= 0.025 && points_m <= 0.025 && lines_m <= 0.05);
}

#[test]
fn the_pipeline_takes_its_pose_from_the_camera() {
    let folder = tempfile::tempdir().unwrap();
    let Some((bag, truth)) = recording(folder.path()) else { return };
    let out = folder.path().join("out");
    let (bag, to) = (bag.to_str().unwrap(), out.to_str().unwrap());
    succeed(["run", bag, "--pose", "visual", "--out", to]);
    assert!(summary(&out)["cycles"]["total"].as_u64().unwrap() >= 95);
    assert!(error_m(&out.join("trajectory.txt"), &truth) <= 0.025);
}

#[test]
fn over_dds_the_pipeline_takes_its_pose_from_the_camera_too() {
    let folder = tempfile::tempdir().unwrap();
    let Some((bag, truth)) = recording(folder.path()) else { return };
    let out = folder.path().join("out");
    let (bag, to) = (bag.to_str().unwrap(), out.to_str().unwrap());
    // A busy machine loses nothing: the player waits for the node.
    succeed(["run", bag, "--pose", "visual", "--out", to, "--transport", "dds"]);
    assert!(summary(&out)["cycles"]["total"].as_u64().unwrap() >= 95);
    assert!(error_m(&out.join("trajectory.txt"), &truth) <= 0.025);
}
