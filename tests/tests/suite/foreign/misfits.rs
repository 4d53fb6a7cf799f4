//! Foreign publishers that do not fit: the node names the topic, what is wrong, and the fix, in its log
//! and on `/diagnostics`.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::sensor_msgs::PointCloud2;
use node_shell::{Node, Qos, Subscription};
use tokio::sync::mpsc;
use tokio::time::timeout;

use super::build::Make;
use super::peer::Peer;
use super::place::{PATIENCE, Place, receive};

/// A node of the suite as a process whose log is read.
struct LoggedNode {
    child: Child,
    log: mpsc::UnboundedReceiver<String>,
}

impl LoggedNode {
    fn start(name: &str, place: &Place) -> Self {
        let namespace = format!("__ns:={}", place.namespace());
        let mut child = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
            .args(["node", name, "--ros-args", "-r", &namespace])
            .env("ROS_DOMAIN_ID", place.domain_id().to_string())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (sender, log) = mpsc::unbounded_channel();
        let lines = BufReader::new(child.stderr.take().unwrap()).lines();
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                let _ = sender.send(line);
            }
        });
        Self { child, log }
    }

    /// Waits for a line of the log that holds all of `parts`.
    async fn says(&mut self, parts: &[&str]) {
        let mut log = Vec::new();
        let said = timeout(PATIENCE, async {
            while let Some(line) = self.log.recv().await {
                let complete = parts.iter().all(|part| line.contains(part));
                log.push(line);
                if complete {
                    return;
                }
            }
            panic!("the node ended");
        });
        let said = said.await;
        assert!(said.is_ok(), "no line of the log holds {parts:?}:\n{}", log.join("\n"));
    }
}

impl Drop for LoggedNode {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Hears what nodes report about themselves.
struct Observer {
    node: Node,
    reports: Subscription<DiagnosticArray>,
}

impl Observer {
    fn start(place: &Place) -> Self {
        let node = place.node("observer");
        let reports = node.subscription("/diagnostics", &Qos::reliable(50)).unwrap();
        Self { node, reports }
    }

    /// Waits until `node` reports trouble with `topic`, in words that hold all of `parts`.
    async fn hears_of_trouble(self, place: &Place, node: &str, topic: &str, parts: &[&str]) {
        let (name, key) = (format!("{}/{node}", place.namespace()), format!("trouble {topic}"));
        let mut reported = Vec::new();
        let heard = timeout(PATIENCE, async {
            loop {
                let report = receive(&self.reports, PATIENCE).await.expect("somebody reports");
                for status in report.status.into_iter().filter(|status| status.name == name) {
                    let trouble = status.value(&key);
                    if trouble.is_some_and(|value| parts.iter().all(|part| value.contains(part))) {
                        return;
                    }
                    reported.push(format!("{}: {:?}", status.message, status.values));
                }
            }
        });
        let heard = heard.await;
        assert!(
            heard.is_ok(),
            "{name} does not report {key} with {parts:?}: {:?}",
            reported.last()
        );
        drop(self.reports);
        self.node.close().await;
    }
}

async fn another_type_is_named(make: Make) {
    let place = Place::new().await;
    let topic = format!("{}/scan", place.namespace());
    let arguments = [&topic, "sensor_msgs/msg/Image", "reliable", "volatile"];
    let Some(_peer) = Peer::start(make, "offer", &place, &arguments).await else { return };
    let observer = Observer::start(&place);
    let mut node = LoggedNode::start("detection", &place);
    let parts = ["type sensor_msgs/msg/Image", "has sensor_msgs/msg/LaserScan", "--ros-args -r"];
    node.says(&[&[topic.as_str()][..], &parts].concat()).await;
    observer.hears_of_trouble(&place, "detection", &topic, &parts).await;
}

async fn a_best_effort_offer_is_named(make: Make) {
    let place = Place::new().await;
    let topic = format!("{}/segmented_cloud", place.namespace());
    let arguments = [&topic, "stillmap_msgs/msg/SegmentedCloud", "best_effort", "volatile"];
    let Some(_peer) = Peer::start(make, "offer", &place, &arguments).await else { return };
    let observer = Observer::start(&place);
    let mut node = LoggedNode::start("reconstruction", &place);
    let parts = ["best effort and requested as reliable", "set the publisher's reliability"];
    node.says(&[&[topic.as_str()][..], &parts].concat()).await;
    observer.hears_of_trouble(&place, "reconstruction", &topic, &parts).await;
}

async fn a_volatile_offer_is_named(make: Make) {
    let place = Place::new().await;
    let topic = format!("{}/map", place.namespace());
    let arguments = [&topic, "sensor_msgs/msg/PointCloud2", "reliable", "volatile"];
    let Some(_peer) = Peer::start(make, "offer", &place, &arguments).await else { return };
    let observer = Observer::start(&place);
    let viewer = place.node("viewer");
    let maps = viewer.subscription::<PointCloud2>("map", &Qos::latched()).unwrap();
    let parts = ["volatile and requested as transient local", "set the publisher's durability"];
    observer.hears_of_trouble(&place, "viewer", &topic, &parts).await;
    drop(maps);
    viewer.close().await;
}

macro_rules! tests {
    ($($name:ident: $check:ident, $make:ident;)*) => {$(
        #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
        async fn $name() {
            $check(Make::$make).await;
        }
    )*};
}

tests! {
    another_type_on_cyclone_is_named: another_type_is_named, Cyclone;
    another_type_on_fast_dds_is_named: another_type_is_named, FastDds;
    a_best_effort_offer_on_cyclone_is_named: a_best_effort_offer_is_named, Cyclone;
    a_best_effort_offer_on_fast_dds_is_named: a_best_effort_offer_is_named, FastDds;
    a_volatile_offer_on_cyclone_is_named: a_volatile_offer_is_named, Cyclone;
    a_volatile_offer_on_fast_dds_is_named: a_volatile_offer_is_named, FastDds;
}
