//! Nodes that are set up differently refuse each other's cycles, and say so with both values.

use std::time::{Duration, Instant};

use free_domain::FreeDomain;
use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::stillmap_msgs::StageReport;
use msgs::{RosMessage, convert};
use node_shell::{Node, Qos, RosArguments, Subscription, Transport};

use crate::bags::pose;

/// Longer than anything takes on a busy machine; a test that waits so long has failed.
const PATIENCE: Duration = Duration::from_secs(60);

/// What one difference costs: the node that refuses, what that node is started with, and what it says.
const CASES: [(&str, &str, &str); 4] = [
    ("segmentation", "voxel_edge_m:=0.05", "voxel_edge_m is 0.08 in the cycle and 0.05 here"),
    ("segmentation", "method:=rec_hv", "method is free_space in the cycle and rec_hv here"),
    (
        "segmentation",
        "rig_from_lidar:=[0.0, 0.0, -0.8, 0.0, 0.0, 0.0]",
        "rig_from_lidar is [0.000, 0.000, -0.050, 0.0000, 0.0000, 0.0000] in the cycle and [0.000, 0.000, -0.800, 0.0000, \
         0.0000, 0.0000] here",
    ),
    ("reconstruction", "voxel_edge_m:=0.05", "voxel_edge_m is 0.08 in the cycle and 0.05 here"),
];

/// A node as a process, with its log in a file.
struct Logged {
    child: std::process::Child,
    log: std::path::PathBuf,
}

impl Drop for Logged {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

async fn until<M: RosMessage>(
    what: &str,
    heard: &Subscription<M>,
    mut again: impl FnMut(),
    mut is_it: impl FnMut(&M) -> bool,
) {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        again();
        while let Ok(received) =
            tokio::time::timeout(Duration::from_millis(300), heard.next()).await
        {
            if is_it(&received.message) {
                return;
            }
        }
    }
    panic!("waited in vain: {what}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nodes_with_other_edges_methods_or_rigs_refuse_the_cycle_with_both_values() {
    let folder = tempfile::tempdir().unwrap();
    let domain = FreeDomain::new();
    for (index, (name, assignment, said)) in CASES.into_iter().enumerate() {
        let process = std::process::id();
        let namespace = format!("__ns:=/settings_{process}_{index}");
        let log = folder.path().join(format!("{index}.log"));
        let child = std::process::Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
            .args(["node", name, "--ros-args", "-r", &namespace, "-p", assignment])
            .env("ROS_DOMAIN_ID", domain.number().to_string())
            .stdin(std::process::Stdio::null())
            .stdout(std::process::Stdio::null())
            .stderr(std::fs::File::create(&log).unwrap())
            .spawn()
            .unwrap();
        let node = Logged { child, log };
        let arguments = RosArguments::parse(["--ros-args", "-r", &namespace]).unwrap();
        let peer =
            Node::start_on(Transport::on_domain(domain.number()).unwrap(), "peer", &arguments)
                .unwrap();
        {
            let qos = Qos::reliable(20);
            let reports =
                peer.subscription::<StageReport>(&format!("{name}/report"), &qos).unwrap();
            let diagnostics = peer.subscription::<DiagnosticArray>("/diagnostics", &qos).unwrap();
            let reduced = peer.publisher("reduced_cloud", &qos).unwrap();
            let segmented = peer.publisher("segmented_cloud", &qos).unwrap();
            let send = || {
                let cycle = cycle();
                if name == "segmentation" {
                    reduced.publish_or_warn(convert::message_from_detected_cycle(&cycle));
                } else {
                    segmented.publish_or_warn(convert::message_from_segmented_cycle(
                        &geometry::SegmentedCycle {
                            depth: None,
                            scan_rays: std::sync::Arc::default(),
                            retracted_m: Vec::new(),
                            index: cycle.index,
                            setup: cycle.setup,
                            static_cloud: cycle.reduced_cloud.clone(),
                            dynamic_cloud: cycle.reduced_cloud,
                            map_from_rig: cycle.map_from_rig,
                        },
                    ));
                }
            };
            until("the report of a refusal", &reports, send, |report: &StageReport| {
                assert!(!report.processed, "{report:?}");
                report.drop_reason.contains(said)
            })
            .await;
            until(
                "the warning on /diagnostics",
                &diagnostics,
                || (),
                |array: &DiagnosticArray| {
                    array.status.iter().any(|status| status.message.contains(said))
                },
            )
            .await;
        }
        peer.close().await;
        let text = std::fs::read_to_string(&node.log).unwrap();
        assert!(text.contains(said), "{text}");
        assert!(text.contains("config/pipeline.yaml"), "{text}");
    }
}

/// A cycle with nothing in it, made with the defaults.
fn cycle() -> geometry::DetectedCycle {
    let stamp = geometry::Stamp::from_secs_nanos(100, 0);
    let pose = convert::pose_from_message(&pose(stamp)).unwrap();
    geometry::DetectedCycle {
        depth: None,
        scan_rays: std::sync::Arc::default(),
        index: 0,
        setup: geometry::CycleSetup::default(),
        scan_stamp: stamp,
        reduced_cloud: geometry::Cloud { stamp, frame_id: "rig".to_owned(), points_m: Vec::new() },
        voxel_points: Vec::new(),
        points_before_reduction: 0,
        map_from_rig: pose.map_from_rig,
        map_from_continuous: None,
        map_frame_id: pose.frame_id,
        zones: Vec::new(),
        moving_beams: Vec::new(),
    }
}
