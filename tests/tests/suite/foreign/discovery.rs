//! What a peer finds of a node, as `ros2 node list` and `ros2 node info` do.

use std::collections::BTreeSet;

use serde_json::Value;

use super::build::Make;
use super::peer::Peer;
use super::place::{PATIENCE, Place};
use crate::program::Running;

/// The nodes of the suite, each with a topic that it reads and one that it writes.
const NODES: [(&str, &str, &str); 6] = [
    ("detection", "scan", "reduced_cloud"),
    ("segmentation", "reduced_cloud", "static_cloud"),
    ("reconstruction", "segmented_cloud", "static_map"),
    ("pose", "rgb/image", "odom"),
    ("lidar_odometry", "points", "local_map"),
    ("compression", "depth/image", "depth/image/compressedDepth"),
];

/// The services that every node has.
const SERVICES: [&str; 11] = [
    "describe_parameters",
    "get_parameters",
    "get_parameter_types",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
    "change_state",
    "get_state",
    "get_available_states",
    "get_available_transitions",
    "get_transition_graph",
];

/// The topics in a list of a node that was heard of.
fn topics(node: &Value, list: &str) -> BTreeSet<String> {
    let names = node[list].as_array().unwrap().iter();
    names.map(|name| name.as_str().unwrap().to_owned()).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_finds_each_node_with_its_endpoints() {
    let place = Place::new().await;
    let Some(mut peer) = Peer::start(Make::CyclonePython, "nodes", &place, &[]).await else {
        return;
    };
    let namespace = place.namespace();
    let rule = format!("__ns:={namespace}");
    for (name, reads, writes) in NODES {
        let program = name.replace('_', "-");
        let process =
            Running::start_on(place.domain_id(), ["node", &program, "--ros-args", "-r", &rule]);
        let full_name = format!("{namespace}/{name}");
        let mut readers = BTreeSet::from([format!("rt{namespace}/{reads}")]);
        let mut writers = BTreeSet::from([
            format!("rt{namespace}/{writes}"),
            format!("rt{full_name}/transition_event"),
            "rt/diagnostics".to_owned(),
            "rt/parameter_events".to_owned(),
            "rt/rosout".to_owned(),
        ]);
        for service in SERVICES {
            readers.insert(format!("rq{full_name}/{service}Request"));
            writers.insert(format!("rr{full_name}/{service}Reply"));
        }
        let mut last = Value::Null;
        loop {
            let Some(heard) = peer.heard(PATIENCE).await else {
                panic!("{full_name} is not found whole: {last}")
            };
            let node: Value = serde_json::from_str(&heard).unwrap();
            if node["node"] != full_name.as_str() {
                continue;
            }
            let is_whole = readers.is_subset(&topics(&node, "readers"))
                && writers.is_subset(&topics(&node, "writers"))
                && topics(&node, "nobodys").is_empty();
            if is_whole {
                break;
            }
            last = node;
        }
        assert!(process.interrupt(), "{name}");
    }
}
