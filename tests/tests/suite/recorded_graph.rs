//! A live graph that is recorded, and what becomes of the recording.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use bag_player::{Bag, BagInfo, OfferedQos};
use msgs::convert::stamp_from_time;
use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::sensor_msgs::LaserScan;
use msgs::stillmap_msgs::StageReport;
use node_shell::{Node, Qos, RosArguments, Subscription};
use rustix::process::Signal;
use serde_json::Value;
use tokio::time::timeout;

use crate::bags::messages_of;
use crate::playing::{number, play};
use crate::program::{Running, succeed};
use crate::python::python_with;
use crate::sensors::Sensors;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// A bag that is played is over when nothing has come for this long, if its last message was lost.
const SILENCE: Duration = Duration::from_secs(20);
/// What is recorded, in the order of the names; and how many messages of each at least.
const TOPICS: [&str; 3] = ["points", "pose", "scan"];
const ENOUGH: u64 = 20;

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

/// Waits until the recorder says that it has enough of each topic.
async fn has_enough(reports: &Subscription<DiagnosticArray>, namespace: &str) {
    let recorder = format!("{namespace}/bag_recorder");
    let received = async {
        loop {
            let report = reports.next().await.message;
            let count = |name| number(&report, &recorder, &format!("received {namespace}/{name}"));
            if TOPICS.into_iter().all(|name| count(name) >= Some(ENOUGH)) {
                break;
            }
        }
    };
    timeout(PATIENCE, received).await.expect("all topics are recorded");
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
    let ear = node(&namespace, "ear");
    let reports = ear.subscription("/diagnostics", &Qos::reliable(200)).unwrap();
    let sensors = Sensors::start(node(&namespace, "sensors"));
    let path = folder.path().join("room.mcap");
    let rule = format!("__ns:={namespace}");
    let bag = path.to_str().unwrap();
    // A remapping holds for the names of topics, too.
    let topics = "points,pose,front_scan";
    let line = ["record", "-o", bag, "--topics", topics, "--ros-args", "-r", &rule];
    let recorder = Running::start(line.iter().chain(&["-r", "front_scan:=scan"]));
    exists(&folder.path().join("room.mcap.tmp")).await;
    has_enough(&reports, &namespace).await;
    assert!(!path.exists());
    // 3: some of what is sent with best effort was lost, as on a machine that is out of CPU time.
    let code = recorder.end(Signal::INT).code();
    assert!(matches!(code, Some(0 | 3)), "{code:?}");
    sensors.end().await;

    let info = Bag::open(&path).unwrap().info().unwrap();
    assert_eq!((info.losses.len(), info.topics.len()), (0, TOPICS.len()));
    for (topic, name) in info.topics.iter().zip(TOPICS) {
        assert_eq!(topic.topic, format!("{namespace}/{name}"));
        assert!(topic.message_count >= ENOUGH, "{name}: {} messages", topic.message_count);
        println!("{name}: {} messages, {:?} Hz", topic.message_count, topic.rate_hz);
    }
    others_read_it(&path, &info);
    let shown = succeed(["info", bag]);
    assert!(shown.contains(&format!("{namespace}/scan")), "{shown}");

    // Once more, onto the graph.
    let scan = format!("{namespace}/scan");
    let recorded = messages_of::<LaserScan>(&path, &scan);
    let count = recorded.len();
    let mut scans = BTreeMap::new();
    for (logged, scan) in recorded {
        let stamp = stamp_from_time(scan.header.stamp);
        assert!(stamp <= logged, "a scan of {stamp:?} is logged at {logged:?}");
        scans.insert(stamp, scan);
    }
    assert_eq!(scans.len(), count, "each scan is recorded once");
    let last = *scans.keys().next_back().unwrap();
    let heard = ear.subscription::<LaserScan>("again", &Qos::sensor(100)).unwrap();
    let mut arguments = play(&path, &namespace, &[(scan.as_str(), "again")]);
    arguments.push(format!("--pace={scan}={namespace}/go"));
    let player = Running::start(arguments);
    // The player waits for this publisher: what is sent with best effort before both ends know each other is lost.
    timeout(PATIENCE, heard.wait_for_publishers(1)).await.expect("the player is there");
    let go = ear.publisher::<StageReport>("go", &Qos::reliable(100)).unwrap();
    timeout(PATIENCE, go.wait_for_subscribers(1)).await.expect("the player is paced");
    let (mut again, mut patience) = (Vec::new(), PATIENCE);
    while again.last() != Some(&last)
        && let Ok(received) = timeout(patience, heard.next()).await
    {
        let stamp = stamp_from_time(received.message.header.stamp);
        assert_eq!(Some(&*received.message), scans.get(&stamp));
        again.push(stamp);
        go.publish_or_warn(StageReport::default());
        patience = SILENCE;
    }
    println!("{} of {count} scans were played again", again.len());
    assert!(again.len() > count / 2, "{} of {count} scans", again.len());
    assert!(again.is_sorted_by(|one, next| one < next), "in their order, each once");
    assert!(player.wait().success());
    drop((heard, go, reports));
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
