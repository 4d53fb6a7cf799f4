//! The doctor on live graphs with planted faults, and on bags.

mod bag_faults;
mod bags;
mod live_faults;
mod plant;

use std::fmt::Display;
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::Duration;

use free_domain::FreeDomain;
use msgs::RosMessage;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan, PointCloud2};
use node_shell::{Node, Publisher, Qos, RosArguments, Subscription, Transport};
use serde_json::Value;

use crate::bags::small_room;
use crate::program::{stillmap, stillmap_with_domain};

/// For how long the doctor listens: longer than discovery and the messages of a graph take. On a machine that is too busy for the
/// first, again and longer.
const LISTENING_S: [&str; 3] = ["6", "20", "60"];
/// How often the test's camera tells of itself meanwhile.
const CAMERA_PERIOD: Duration = Duration::from_millis(50);

/// A domain and a namespace that no other test has.
struct Place {
    domain: FreeDomain,
    namespace: String,
}

impl Place {
    fn new() -> Self {
        static COUNT: AtomicU16 = AtomicU16::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let namespace = format!("/doctor_{}_{count}", std::process::id());
        Self { domain: FreeDomain::new(), namespace }
    }

    fn node(&self, name: &str) -> Node {
        let namespace = format!("__ns:={}", self.namespace);
        let arguments = RosArguments::parse(["--ros-args", "-r", &namespace]).unwrap();
        Node::start_on(Transport::on_domain(self.domain.number()).unwrap(), name, &arguments)
            .unwrap()
    }

    /// Lets the doctor look at this place, while `meanwhile` is done again and again. What is wrong with the output says `judge`:
    /// when it is nothing, the doctor has looked for long enough.
    async fn examine(
        &self,
        options: &[&str],
        variables: &[(&str, &str)],
        meanwhile: impl Fn(),
        judge: impl Fn(&Output) -> Result<(), String>,
    ) -> Result<(), String> {
        let mut outcome = Ok(());
        for seconds in LISTENING_S {
            outcome = judge(&self.listen(seconds, options, variables, &meanwhile).await);
            if outcome.is_ok() {
                break;
            }
        }
        outcome
    }

    async fn listen(
        &self,
        seconds: &str,
        options: &[&str],
        variables: &[(&str, &str)],
        meanwhile: impl Fn(),
    ) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"));
        command
            .args(["doctor", "--seconds", seconds])
            .args(options)
            .args(["--ros-args", "-r", &format!("__ns:={}", self.namespace)])
            .env("ROS_DOMAIN_ID", self.domain.number().to_string())
            .envs(variables.iter().copied())
            .stdin(Stdio::null());
        let running = tokio::task::spawn_blocking(move || command.output().unwrap());
        while !running.is_finished() {
            meanwhile();
            tokio::time::sleep(CAMERA_PERIOD).await;
        }
        running.await.unwrap()
    }

    fn name(&self, topic: &str) -> String {
        format!("{}/{topic}", self.namespace)
    }
}

fn publisher<M: RosMessage>(node: &Node, topic: &str, qos: &Qos) -> Publisher<M> {
    node.publisher(topic, qos).unwrap()
}

fn subscription<M: RosMessage>(node: &Node, topic: &str, qos: &Qos) -> Subscription<M> {
    node.subscription(topic, qos).unwrap()
}

fn kinect() -> CameraInfo {
    CameraInfo { width: 640, height: 480, ..CameraInfo::default() }
}

/// The first line that holds all of `parts`.
fn line_with<'a>(text: &'a str, parts: &[&str]) -> Result<&'a str, String> {
    let mut lines = text.lines().filter(|line| parts.iter().all(|part| line.contains(part)));
    lines.next().ok_or_else(|| format!("no line holds {parts:?}:\n{text}"))
}

fn ensure(holds: bool, otherwise: impl Display) -> Result<(), String> {
    if holds { Ok(()) } else { Err(otherwise.to_string()) }
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn planted_faults_are_found_with_their_fixes() {
    let place = Place::new();
    let (drivers, nodes) = (place.node("drivers"), place.node("nodes"));
    let (scan, pose) = (place.name("scan"), place.name("pose"));
    let (driver, node) =
        (format!("node {}", place.name("drivers")), format!("node {}", place.name("nodes")));
    let judge = |output: &Output| {
        let text = String::from_utf8_lossy(&output.stdout);
        let error = |parts: &[&str]| {
            let line = line_with(&text, parts)?;
            ensure(line.starts_with("error ") && line.contains("  ->  "), line)
        };
        error(&["receive buffer is 128 KiB", "(614 kB)", "unset STILLMAP_RECEIVE_BUFFER_KIB"])?;
        error(&[&format!("{scan} has 2 types"), &driver, &node, "sensor_msgs/msg/Image", "-r"])?;
        let offers = format!("{pose}: the publisher of {driver} offers reliability best effort");
        error(&[&offers, &node])?;
        error(&[&format!("nobody publishes {scan}"), &node])?;
        error(&[&place.name("depth/image"), "614 kB are more than the 131 kB", "640x480 pixels"])?;
        error(&[&format!("{} reports", place.name("nodes"))])?;
        // The listing.
        line_with(&text, &["  publisher", &driver, "(RustDDS)", "best effort, volatile"])?;
        ensure(output.status.code() == Some(1), &text)?;
        let stderr = String::from_utf8_lossy(&output.stderr);
        // On a busy machine the DDS library logs the readers that it did not remove within its 20 ms.
        let said: Vec<_> = stderr.lines().filter(|line| !line.starts_with("[ERROR]")).collect();
        ensure(said.len() == 1 && said[0].contains("errors"), &stderr)
    };
    let outcome = {
        // Another type under the name of the scan.
        let _scans = publisher::<Image>(&drivers, "scan", &Qos::reliable(5));
        let _ranges = subscription::<LaserScan>(&nodes, "scan", &Qos::sensor(5));
        // A quality of service that offers less than is requested.
        let _poses = publisher::<PoseStamped>(&drivers, "pose", &Qos::sensor(5));
        let _path = subscription::<PoseStamped>(&nodes, "pose", &Qos::reliable(5));
        // Images larger than the receive buffer.
        let _images = publisher::<Image>(&drivers, "depth/image", &Qos::sensor(5));
        let _depths = subscription::<Image>(&nodes, "depth/image", &Qos::sensor(5));
        let infos = publisher::<CameraInfo>(&drivers, "depth/camera_info", &Qos::sensor(5));
        let small = [("STILLMAP_RECEIVE_BUFFER_KIB", "128")];
        place.examine(&[], &small, || infos.publish(kinect()).unwrap(), judge).await
    };
    drivers.close().await;
    nodes.close().await;
    outcome.unwrap_or_else(|said| panic!("{said}"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_healthy_graph_is_left_alone() {
    let place = Place::new();
    let (drivers, nodes) = (place.node("drivers"), place.node("nodes"));
    let judge = |output: &Output| {
        let report = json(output);
        let findings = report["findings"].as_array().unwrap();
        // What the machine grants is the machine's.
        let of_the_graph = ["graph", "types", "qos", "inputs", "names", "sizes", "diagnostics"];
        for finding in findings {
            let is_machines = !of_the_graph.contains(&finding["check"].as_str().unwrap());
            ensure(is_machines || finding["severity"] == "ok", finding)?;
        }
        let told = |part: &str| {
            let mut said = findings.iter().map(|finding| finding["what"].as_str().unwrap());
            ensure(said.any(|what| what.contains(part)), &report)
        };
        told("all topics that the suite reads are published")?;
        told(&format!("{}: 50 kB fit (measured", place.name("points")))?;
        let topics = report["topics"].as_array().unwrap();
        let scan = topics.iter().find(|topic| topic["topic"] == place.name("scan").as_str());
        let scan = scan.ok_or_else(|| report.to_string())?;
        ensure(scan["types"][0] == "sensor_msgs/msg/LaserScan", scan)?;
        ensure(scan["ends"].as_array().unwrap().len() == 2, scan)?;
        let errors = report["tally"]["errors"].as_u64().unwrap();
        let warnings = report["tally"]["warnings"].as_u64().unwrap();
        let expected = if errors > 0 { 1 } else { if warnings > 0 { 3 } else { 0 } };
        ensure(output.status.code() == Some(expected), format!("{}: {report}", output.status))
    };
    let outcome = {
        let sensor = Qos::sensor(5);
        let _scans = publisher::<LaserScan>(&drivers, "scan", &sensor);
        let _ranges = subscription::<LaserScan>(&nodes, "scan", &sensor);
        let _poses = publisher::<PoseStamped>(&drivers, "pose", &Qos::reliable(5));
        let _path = subscription::<PoseStamped>(&nodes, "pose", &sensor);
        let clouds = publisher::<PointCloud2>(&drivers, "points", &sensor);
        let _cloud = subscription::<PointCloud2>(&nodes, "points", &sensor);
        let small = || PointCloud2 { data: vec![0; 50_000], ..PointCloud2::default() };
        let send = || clouds.publish(small()).unwrap();
        place.examine(&["--json", "--measure"], &[], send, judge).await
    };
    drivers.close().await;
    nodes.close().await;
    outcome.unwrap_or_else(|said| panic!("{said}"));
}

#[test]
fn an_environment_that_is_not_understood_is_the_one_finding() {
    let output = stillmap_with_domain("300", ["doctor", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let report = json(&output);
    let findings = report["findings"].as_array().unwrap();
    assert_eq!(findings.len(), 1);
    assert!(findings[0]["what"].as_str().unwrap().contains("ROS_DOMAIN_ID=300"));
    assert!(findings[0]["fix"].as_str().unwrap().contains("from 0 to 232"));
}

#[test]
fn a_sound_bag_is_said_to_be_sound() {
    let folder = tempfile::tempdir().unwrap();
    let output = stillmap(["doctor", small_room(folder.path()).to_str().unwrap()]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    line_with(&text, &["ok ", "`stillmap run` reads /scan"]).unwrap();
    line_with(&text, &["ok ", "scans have an image or cloud within"]).unwrap();
    line_with(&text, &["0 errors"]).unwrap();
}

#[test]
fn what_is_no_bag_is_refused() {
    let output = stillmap(["doctor", "/nowhere/room.mcap"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("/nowhere/room.mcap"));
    let output = stillmap(["doctor", "--scan", "/scan"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no bag"));
}
