//! Live graphs of foreign peers with one fault each, and a healthy one.

use std::process::Output;

use futures::future::join_all;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan};
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;
use msgs::{RosMessage, std_msgs};
use serde::Serialize;
use serde_json::{Value, json};

use super::plant::transform;
use super::{Place, ensure, json as report_of};
use crate::foreign::build::Make;
use crate::foreign::peer::Peer;

/// A publisher of a message that is stamped as it is sent.
fn publisher<M: RosMessage + Serialize>(topic: &str, message: &M) -> Value {
    json!({
        "topic": topic, "type": M::TYPE_NAME, "reliability": "reliable", "durability": "volatile",
        "message": message, "offset_s": 0.0
    })
}

fn subscription<M: RosMessage>(topic: &str) -> Value {
    json!({
        "topic": topic, "type": M::TYPE_NAME, "reliability": "reliable", "durability": "volatile",
        "message": null, "offset_s": null
    })
}

/// The same with another value under a key.
fn with(mut end: Value, key: &str, value: impl Into<Value>) -> Value {
    end[key] = value.into();
    end
}

fn named(node: &str, gid_bytes: u8) -> Value {
    json!({ "node": node, "gid_bytes": gid_bytes })
}

fn header(frame_id: &str) -> Header {
    Header { frame_id: frame_id.to_owned(), ..Header::default() }
}

fn scan() -> LaserScan {
    LaserScan {
        header: header("laser"),
        angle_min: -0.5,
        angle_max: 0.5,
        angle_increment: 0.1,
        range_min: 0.1,
        range_max: 8.0,
        ranges: vec![2.0; 11],
        ..LaserScan::default()
    }
}

fn pose() -> PoseStamped {
    let mut pose = PoseStamped { header: header("map"), ..PoseStamped::default() };
    pose.pose.orientation.w = 1.0;
    pose
}

fn image() -> Image {
    Image {
        header: header("camera"),
        height: 2,
        width: 4,
        encoding: "16UC1".to_owned(),
        step: 8,
        data: [0xd0, 0x07].repeat(8),
        ..Image::default()
    }
}

fn camera() -> CameraInfo {
    CameraInfo {
        header: header("camera"),
        height: 2,
        width: 4,
        distortion_model: "plumb_bob".to_owned(),
        d: vec![0.0; 5],
        k: [3.0, 0.0, 1.5, 0.0, 3.0, 0.5, 0.0, 0.0, 1.0],
        ..CameraInfo::default()
    }
}

/// The ends of a robot's drivers in a namespace; the scanner's stands first.
fn drivers(namespace: &str) -> Vec<Value> {
    let name = |topic: &str| format!("{namespace}/{topic}");
    vec![
        publisher(&name("scan"), &scan()),
        publisher(&name("pose"), &pose()),
        publisher(&name("depth/image"), &image()),
        publisher(&name("depth/camera_info"), &camera()),
        named(&name("drivers"), 16),
    ]
}

fn tf(parent: &str, child: &str) -> TFMessage {
    let stamp = geometry::Stamp::from_nanos(0);
    TFMessage { transforms: vec![transform(stamp, parent, child, [0.1, 0.0, 0.0, 0.0, 0.0, 0.0])] }
}

fn fixed(parent: &str, child: &str) -> Value {
    with(publisher("/tf_static", &tf(parent, child)), "durability", "transient_local")
}

/// A fault of a graph, and how it is found.
struct Fault {
    name: &'static str,
    /// The ends of each peer.
    peers: fn(&str) -> Vec<Vec<Value>>,
    severity: &'static str,
    check: &'static str,
    says: &'static [&'static str],
}

/// The drivers with another scanner.
fn scanner(namespace: &str, change: impl FnOnce(&mut Value)) -> Vec<Vec<Value>> {
    let mut ends = drivers(namespace);
    change(&mut ends[0]);
    vec![ends]
}

fn beside(namespace: &str, ends: impl IntoIterator<Item = Value>) -> Vec<Vec<Value>> {
    vec![drivers(namespace).into_iter().chain(ends).collect()]
}

const OFFERS: &[Fault] = &[
    Fault {
        name: "less is offered than requested",
        peers: |namespace| {
            let topic = format!("{namespace}/scan");
            let mut peers = scanner(namespace, |scan| scan["reliability"] = json!("best_effort"));
            peers[0].push(subscription::<LaserScan>(&topic));
            peers
        },
        severity: "error",
        check: "qos",
        says: &["/scan", "best effort", "requests reliable"],
    },
    Fault {
        name: "another type under the name of the scan",
        peers: |namespace| {
            let topic = format!("{namespace}/scan");
            beside(namespace, [subscription::<std_msgs::String>(&topic)])
        },
        severity: "error",
        check: "types",
        says: &["/scan has 2 types", "std_msgs/msg/String", "-r"],
    },
    Fault {
        name: "nobody publishes what somebody reads",
        peers: |namespace| {
            let mut peers = scanner(namespace, |_| {});
            peers[0][0] = subscription::<LaserScan>(&format!("{namespace}/scan"));
            peers
        },
        severity: "error",
        check: "inputs",
        says: &["nobody publishes", "/scan", "start the driver of scan"],
    },
    Fault {
        name: "two scanners on one topic",
        peers: |namespace| {
            let second = publisher(&format!("{namespace}/scan"), &scan());
            scanner(namespace, |_| {}).into_iter().chain([vec![second]]).collect()
        },
        severity: "warn",
        check: "publishers",
        says: &["/scan has 2 publishers"],
    },
    Fault {
        name: "two nodes of one name",
        peers: |namespace| {
            let second = publisher(&format!("{namespace}/scan_2"), &scan());
            let name = named(&format!("{namespace}/drivers"), 16);
            scanner(namespace, |_| {}).into_iter().chain([vec![second, name]]).collect()
        },
        severity: "warn",
        check: "nodes",
        says: &["2 nodes have the name", "/drivers (participants", "__node:=drivers_2"],
    },
    Fault {
        name: "a node of an older release",
        peers: |namespace| {
            let mut ends = drivers(namespace);
            ends.pop();
            ends.push(named(&format!("{namespace}/drivers"), 24));
            vec![ends]
        },
        severity: "warn",
        check: "versions",
        says: &["before Iron", "ROS_DISTRO"],
    },
];

const READINGS: &[Fault] = &[
    Fault {
        name: "nothing is stamped",
        peers: |namespace| scanner(namespace, |scan| scan["offset_s"] = Value::Null),
        severity: "error",
        check: "stamps",
        says: &["/scan", "have the stamp 0"],
    },
    Fault {
        name: "a clock that is ahead",
        peers: |namespace| scanner(namespace, |scan| scan["offset_s"] = json!(2.0)),
        severity: "error",
        check: "clocks",
        says: &["/scan: its stamps are", "s ahead of those", "chrony"],
    },
    Fault {
        name: "no frame",
        peers: |namespace| {
            scanner(namespace, |scan| scan["message"]["header"]["frame_id"] = json!(""))
        },
        severity: "error",
        check: "frames",
        says: &["/scan: frame_id is empty"],
    },
    Fault {
        name: "millimetres",
        peers: |namespace| {
            scanner(namespace, |scan| scan["message"]["ranges"] = json!(vec![2000.0; 11]))
        },
        severity: "error",
        check: "units",
        says: &["/scan: the median range is 2000 m", "millimetres"],
    },
    Fault {
        name: "transforms in a loop",
        peers: |namespace| beside(namespace, [fixed("base", "laser"), fixed("laser", "base")]),
        severity: "error",
        check: "transforms",
        says: &["base -> laser -> base is a loop"],
    },
    Fault {
        name: "a sensor that tf does not know",
        peers: |namespace| beside(namespace, [fixed("base", "camera")]),
        severity: "warn",
        check: "frames",
        says: &["/scan: its frame laser", "static_transform_publisher"],
    },
    Fault {
        name: "fixed transforms that are not latched",
        peers: |namespace| beside(namespace, [publisher("/tf_static", &tf("base", "laser"))]),
        severity: "warn",
        check: "qos",
        says: &["/tf_static", "volatile", "transient local"],
    },
];

/// Lets the doctor look at a graph, where there are such peers. `judge` gets its report and its exit code.
async fn examine(
    peers: fn(&str) -> Vec<Vec<Value>>,
    judge: impl Fn(&Value, i32) -> Result<(), String>,
) -> Result<(), String> {
    let place = Place::new();
    let mut running = Vec::new();
    for ends in peers(&place.namespace) {
        let domain_id = place.domain.number();
        let Some(mut peer) = Peer::start_on(Make::CyclonePython, "graph", domain_id, &[]).await
        else {
            return Ok(());
        };
        ends.iter().for_each(|end| peer.tell(&end.to_string()));
        for _ in ends {
            peer.wait_for("created").await;
        }
        running.push(peer);
    }
    let judge = |output: &Output| judge(&report_of(output), output.status.code().unwrap());
    let outcome = place.examine(&["--json", "--measure"], &[], || {}, judge).await;
    tokio::task::spawn_blocking(|| drop(running)).await.unwrap();
    outcome.map_err(|said| format!("{}: {said}", place.namespace))
}

async fn is_found(fault: &Fault) -> Result<(), String> {
    let judge = |report: &Value, code| {
        let findings = report["findings"].as_array().unwrap();
        let is_it = |finding: &Value| {
            let line = format!("{} {}", finding["what"], finding["fix"]);
            finding["check"] == fault.check
                && finding["severity"] == fault.severity
                && fault.says.iter().all(|part| line.contains(part))
        };
        let expected = if report["tally"]["errors"] == 0 { 3 } else { 1 };
        let is_found = findings.iter().any(is_it) && code == expected;
        ensure(is_found, format!("{} (exit code {code}): {findings:#?}", fault.name))
    };
    examine(fault.peers, judge).await
}

async fn all_are_found(faults: &[Fault]) {
    let outcomes = join_all(faults.iter().map(is_found)).await;
    let missed: Vec<String> = outcomes.into_iter().filter_map(Result::err).collect();
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn faults_of_foreign_offers_are_found() {
    all_are_found(OFFERS).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn faults_of_foreign_readings_are_found() {
    all_are_found(READINGS).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_is_found_in_a_healthy_foreign_graph() {
    let healthy =
        |namespace: &str| beside(namespace, [fixed("base", "laser"), fixed("base", "camera")]);
    // What the machine grants is the machine's.
    const MACHINE: [&str; 6] =
        ["receive_buffer", "send_buffer", "fragments", "dropped", "ports", "interfaces"];
    let judge = |report: &Value, _| {
        let findings = report["findings"].as_array().unwrap();
        for finding in findings {
            let is_machines = MACHINE.contains(&finding["check"].as_str().unwrap());
            ensure(is_machines || finding["severity"] == "ok", finding)?;
        }
        let tells = |part: &str| {
            let mut said = findings.iter().map(|finding| finding["what"].as_str().unwrap());
            ensure(said.any(|what| what.contains(part)), report)
        };
        tells("all topics that the suite reads are published")?;
        tells("tf has 2 frames, all of them connected")
    };
    examine(healthy, judge).await.unwrap_or_else(|said| panic!("{said}"));
}
