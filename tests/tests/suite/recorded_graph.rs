//! A live graph that is recorded, and what becomes of the recording.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use bag_player::{Bag, BagInfo, OfferedQos, Selection};
use msgs::sensor_msgs::LaserScan;
use node_shell::{Node, Qos, RosArguments};
use rustix::process::Signal;
use serde_json::Value;
use tokio::time::timeout;

use crate::program::{Running, succeed};
use crate::python::python_with;
use crate::sensors::Sensors;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// So long is recorded.
const RECORDED: Duration = Duration::from_secs(3);
/// What the sensors send: poses at 20 Hz, all else at 10 Hz.
const RATES_HZ: [(&str, f64); 3] = [("points", 10.0), ("pose", 20.0), ("scan", 10.0)];

fn node(namespace: &str, name: &str) -> Node {
    let rule = format!("__ns:={namespace}");
    Node::start(name, &RosArguments::parse(["--ros-args", "-r", &rule]).unwrap()).unwrap()
}

async fn exists(path: &Path) {
    let appears = async {
        while !path.exists() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(PATIENCE, appears)
        .await
        .unwrap_or_else(|_| panic!("{} does not appear", path.display()));
}

/// What another's reader finds in the bag is what ours finds.
fn others_read_it(path: &Path, info: &BagInfo) {
    let Some(python) = python_with("mcap") else { return };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/mcap/read.py");
    let output = Command::new(python).args(["-B", script]).arg(path).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&told["profile"], &told["message_count"]),
        (&"ros2".into(), &info.message_count.into())
    );
    assert!(told["chunks"].as_u64().unwrap() > 0);
    let topics = told["topics"].as_object().unwrap();
    assert_eq!(topics.len(), info.topics.len());
    for topic in &info.topics {
        let theirs = &topics[&topic.topic];
        assert_eq!(theirs["type"], topic.type_name.as_str());
        assert_eq!(theirs["count"], topic.message_count);
        assert_eq!(
            (&theirs["encoding"], &theirs["schema_encoding"]),
            (&"cdr".into(), &"ros2msg".into())
        );
        assert!(theirs["schema_bytes"].as_u64().unwrap() > 50, "{theirs}");
        let qos = OfferedQos::from_yaml(theirs["qos"].as_str().unwrap());
        assert_eq!((qos, qos), (topic.qos, Some(OfferedQos::sensor(5))));
        let span_ns = theirs["last_ns"].as_u64().unwrap() - theirs["first_ns"].as_u64().unwrap();
        let rate_hz = (topic.message_count - 1) as f64 / (span_ns as f64 * 1e-9);
        assert!((rate_hz - topic.rate_hz.unwrap()).abs() < 1e-6, "{rate_hz} {:?}", topic.rate_hz);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_recorded_is_read_by_others_and_plays_again() {
    let folder = tempfile::tempdir().unwrap();
    let namespace = format!("/recorded_{}", std::process::id());
    let sensors = Sensors::start(node(&namespace, "sensors"));
    let path = folder.path().join("room.mcap");
    let rule = format!("__ns:={namespace}");
    let bag = path.to_str().unwrap();
    // A remapping holds for the names of topics, too.
    let topics = "points,pose,front_scan";
    let line = ["record", "-o", bag, "--topics", topics, "--ros-args", "-r", &rule];
    let recorder = Running::start(line.iter().chain(&["-r", "front_scan:=scan"]));
    exists(&folder.path().join("room.mcap.tmp")).await;
    tokio::time::sleep(RECORDED).await;
    assert!(!path.exists());
    assert!(recorder.end(Signal::INT).success());
    sensors.end().await;

    let info = Bag::open(&path).unwrap().info().unwrap();
    assert_eq!((info.losses.len(), info.topics.len()), (0, RATES_HZ.len()));
    for (topic, (name, rate_hz)) in info.topics.iter().zip(RATES_HZ) {
        assert_eq!(topic.topic, format!("{namespace}/{name}"));
        let measured_hz = topic.rate_hz.unwrap();
        println!("{name}: {} messages, {measured_hz:.2} Hz", topic.message_count);
        assert!((measured_hz - rate_hz).abs() < 0.2 * rate_hz, "{name}: {measured_hz} Hz");
    }
    others_read_it(&path, &info);
    let shown = succeed(["info", bag]);
    assert!(shown.contains(&format!("{namespace}/scan")), "{shown}");

    // Once more, onto the graph.
    let recorded = Bag::open(&path).unwrap();
    let scans: BTreeMap<i64, LaserScan> = recorded
        .messages(&Selection {
            topics: Some(vec![format!("{namespace}/scan")]),
            ..Selection::default()
        })
        .unwrap()
        .map(|message| {
            let scan: LaserScan = message.unwrap().decode().unwrap();
            (
                i64::from(scan.header.stamp.sec) * 1_000_000_000
                    + i64::from(scan.header.stamp.nanosec),
                scan,
            )
        })
        .collect();
    let ear = node(&namespace, "ear");
    let again = format!("{namespace}/again");
    let heard = ear.subscription::<LaserScan>(&again, &Qos::sensor(100)).unwrap();
    let remap = format!("{namespace}/scan:={again}");
    let player = Running::start(["play", bag, "--rate=3", "--remap", &remap, "--wait-for", &again]);
    for (_, scan) in scans {
        let received = timeout(PATIENCE, heard.next()).await.expect("scans are played");
        assert_eq!(*received.message, scan);
    }
    assert!(player.wait().success());
    drop(heard);
    ear.close().await;
}

/// What a user types wrongly, and what exists already.
#[test]
fn what_cannot_be_recorded_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("room.mcap");
    std::fs::write(&bag, "a bag").unwrap();
    let bag = bag.to_str().unwrap();
    for (line, code, part) in [
        (vec!["record", "-o", bag], 1, "already exists"),
        (vec!["record", "-o", "/no/such/folder/x.mcap"], 1, "/no/such/folder"),
        (vec!["record", "-o", "x.mcap", "--duration", "-1"], 1, "--duration"),
        (vec!["record", "-o", "x.mcap", "--topics", "a b"], 1, "a b"),
        (vec!["record"], 2, "--output"),
    ] {
        let output = crate::program::stillmap(&line);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{line:?}: {stderr}");
        assert!(stderr.contains(part), "{line:?}: {stderr}");
    }
    assert!(!Path::new("x.mcap.tmp").exists(), "what is refused leaves nothing");
}
