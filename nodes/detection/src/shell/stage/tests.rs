use geometry::{RigMounts, pose_from_vector};
use node_shell::{Host, RosArguments};

use super::*;

/// Regression: the check that began anew with a changed parameter had the parameters' mounts in place of those of tf.
#[tokio::test]
async fn a_check_that_begins_anew_keeps_the_mounts_of_tf() {
    let arguments = RosArguments::parse([""; 0]).unwrap();
    let node = Host::in_process().node("detection", &arguments).unwrap();
    let usual = DetectionParameters::default;
    let mut stage = Stage::new(&node, &usual()).unwrap();
    let of_tf = RigMounts {
        rig_from_lidar: pose_from_vector(&[0.0, 0.25, -0.05, 0.0, 0.0, 0.0]),
        ..RigMounts::default()
    };
    stage.detector.mount(&of_tf).unwrap();
    stage.change(&DetectionParameters { extrinsics_limit_m: 0.031, ..usual() }).unwrap();
    assert_eq!(stage.extrinsics.as_ref().map(|check| check.mounts), Some(of_tf));
    drop(stage);
    node.close().await;
}
