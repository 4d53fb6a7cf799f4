//! A recording that is played to the nodes of a test, where it matters no faster than they take it.

use std::path::Path;
use std::time::Duration;

use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::stillmap_msgs::StageReport;
use node_shell::{Node, Qos, Subscription};
use tokio::time::sleep;

/// The images of a recording of the simulator, or an imported one.
pub(crate) const IMAGES: &str = "/camera/depth/image_raw";
/// What detection takes of it: the bag's topics, and its own names of them.
pub(crate) const TO_DETECTION: [(&str, &str); 4] = [
    ("/scan", "scan"),
    ("/pose", "pose"),
    (IMAGES, "depth/image"),
    ("/camera/depth/camera_info", "depth/camera_info"),
];

/// The player's own default is for a machine that does nothing else.
const WAIT_TIMEOUT: &str = "--wait-timeout=90";
/// Reports that may wait: more than there are images on their way.
const REPORTS_KEPT: usize = 100;
/// How often it is asked whether the nodes have caught up.
const LOOK_AGAIN: Duration = Duration::from_millis(20);

/// The arguments of a player of these topics of a bag, each under its name in the namespace, that waits for their subscribers.
pub(crate) fn play(bag: &Path, namespace: &str, topics: &[(&str, &str)]) -> Vec<String> {
    let mut arguments = vec!["play".to_owned(), bag.display().to_string(), WAIT_TIMEOUT.to_owned()];
    for (from, name) in topics {
        let to = format!("{namespace}/{name}");
        arguments.push(format!("--topics={from}"));
        arguments.push(format!("--remap={from}:={to}"));
        arguments.push(format!("--wait-for={to}"));
    }
    arguments
}

/// A number that a node says of itself, if the report is of this node and has it.
pub(crate) fn number(report: &DiagnosticArray, node: &str, key: &str) -> Option<u64> {
    report.part(node)?.value(key)?.parse().ok()
}

/// Lets a player begin when detection hears it, and go on no faster than detection takes the images. So a test may ask for every
/// cycle of a bag, however slow the machine is; as `run --transport dds` does it.
pub(crate) struct Pacer<'a> {
    node: &'a Node,
    diagnostics: Subscription<DiagnosticArray>,
    views: Subscription<StageReport>,
}

impl<'a> Pacer<'a> {
    /// Of the detection in the namespace of `node`.
    pub(crate) fn on(node: &'a Node) -> Self {
        let reports = Qos::reliable(REPORTS_KEPT);
        Self {
            node,
            diagnostics: node.subscription("/diagnostics", &reports).unwrap(),
            views: node.subscription("detection/views", &reports).unwrap(),
        }
    }

    /// The argument of the player.
    pub(crate) fn argument(&self) -> String {
        format!("--pace={IMAGES}={}", self.node.resolve("pace").unwrap())
    }

    /// Paces the player, and holds it while the nodes have not caught up. Never ends.
    pub(crate) async fn pace(&self, have_caught_up: impl Fn() -> bool) {
        let detection = self.node.resolve("detection").unwrap();
        let publishers = TO_DETECTION.map(|(_, name)| {
            let topic = self.node.resolve(name).unwrap();
            format!("publishers {topic}")
        });
        loop {
            let report = self.diagnostics.next().await.message;
            if publishers.iter().all(|key| number(&report, &detection, key) > Some(0)) {
                break;
            }
        }
        // The player waits for this publisher, and what is published before they know each other is lost.
        let go = self.node.publisher("pace", &Qos::reliable(REPORTS_KEPT)).unwrap();
        go.wait_for_subscribers(1).await;
        loop {
            let view = self.views.next().await.message;
            while !have_caught_up() {
                sleep(LOOK_AGAIN).await;
            }
            go.publish_or_warn((*view).clone());
        }
    }
}
