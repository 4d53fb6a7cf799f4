//! The whole suite live in one process: pointers within, DDS to the sensors and to whom it concerns.

use std::path::Path;
use std::time::Duration;

use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::ReducedCloud;
use node_shell::{Node, Qos, RosArguments};
use tokio::time::timeout;

use crate::bags::small_room;
use crate::program::{Running, stillmap, succeed};

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// Nothing more comes after a bag when nothing has come for this long: the scanner sends seven a second.
const SILENCE: Duration = Duration::from_secs(3);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_suite_in_one_process_builds_the_local_runs_map_and_shows_it_outside() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let map = folder.path().join("map.ply");
    let namespace = format!("/up_{}", std::process::id());
    let rule = format!("__ns:={namespace}");

    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    let node = Node::start("outsider", &arguments).unwrap();
    let reduced = node.subscription::<ReducedCloud>("reduced_cloud", &Qos::reliable(200)).unwrap();
    let still = node.subscription::<PointCloud2>("static_cloud", &Qos::reliable(200)).unwrap();
    let up = Running::start([
        "up",
        "--ros-args",
        "-r",
        &rule,
        "-p",
        &format!("reconstruction:save_map_on_exit:={}", map.display()),
    ]);
    let ready = async {
        reduced.wait_for_publishers(1).await;
        still.wait_for_publishers(1).await;
    };
    timeout(PATIENCE, ready).await.unwrap();
    let player = play(&bag, &namespace);
    let (mut cycles, mut clouds) = (0, 0);
    let mut patience = PATIENCE;
    loop {
        let next = async {
            tokio::select! {
                _ = reduced.next() => (1, 0),
                _ = still.next() => (0, 1),
            }
        };
        let Ok((cycle, cloud)) = timeout(patience, next).await else { break };
        (cycles, clouds) = (cycles + cycle, clouds + cloud);
        patience = SILENCE;
    }
    assert!(cycles > 10, "{cycles}");
    assert_eq!(cycles, clouds, "what passes within a process also shows outside");
    drop(player);
    assert!(up.interrupt());
    drop((reduced, still));
    node.close().await;

    let out = folder.path().join("local");
    let rig = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/rig/rplidar_a1_kinect_v1.yaml");
    let (bag, out_name) = (bag.to_str().unwrap(), out.to_str().unwrap());
    succeed(["run", bag, "--params-file", rig, "--out", out_name]);
    let same = std::fs::read(map).unwrap() == std::fs::read(out.join("map.ply")).unwrap();
    assert!(same, "the two maps differ");
}

fn play(bag: &Path, namespace: &str) -> Running {
    let topics = [
        ("/scan", "scan"),
        ("/pose", "pose"),
        ("/camera/depth/image_raw", "depth/image"),
        ("/camera/depth/camera_info", "depth/camera_info"),
    ];
    let mut arguments = vec!["play".to_owned(), bag.display().to_string()];
    for (from, name) in topics {
        let to = format!("{namespace}/{name}");
        arguments.push(format!("--topics={from}"));
        arguments.push(format!("--remap={from}:={to}"));
        arguments.push(format!("--wait-for={to}"));
    }
    Running::start(arguments)
}

#[test]
fn mistakes_end_it_at_once_and_are_named() {
    for (arguments, named) in [
        (vec!["up", "--rig", "no_such_rig"], "presets are: rplidar_a1_kinect_v1"),
        (vec!["up", "--ros-args", "-p", "detection:aperture:=1.0"], "aperture_rad"),
        (vec!["up", "--ros-args", "-p", "segmentation:depth_cell_m:=-1.0"], "depth_cell_m"),
    ] {
        let output = stillmap(&arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(stderr.contains(named), "{arguments:?}: {stderr}");
    }
}
