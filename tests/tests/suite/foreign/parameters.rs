//! The parameters of a node of ours, read and set by a peer as `ros2 param` does.

use std::collections::BTreeSet;
use std::time::Instant;

use msgs::RosMessage;
use msgs::rcl_interfaces::{
    DescribeParameters, GetParameterTypes, GetParameters, ListParameters, ParameterEvent,
    ParameterType, ParameterValue, SetParameters, SetParametersAtomically,
};
use msgs::std_srvs::Trigger;
use node_shell::{NodeFailure, Shutdown};
use reconstruction::shell::{ReconstructionParameters, serve};
use serde_json::{Value, json};
use tokio::task::JoinHandle;

use super::build::Make;
use super::peer::Peer;
use super::place::{GREETINGS, LONGEST_GREETING, Place};
use crate::ending::LONGEST_END;
use crate::program::Running;

const EVENTS: &str = "/parameter_events";

/// A node of ours that serves, and a peer that asks it.
struct Asked {
    peer: Peer,
    node_name: String,
    shutdown: Shutdown,
    serving: JoinHandle<Result<(), NodeFailure>>,
}

impl Asked {
    async fn start(place: &Place, parameters: ReconstructionParameters) -> Option<Self> {
        let topics = [EVENTS, ParameterEvent::TYPE_NAME];
        let peer = Peer::start(Make::CyclonePython, "call", place, &topics).await?;
        let node = place.node("reconstruction");
        let (node_name, shutdown) = (node.full_name(), node.shutdown_signal());
        Some(Self { peer, node_name, shutdown, serving: tokio::spawn(serving(node, parameters)) })
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

async fn serving(
    node: node_shell::Node,
    parameters: ReconstructionParameters,
) -> Result<(), NodeFailure> {
    let result = serve(&node, parameters).await;
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
    let Some(mut asked) = Asked::start(&place, ReconstructionParameters::default()).await else {
        return;
    };
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
    assert_eq!(of("map_file")["read_only"], true);
    assert_eq!(of("map_save_period_s")["read_only"], false);
    assert!(of("method")["additional_constraints"].as_str().unwrap().contains("`free_space`"));

    let service = asked.service("get_parameter_types");
    let some =
        json!({ "names": ["voxel_edge_m", "max_voxels", "method", "use_sim_time", "no_such"] });
    let types = asked.peer.call::<GetParameterTypes>(&service, some).await;
    assert_eq!(types["types"], json!([3, 2, 4, 1, 0]));

    let values =
        asked.values(&["voxel_edge_m", "max_voxels", "method", "use_sim_time", "no_such"]).await;
    assert_eq!(values[0]["double_value"], 0.08);
    assert_eq!(values[1]["integer_value"], 1_000_000);
    assert_eq!(values[2]["string_value"], "free_space");
    assert_eq!(values[3]["bool_value"], false);
    assert_eq!(values[4], serde_json::to_value(ParameterValue::default()).unwrap());
    asked.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_sets_parameters_and_hears_of_it() {
    let place = Place::new().await;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("map.ply");
    let map_file = file.to_str().unwrap().to_owned();
    let parameters = ReconstructionParameters { map_file, ..Default::default() };
    let Some(mut asked) = Asked::start(&place, parameters).await else { return };

    let results = asked
        .set(&[
            whole("map_update_max_points", 5),
            fractional("voxel_edge_m", 0.1),
            text("grid_file", folder.path().join("grid.yaml").to_str().unwrap()),
            // A whole number does for a fractional one.
            whole("map_update_period_s", 2),
            text("map_fil", "map.ply"),
        ])
        .await;
    let is_set: Vec<_> = results.iter().map(|one| one["successful"].as_bool().unwrap()).collect();
    assert_eq!(is_set, [true, false, false, true, false], "{results:?}");
    let reasons = [
        (1, "cannot change while"),
        (2, "`grid_file` cannot change while"),
        (4, "did you mean `map_file`"),
    ];
    for (index, part) in reasons {
        let reason = results[index]["reason"].as_str().unwrap();
        assert!(reason.contains(part), "{reason}");
    }
    let names = ["map_update_max_points", "voxel_edge_m", "grid_file", "map_update_period_s"];
    let values = asked.values(&names).await;
    assert_eq!(
        (&values[0]["integer_value"], &values[1]["double_value"]),
        (&json!(5), &json!(0.08))
    );
    assert_eq!((&values[2]["string_value"], &values[3]["double_value"]), (&json!(""), &json!(2.0)));

    let refused = asked
        .set_atomically(&[fractional("map_save_period_s", 9.0), whole("map_update_max_points", 0)])
        .await;
    assert_eq!(refused["successful"], false);
    assert!(refused["reason"].as_str().unwrap().contains("must be 1 or more, not 0"), "{refused}");
    assert_eq!(asked.values(&["map_save_period_s"]).await[0]["double_value"], 30.0);

    let wanted = [fractional("map_save_period_s", 8.0), whole("map_update_max_points", 7)];
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

    // The map is saved to the file of the start, whatever a peer asks for.
    let other = folder.path().join("other.ply");
    let refused = asked.set(&[text("map_file", other.to_str().unwrap())]).await;
    assert_eq!(refused[0]["successful"], false);
    let service = asked.service("save_map");
    let request = json!({ "structure_needs_at_least_one_member": 0 });
    let saved = asked.peer.call::<Trigger>(&service, request).await;
    assert_eq!(saved["success"], true, "{saved}");
    assert!(file.is_file() && !other.exists());
    asked.end().await;
}

/// A node, a value that it refuses with the reason, and one that it takes where it has such.
struct Node {
    name: &'static str,
    refused: Value,
    reason: &'static str,
    taken: Option<Value>,
}

fn truth(name: &str, value: bool) -> Value {
    parameter(name, ParameterType::PARAMETER_BOOL, "bool_value", &json!(value))
}

fn nodes() -> [Node; 6] {
    let fixed = |name, refused| Node { name, refused, reason: "cannot change while", taken: None };
    let live = |name, refused, reason, taken| Node { name, refused, reason, taken: Some(taken) };
    [
        live(
            "detection",
            fractional("extrinsics_limit_m", -1.0),
            "extrinsics_limit_m",
            fractional("extrinsics_limit_m", 0.05),
        ),
        fixed("segmentation", whole("max_tracks", 5)),
        live(
            "reconstruction",
            whole("map_update_max_points", 0),
            "must be 1 or more",
            whole("map_update_max_points", 7),
        ),
        fixed("pose", truth("publish_tf", false)),
        fixed("lidar_odometry", truth("publish_tf", false)),
        live("compression", whole("jpeg_quality", 101), "100", whole("jpeg_quality", 80)),
    ]
}

/// Asks a node for all that a node of ROS 2 tells of its parameters, and sets some.
async fn has_parameters(peer: &mut Peer, full_name: &str, node: &Node) {
    let service = |name: &str| format!("{full_name}/{name}");
    let all = json!({ "prefixes": [], "depth": 0 });
    let listed = peer.call::<ListParameters>(&service("list_parameters"), all).await;
    let names = &listed["result"]["names"];
    for of_all in ["use_sim_time", "autostart"] {
        assert!(names.as_array().unwrap().contains(&json!(of_all)), "{full_name}: {names}");
    }
    let of_names = json!({ "names": names });
    let described = service("describe_parameters");
    let described = peer.call::<DescribeParameters>(&described, of_names.clone()).await;
    let values = peer.call::<GetParameters>(&service("get_parameters"), of_names.clone()).await;
    let types = peer.call::<GetParameterTypes>(&service("get_parameter_types"), of_names).await;
    for (index, descriptor) in described["descriptors"].as_array().unwrap().iter().enumerate() {
        assert_eq!(descriptor["name"], names[index], "{full_name}");
        assert_ne!(descriptor["description"], "", "{full_name}: {descriptor}");
        assert_eq!(
            descriptor["type"], values["values"][index]["type"],
            "{full_name}: {descriptor}"
        );
        assert_eq!(descriptor["type"], types["types"][index], "{full_name}: {descriptor}");
    }

    let value_of = json!({ "names": [node.refused["name"]] });
    let before = peer.call::<GetParameters>(&service("get_parameters"), value_of.clone()).await;
    let request = json!({ "parameters": [node.refused] });
    let answer = peer.call::<SetParameters>(&service("set_parameters"), request.clone()).await;
    let each = &answer["results"][0];
    let whole = service("set_parameters_atomically");
    let together = &peer.call::<SetParametersAtomically>(&whole, request).await["result"];
    for result in [each, together] {
        let reason = result["reason"].as_str().unwrap();
        println!("{full_name}: {reason}");
        assert_eq!(result["successful"], false, "{full_name}");
        assert!(reason.contains(node.reason), "{full_name}: {reason}");
    }
    let after = peer.call::<GetParameters>(&service("get_parameters"), value_of.clone()).await;
    assert_eq!(before, after, "{full_name}");
    if let Some(taken) = &node.taken {
        let request = json!({ "parameters": [taken] });
        let answer = peer.call::<SetParametersAtomically>(&whole, request).await;
        assert_eq!(answer["result"], json!({ "successful": true, "reason": "" }), "{full_name}");
        let after = peer.call::<GetParameters>(&service("get_parameters"), value_of).await;
        assert_eq!(after["values"][0], taken["value"], "{full_name}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_reads_and_sets_the_parameters_of_every_node() {
    let place = Place::new().await;
    let Some(mut peer) = Peer::start(Make::CyclonePython, "call", &place, &[]).await else {
        return;
    };
    let rule = format!("__ns:={}", place.namespace());
    for node in nodes() {
        let program = node.name.replace('_', "-");
        let line = ["node", &program, "--ros-args", "-r", &rule];
        let process = Running::start_on(place.domain_id(), line);
        has_parameters(&mut peer, &format!("{}/{}", place.namespace(), node.name), &node).await;
        assert!(process.interrupt(), "{}", node.name);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_ends_in_time_while_it_is_asked() {
    let place = Place::new().await;
    let Some(mut asked) = Asked::start(&place, ReconstructionParameters::default()).await else {
        return;
    };
    asked.values(&["method"]).await;
    let ending = Instant::now();
    asked.end().await;
    assert!(ending.elapsed() < LONGEST_END, "{:?}", ending.elapsed());
}
