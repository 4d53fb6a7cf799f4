//! The parameters of a node of ours, read and set by a peer as `ros2 param` does.

use std::collections::BTreeSet;
use std::time::Duration;

use msgs::RosMessage;
use msgs::rcl_interfaces::{
    DescribeParameters, GetParameterTypes, GetParameters, ListParameters, ParameterEvent,
    ParameterType, ParameterValue, SetParameters, SetParametersAtomically,
};
use msgs::std_srvs::Trigger;
use node_shell::{Node, NodeFailure, Shutdown};
use reconstruction::shell::{ReconstructionParameters, serve};
use serde_json::{Value, json};
use tokio::task::JoinHandle;

use super::build::Make;
use super::peer::Peer;
use super::place::{GREETINGS, LONGEST_GREETING, Place};

const EVENTS: &str = "/parameter_events";

/// A node of ours that serves, and a peer that asks it.
struct Asked {
    peer: Peer,
    node_name: String,
    shutdown: Shutdown,
    serving: JoinHandle<Result<(), NodeFailure>>,
}

impl Asked {
    async fn start(place: &Place) -> Option<Self> {
        let topics = [EVENTS, ParameterEvent::TYPE_NAME];
        let peer = Peer::start(Make::CyclonePython, "call", place, &topics).await?;
        let node = place.node("reconstruction");
        let (node_name, shutdown) = (node.full_name(), node.shutdown_signal());
        Some(Self { peer, node_name, shutdown, serving: tokio::spawn(serving(node)) })
    }

    fn service(&self, name: &str) -> String {
        format!("{}/{name}", self.node_name)
    }

    async fn values(&mut self, names: &[&str]) -> Vec<Value> {
        let service = self.service("get_parameters");
        let answer = self.peer.call::<GetParameters>(&service, json!({ "names": names })).await;
        answer["values"].as_array().unwrap().clone()
    }

    /// Whether each was set, or why not.
    async fn set(&mut self, wanted: &[Value]) -> Vec<Value> {
        let service = self.service("set_parameters");
        let request = json!({ "parameters": wanted });
        let answer = self.peer.call::<SetParameters>(&service, request).await;
        answer["results"].as_array().unwrap().clone()
    }

    async fn set_atomically(&mut self, wanted: &[Value]) -> Value {
        let service = self.service("set_parameters_atomically");
        let request = json!({ "parameters": wanted });
        let answer = self.peer.call::<SetParametersAtomically>(&service, request).await;
        answer["result"].clone()
    }

    async fn end(self) {
        self.shutdown.trigger();
        self.serving.await.unwrap().unwrap();
    }
}

async fn serving(node: Node) -> Result<(), NodeFailure> {
    let result = serve(&node, ReconstructionParameters::default()).await;
    node.close().await;
    result
}

fn parameter(name: &str, kind: u8, field: &str, value: &Value) -> Value {
    let mut message = serde_json::to_value(ParameterValue { r#type: kind, ..Default::default() });
    let message = message.as_mut().unwrap();
    assert!(message[field] != Value::Null, "there is no field {field}");
    message[field] = value.clone();
    json!({ "name": name, "value": message })
}

fn whole(name: &str, value: i64) -> Value {
    parameter(name, ParameterType::PARAMETER_INTEGER, "integer_value", &json!(value))
}

fn fractional(name: &str, value: f64) -> Value {
    parameter(name, ParameterType::PARAMETER_DOUBLE, "double_value", &json!(value))
}

fn text(name: &str, value: &str) -> Value {
    parameter(name, ParameterType::PARAMETER_STRING, "string_value", &json!(value))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_reads_what_the_parameters_are() {
    let place = Place::new().await;
    let Some(mut asked) = Asked::start(&place).await else { return };
    let expected = node_shell::descriptors::<ReconstructionParameters>().unwrap();
    let names: Vec<&str> = expected.iter().map(|one| one.name.as_str()).collect();

    let service = asked.service("list_parameters");
    let all = json!({ "prefixes": [], "depth": 0 });
    let listed = asked.peer.call::<ListParameters>(&service, all).await;
    let listed: BTreeSet<&str> = listed["result"]["names"]
        .as_array()
        .unwrap()
        .iter()
        .map(|name| name.as_str().unwrap())
        .collect();
    assert_eq!(listed, names.iter().copied().collect());

    let service = asked.service("describe_parameters");
    let described =
        asked.peer.call::<DescribeParameters>(&service, json!({ "names": names })).await;
    assert_eq!(described["descriptors"], serde_json::to_value(&expected).unwrap());
    let of =
        |name: &str| &described["descriptors"][names.iter().position(|one| *one == name).unwrap()];
    assert_eq!(of("voxel_edge_m")["read_only"], true);
    assert_eq!(of("map_file")["read_only"], false);
    assert!(of("method")["additional_constraints"].as_str().unwrap().contains("`stillmap`"));

    let service = asked.service("get_parameter_types");
    let some =
        json!({ "names": ["voxel_edge_m", "max_voxels", "method", "use_sim_time", "no_such"] });
    let types = asked.peer.call::<GetParameterTypes>(&service, some).await;
    assert_eq!(types["types"], json!([3, 2, 4, 1, 0]));

    let values =
        asked.values(&["voxel_edge_m", "max_voxels", "method", "use_sim_time", "no_such"]).await;
    assert_eq!(values[0]["double_value"], 0.08);
    assert_eq!(values[1]["integer_value"], 1_000_000);
    assert_eq!(values[2]["string_value"], "rec_hv");
    assert_eq!(values[3]["bool_value"], false);
    assert_eq!(values[4], serde_json::to_value(ParameterValue::default()).unwrap());
    asked.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_sets_parameters_and_hears_of_it() {
    let place = Place::new().await;
    let Some(mut asked) = Asked::start(&place).await else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("map.ply");

    let results = asked
        .set(&[
            whole("map_update_max_points", 5),
            fractional("voxel_edge_m", 0.1),
            text("map_file", "map.txt"),
            // A whole number does for a fractional one.
            whole("map_update_period_s", 2),
            text("map_fil", "map.ply"),
        ])
        .await;
    let is_set: Vec<_> = results.iter().map(|one| one["successful"].as_bool().unwrap()).collect();
    assert_eq!(is_set, [true, false, false, true, false], "{results:?}");
    for (index, part) in [(1, "cannot change while"), (2, ".pcd"), (4, "did you mean `map_file`")] {
        let reason = results[index]["reason"].as_str().unwrap();
        assert!(reason.contains(part), "{reason}");
    }
    let names = ["map_update_max_points", "voxel_edge_m", "map_file", "map_update_period_s"];
    let values = asked.values(&names).await;
    assert_eq!(
        (&values[0]["integer_value"], &values[1]["double_value"]),
        (&json!(5), &json!(0.08))
    );
    assert_eq!((&values[2]["string_value"], &values[3]["double_value"]), (&json!(""), &json!(2.0)));

    let refused = asked
        .set_atomically(&[text("map_file", "other.ply"), whole("map_update_max_points", 0)])
        .await;
    assert_eq!(refused["successful"], false);
    assert!(refused["reason"].as_str().unwrap().contains("at least 1"), "{refused}");
    assert_eq!(asked.values(&["map_file"]).await[0]["string_value"], "");

    // The node goes by what was set: it saves its map there.
    let wanted = [text("map_file", file.to_str().unwrap()), whole("map_update_max_points", 7)];
    let mut event = None;
    for _ in 0..GREETINGS {
        let result = asked.set_atomically(&wanted).await;
        assert_eq!(result, json!({ "successful": true, "reason": "" }));
        while let Some(heard) = asked.peer.heard(LONGEST_GREETING).await {
            event = Some(serde_json::from_str::<Value>(&heard).unwrap()[1].clone());
        }
        if event.is_some() {
            break;
        }
    }
    let event = event.expect("the peer hears of the change");
    assert_eq!(event["node"], asked.node_name.as_str());
    assert_eq!(event["changed_parameters"], json!(wanted));
    assert_eq!((&event["new_parameters"], &event["deleted_parameters"]), (&json!([]), &json!([])));
    assert!(event["stamp"]["sec"].as_i64().unwrap() > 0);

    let service = asked.service("save_map");
    let request = json!({ "structure_needs_at_least_one_member": 0 });
    let saved = asked.peer.call::<Trigger>(&service, request).await;
    assert_eq!(saved["success"], true, "{saved}");
    assert!(file.is_file());
    asked.end().await;
}

/// Every node has what every node of ROS 2 has.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_ends_in_time_while_it_is_asked() {
    let place = Place::new().await;
    let Some(mut asked) = Asked::start(&place).await else { return };
    asked.values(&["method"]).await;
    let ending = std::time::Instant::now();
    asked.end().await;
    assert!(ending.elapsed() < Duration::from_secs(1), "{:?}", ending.elapsed());
}
