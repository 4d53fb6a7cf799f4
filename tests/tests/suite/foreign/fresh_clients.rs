//! Services of the suite's nodes, called the moment a fresh process sees them, as `ros2 lifecycle get` does. Once 5 of 20 such
//! calls were never answered: the response went out before the client's reader of responses was found.

use std::process::Stdio;

use msgs::RosService;
use msgs::lifecycle_msgs::GetState;
use serde_json::Value;
use tokio::process::Command;
use tokio::time::timeout;

use super::build::{Make, program};
use super::definitions;
use super::place::{PATIENCE, Place};
use crate::program::Running;

/// How many processes call, one after the other; `STILLMAP_FRESH_CLIENTS` names another number.
pub(super) fn fresh_processes() -> usize {
    std::env::var("STILLMAP_FRESH_CLIENTS").map_or(10, |text| text.parse().unwrap())
}

/// Lets fresh processes ask these nodes in turn for their state.
async fn are_answered(place: &Place, nodes: &[&str]) {
    let Some(python) = program(Make::CyclonePython) else { return };
    let peers = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/cyclone_python/once.py");
    let mut slowest = std::time::Duration::ZERO;
    let count = fresh_processes();
    for (nth, node) in (0..count).zip(nodes.iter().cycle()) {
        let service = format!("{}/{node}/get_state", place.namespace());
        let request = r#"{ "structure_needs_at_least_one_member": 0 }"#;
        let mut client = Command::new(&python.path);
        client
            .args([
                "-B",
                peers,
                &place.domain_id().to_string(),
                &service,
                GetState::TYPE_NAME,
                request,
            ])
            .env("STILLMAP_MSG_FOLDER", definitions::folder())
            .stdin(Stdio::null())
            .stderr(Stdio::inherit())
            .kill_on_drop(true);
        let started = std::time::Instant::now();
        let output = timeout(PATIENCE, client.output()).await;
        let output = output.unwrap_or_else(|_| panic!("call {nth} of {service} is not answered"));
        let output = output.unwrap();
        assert!(output.status.success(), "call {nth} of {service}: {}", output.status);
        let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(answer["current_state"]["label"].is_string(), "{answer}");
        slowest = slowest.max(started.elapsed());
    }
    println!("{nodes:?}: {count} of {count} answered, the slowest process took {slowest:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_fresh_client_of_a_composed_suite_is_answered() {
    let place = Place::new().await;
    let rule = format!("__ns:={}", place.namespace());
    let up =
        Running::start_on(place.domain_id(), ["up", "--pose", "visual", "--ros-args", "-r", &rule]);
    are_answered(&place, &["detection", "segmentation", "reconstruction", "pose"]).await;
    assert!(up.interrupt());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_fresh_client_of_a_node_of_its_own_process_is_answered() {
    let place = Place::new().await;
    let rule = format!("__ns:={}", place.namespace());
    let nodes =
        ["detection", "segmentation", "reconstruction", "pose", "compression", "lidar_odometry"];
    let running = nodes.map(|node| {
        let program = node.replace('_', "-");
        Running::start_on(place.domain_id(), ["node", &program, "--ros-args", "-r", &rule])
    });
    are_answered(&place, &nodes).await;
    assert!(running.into_iter().all(Running::interrupt));
}
