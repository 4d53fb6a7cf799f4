//! The main job on a real recording: a person works in front of a Kinect v2 that stands still.
//! The recording may not be passed on; where it is absent, the test says so and ends.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::bags::made_once;
use crate::program::{succeed, summary};

const RECORDING: &str = "../shared/data/dynamic-depth-kitchen/data_01-05-11";

/// The recording as a bag with a scan.
pub(crate) fn kitchen(folder: &Path) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(RECORDING);
    if !path.is_dir() {
        println!("skipped: the recording dynamic-depth-kitchen is not here");
        return None;
    }
    static BAG: OnceLock<Vec<u8>> = OnceLock::new();
    let (depth, masks) = (path.join("depth"), path.join("mask_derived"));
    let (depth, masks) = (depth.to_str().unwrap(), masks.to_str().unwrap());
    let import = ["import", "depth", depth, "--masks", masks, "--scan-from-depth"];
    let camera = ["--intrinsics", "365,365,256,212", "--rate", "10"];
    Some(made_once(&BAG, folder.join("kitchen.mcap"), &[&import[..], &camera].concat()))
}

#[test]
fn the_kitchen_runs_over_dds_to_its_end_without_a_drop() {
    let folder = tempfile::tempdir().unwrap();
    let Some(bag) = kitchen(folder.path()) else { return };
    let out = folder.path().join("out");
    succeed(["run", bag.to_str().unwrap(), "--transport", "dds", "--out", out.to_str().unwrap()]);
    let summary = summary(&out);
    assert_eq!(summary["drops"], serde_json::json!([]));
    // The last frame has no later one to decide its match; all others are cycles.
    assert!(summary["cycles"]["total"].as_u64().unwrap() >= 87, "{}", summary["cycles"]);
    let map = &summary["truth"]["map"];
    println!(
        "masked points removed: {}; voxels that only masked points touched, left in the map: {} of {}",
        summary["truth"]["object_points"]["share"],
        map["object_only_left"],
        map["object_only_without_removal"]
    );
    // At most 2 % of the voxels that only the person touched stay once he has left.
    let [left, touched] =
        ["object_only_left", "object_only_without_removal"].map(|name| map[name].as_f64().unwrap());
    assert!(touched > 100.0 && left <= 0.02 * touched, "{map}");
    // Of the voxels that were seen in three images or more 0.883 was measured. Of a surface that half of a pixel's images show
    // 99.9 % are kept: the others are what noise, and the person where the mask lacks him, put before the room's surfaces.
    let confirmed = &map["static_confirmed"];
    assert!(confirmed["kept_share"].as_f64().unwrap() > 0.87, "{confirmed}");
}
