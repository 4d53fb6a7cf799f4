//! The lifecycle of the nodes, managed by a peer as `ros2 lifecycle` and Nav2's manager do.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use geometry::Stamp;
use msgs::RosMessage;
use msgs::builtin_interfaces::Time;
use msgs::convert;
use msgs::lifecycle_msgs::{
    ChangeState, GetAvailableStates, GetAvailableTransitions, GetState, TransitionEvent,
};
use msgs::rcl_interfaces::Log;
use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::ReducedCloud;
use nalgebra::{Isometry3, Point3};
use node_shell::{Node, Qos, Shutdown};
use segmentation::shell::{SegmentationParameters, serve};
use serde_json::{Value, json};
use tokio::task::JoinHandle;

use super::build::Make;
use super::peer::Peer;
use super::place::{GREETINGS, PATIENCE, Place};
use crate::program::Running;

const ROSOUT: &str = "/rosout";

/// Cycles come ten times as often.
const SILENCE: Duration = Duration::from_millis(500);
const CYCLE_PERIOD: Duration = Duration::from_millis(50);
/// Between the stamps of two cycles.
const STAMP_PERIOD_S: f64 = 0.1;

/// A peer that manages nodes.
struct Manager {
    peer: Peer,
}

impl Manager {
    async fn ask<S: msgs::RosService>(&mut self, node: &str, service: &str) -> Value {
        let request = json!({ "structure_needs_at_least_one_member": 0 });
        self.peer.call::<S>(&format!("{node}/{service}"), request).await
    }

    async fn state(&mut self, node: &str) -> Value {
        self.ask::<GetState>(node, "get_state").await["current_state"].clone()
    }

    /// Asks for a transition by its number, or by its label.
    async fn change(&mut self, node: &str, id: u8, label: &str) -> bool {
        let request = json!({ "transition": { "id": id, "label": label } });
        let answer = self.peer.call::<ChangeState>(&format!("{node}/change_state"), request).await;
        answer["success"].as_bool().unwrap()
    }

    /// What was heard on a topic, until nothing more comes of any.
    async fn heard_on(&mut self, topic: &str) -> Vec<Value> {
        let mut found = Vec::new();
        while let Some(heard) = self.peer.heard(SILENCE).await {
            let heard: Value = serde_json::from_str(&heard).unwrap();
            if heard[0] == topic {
                found.push(heard[1].clone());
            }
        }
        found
    }

    /// Expects that no cloud of this cycle or a later one is heard on a topic, until nothing more comes of any.
    async fn hears_of_no_cycle_from(&mut self, first: u64, topic: &str) {
        while let Some(heard) = self.peer.heard(SILENCE).await {
            let heard: Value = serde_json::from_str(&heard).unwrap();
            assert!(heard[0] != topic || cycle_of(&heard[1]) < first, "from {first} on: {heard}");
        }
    }

    /// Waits until such a message is heard on a topic.
    async fn hears(&mut self, topic: &str, is_it: impl Fn(&Value) -> bool) {
        loop {
            let heard = self.peer.heard(PATIENCE).await.expect("it is heard");
            let heard: Value = serde_json::from_str(&heard).unwrap();
            if heard[0] == topic && is_it(&heard[1]) {
                return;
            }
        }
    }
}

fn labels(described: &Value, list: &str) -> Vec<String> {
    let transition = |one: &Value| {
        let [start, label, goal] = [&one["start_state"], &one["transition"], &one["goal_state"]]
            .map(|part| &part["label"]);
        format!("{start} {label} {} {goal}", one["transition"]["id"]).replace('"', "")
    };
    described[list].as_array().unwrap().iter().map(transition).collect()
}

fn stamp_of(index: u32) -> Stamp {
    Stamp::from_nanos(1_000_000_000).plus_seconds(f64::from(index) * STAMP_PERIOD_S)
}

fn reduced_cloud(index: u32) -> ReducedCloud {
    let stamp = stamp_of(index);
    convert::message_from_detected_cycle(&geometry::DetectedCycle {
        depth: None,
        scan_rays: std::sync::Arc::default(),
        index,
        scan_stamp: stamp,
        reduced_cloud: geometry::Cloud {
            stamp,
            frame_id: "rig".to_owned(),
            points_m: vec![Point3::new(2.0, 0.0, 0.0)],
        },
        voxel_points: vec![1],
        points_before_reduction: 1,
        map_from_rig: Isometry3::identity(),
        map_from_continuous: None,
        map_frame_id: "map".to_owned(),
        setup: geometry::CycleSetup::default(),
        zones: Vec::new(),
        moving_beams: Vec::new(),
    })
}

/// The index of the cycle that a cloud is of.
fn cycle_of(cloud: &Value) -> u64 {
    let stamp: Time = serde_json::from_value(cloud["header"]["stamp"].clone()).unwrap();
    let since_first = convert::stamp_from_time(stamp).seconds_since(stamp_of(0));
    (since_first / STAMP_PERIOD_S).round() as u64
}

/// Cycles without an end; `begun` is how many have been published, or are about to be.
fn feeding(node: Node, stop: &Shutdown, begun: &Arc<AtomicU64>) -> JoinHandle<()> {
    let (stop, begun) = (stop.clone(), Arc::clone(begun));
    tokio::spawn(async move {
        let clouds = node.publisher::<ReducedCloud>("reduced_cloud", &Qos::reliable(5)).unwrap();
        let feed = async {
            for index in 0.. {
                begun.store(u64::from(index) + 1, Ordering::SeqCst);
                clouds.publish_or_warn(reduced_cloud(index));
                tokio::time::sleep(CYCLE_PERIOD).await;
            }
        };
        tokio::select! {
            () = stop.wait() => {}
            () = feed => {}
        }
        drop(clouds);
        node.close().await;
    })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_brings_a_node_up_lets_it_pause_and_ends_it() {
    let place = Place::new().await;
    let name = format!("{}/segmentation", place.namespace());
    let (events, clouds) =
        (format!("{name}/transition_event"), format!("{}/static_cloud", place.namespace()));
    let topics =
        [events.as_str(), TransitionEvent::TYPE_NAME, clouds.as_str(), PointCloud2::TYPE_NAME];
    let Some(peer) = Peer::start(Make::CyclonePython, "call", &place, &topics).await else {
        return;
    };
    let mut manager = Manager { peer };
    let stop = Shutdown::new();
    let begun = Arc::default();
    let feeding = feeding(place.node("feeder"), &stop, &begun);
    let node = place.node_with("segmentation", &["-p", "autostart:=false"]);
    let serving = tokio::spawn(async move {
        let result = serve(&node, SegmentationParameters::default()).await;
        node.close().await;
        result
    });

    // What it is, and what it can be.
    assert_eq!(manager.state(&name).await, json!({ "id": 1, "label": "unconfigured" }));
    let states = manager.ask::<GetAvailableStates>(&name, "get_available_states").await;
    let states = states["available_states"].as_array().unwrap();
    assert_eq!(states.len(), 11);
    assert!(states.contains(&json!({ "id": 15, "label": "errorprocessing" })));
    let possible = manager.ask::<GetAvailableTransitions>(&name, "get_available_transitions").await;
    let possible = labels(&possible, "available_transitions");
    let expected = ["unconfigured configure 1 configuring", "unconfigured shutdown 5 shuttingdown"];
    assert_eq!(possible, expected);
    let graph = manager.ask::<GetAvailableTransitions>(&name, "get_transition_graph").await;
    let graph = labels(&graph, "available_transitions");
    assert_eq!(graph.len(), 25);
    assert_eq!(graph[1], "configuring transition_success 10 inactive");
    assert_eq!(graph[24], "errorprocessing transition_error 62 finalized");

    // Unconfigured and inactive it does nothing, although there is something to do.
    assert!(!manager.change(&name, 3, "").await, "it is not configured");
    manager.hears_of_no_cycle_from(0, &clouds).await;
    assert!(manager.change(&name, 1, "").await);
    assert_eq!(manager.state(&name).await, json!({ "id": 2, "label": "inactive" }));
    manager.hears_of_no_cycle_from(0, &clouds).await;

    // Active it works, until it is to cease, and then again.
    let mut first = 0;
    for _ in 0..2 {
        assert!(manager.change(&name, 0, "activate").await);
        assert_eq!(manager.state(&name).await, json!({ "id": 3, "label": "active" }));
        manager.hears(&clouds, |cloud| cycle_of(cloud) >= first).await;
        assert!(manager.change(&name, 4, "").await);
        // What was sent before may come late; the cycles from now on are not worked on.
        first = begun.load(Ordering::SeqCst);
        manager.hears_of_no_cycle_from(first, &clouds).await;
    }

    // It tells of each step; a reader of Cyclone DDS may lose the first ones.
    let expected = [
        "inactive cleanup 2 cleaningup",
        "cleaningup transition_success 20 unconfigured",
        "unconfigured configure 1 configuring",
        "configuring transition_success 10 inactive",
    ];
    // Those of one turn may be heard in the next.
    let (mut told, mut steps) = (Vec::new(), Vec::new());
    for _ in 0..GREETINGS {
        assert!(manager.change(&name, 2, "").await);
        assert!(manager.change(&name, 1, "").await);
        told.extend(manager.heard_on(&events).await);
        steps = told.iter().map(|one| labels(&json!({ "one": [one] }), "one").remove(0)).collect();
        if steps.windows(expected.len()).any(|steps| steps == expected) {
            break;
        }
    }
    assert!(steps.windows(expected.len()).any(|steps| steps == expected), "{steps:?}");
    assert!(told[0]["timestamp"].as_u64().unwrap() > 1_700_000_000_000_000_000);

    assert!(manager.change(&name, 6, "").await);
    let ended = tokio::time::timeout(PATIENCE, serving).await.expect("the node ends by itself");
    ended.unwrap().unwrap();
    stop.trigger();
    feeding.await.unwrap();
}

/// The nodes of the suite, each as a process of its own.
const NODES: [&str; 6] =
    ["detection", "segmentation", "reconstruction", "pose", "lidar_odometry", "compression"];

/// What each of them does is told on `/rosout`, too.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_node_is_managed() {
    let place = Place::new().await;
    let topics = [ROSOUT, Log::TYPE_NAME];
    let Some(peer) = Peer::start(Make::CyclonePython, "call", &place, &topics).await else {
        return;
    };
    let mut manager = Manager { peer };
    let rule = format!("__ns:={}", place.namespace());
    for node in NODES {
        let program = node.replace('_', "-");
        let line = ["node", &program, "--ros-args", "-r", &rule, "-p", "autostart:=false"];
        let process = Running::start_on(place.domain_id(), line);
        let name = format!("{}/{node}", place.namespace());
        for (id, label, state) in [
            (1, "configure", "inactive"),
            (3, "activate", "active"),
            (4, "deactivate", "inactive"),
            (2, "cleanup", "unconfigured"),
            (1, "configure", "inactive"),
            (3, "activate", "active"),
        ] {
            // A request that was sent again, its answer being late, is refused the second time: the state counts.
            let is_done = manager.change(&name, id, "").await;
            assert_eq!(manager.state(&name).await["label"], state, "{node} {label}: {is_done}");
        }
        let logger = name.trim_start_matches('/').replace('/', ".");
        let is_it = |line: &Value| {
            line["name"] == logger.as_str()
                && line["level"] == Log::INFO
                && line["msg"].as_str().unwrap().ends_with("it was inactive, and is active")
        };
        manager.hears(ROSOUT, is_it).await;
        assert!(manager.change(&name, 7, "").await);
        assert!(process.wait().success(), "{node}");
    }
}

/// By default all are active; whoever ends one ends the process, as on a signal: nothing was mapped, so that no map is saved.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_suite_in_one_process_starts_by_itself_and_ends_as_it_is_asked() {
    let place = Place::new().await;
    let Some(peer) = Peer::start(Make::CyclonePython, "call", &place, &[]).await else { return };
    let mut manager = Manager { peer };
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.ply");
    let rule = format!("__ns:={}", place.namespace());
    let save = format!("reconstruction:map_file:={}", map.display());
    let waits = "segmentation:autostart:=false";
    let line = ["up", "--ros-args", "-r", &rule, "-p", &save, "-p", waits];
    let process = Running::start_on(place.domain_id(), line);
    let of = |node: &str| format!("{}/{node}", place.namespace());
    for (node, state) in
        [("detection", "active"), ("segmentation", "unconfigured"), ("reconstruction", "active")]
    {
        assert_eq!(manager.state(&of(node)).await["label"], state, "{node}");
    }
    assert!(manager.change(&of("detection"), 0, "shutdown").await);
    assert!(process.wait().success());
    assert!(!map.exists());
}
