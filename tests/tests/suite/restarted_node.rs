//! A node that is killed and comes back in the middle of a bag.

use std::collections::BTreeSet;
use std::time::Duration;

use geometry::Stamp;
use msgs::convert::stamp_from_time;
use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::ReducedCloud;
use node_shell::{Node, Qos, RosArguments, Subscription};
use tokio::time::timeout;

use crate::bags::small_room;
use crate::playing::{TO_DETECTION, play};
use crate::program::Running;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// So many cycles are to be heard after the return.
const CYCLES_AFTER: usize = 10;

/// Hears the stamps of a topic's clouds.
struct Ear {
    reduced: Subscription<ReducedCloud>,
    still: Subscription<PointCloud2>,
    node: Node,
    reduced_stamps: Vec<Stamp>,
    static_stamps: Vec<Stamp>,
}

impl Ear {
    fn start(namespace: &str) -> Self {
        let node = Node::start("ear", &arguments(namespace)).unwrap();
        Self {
            reduced: node.subscription("reduced_cloud", &Qos::reliable(200)).unwrap(),
            still: node.subscription("static_cloud", &Qos::reliable(200)).unwrap(),
            node,
            reduced_stamps: Vec::new(),
            static_stamps: Vec::new(),
        }
    }

    /// Hears the next cloud of either topic, if one comes in time.
    async fn hear(&mut self, longest: Duration) -> bool {
        let next = async {
            tokio::select! {
                reduced = self.reduced.next() => {
                    self.reduced_stamps.push(stamp_from_time(reduced.message.header.stamp));
                }
                still = self.still.next() => {
                    self.static_stamps.push(stamp_from_time(still.message.header.stamp));
                }
            }
        };
        timeout(longest, next).await.is_ok()
    }

    async fn hear_until(&mut self, enough: impl Fn(&Self) -> bool) {
        while !enough(self) {
            assert!(self.hear(PATIENCE).await, "nothing was heard for {PATIENCE:?}");
        }
    }
}

fn arguments(namespace: &str) -> RosArguments {
    RosArguments::parse(["--ros-args".to_owned(), "-r".to_owned(), format!("__ns:={namespace}")])
        .unwrap()
}

fn start_node(name: &str, namespace: &str) -> Running {
    Running::start(["node", name, "--ros-args", "-r", &format!("__ns:={namespace}")])
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_killed_segmentation_loses_only_the_cycles_of_its_absence() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let namespace = format!("/restarted_{}", std::process::id());

    let mut ear = Ear::start(&namespace);
    let detection = start_node("detection", &namespace);
    let segmentation = start_node("segmentation", &namespace);
    let ready = async {
        ear.reduced.wait_for_publishers(1).await;
        ear.still.wait_for_publishers(1).await;
    };
    timeout(PATIENCE, ready).await.unwrap();
    // The bag of 8 s leaves half a minute for the return; it is not played to its end.
    let arguments = play(&bag, &namespace, &TO_DETECTION).into_iter();
    let player = Running::start(arguments.chain(["--rate=0.2".to_owned()]));

    ear.hear_until(|ear| ear.static_stamps.len() >= 8).await;
    segmentation.kill();
    let heard_at_kill = ear.reduced_stamps.len();
    ear.hear_until(|ear| ear.reduced_stamps.len() >= heard_at_kill + 4).await;
    let last_before = *ear.static_stamps.last().unwrap();

    let segmentation = start_node("segmentation", &namespace);
    let heard_before_return = ear.static_stamps.len();
    ear.hear_until(|ear| ear.static_stamps.len() > heard_before_return).await;
    let first_after = ear.static_stamps[heard_before_return];

    // Segmentation may be behind: what it has not taken yet is not lost.
    ear.hear_until(|ear| {
        ear.static_stamps.len() > heard_before_return + CYCLES_AFTER
            && ear.static_stamps.last() == ear.reduced_stamps.last()
    })
    .await;
    let reduced: BTreeSet<Stamp> = ear.reduced_stamps.iter().copied().collect();
    let still: BTreeSet<Stamp> = ear.static_stamps.iter().copied().collect();
    assert!(still.is_subset(&reduced));
    let lost: Vec<&Stamp> = reduced.difference(&still).collect();
    assert!(!lost.is_empty(), "the absence costs something");
    for stamp in &lost {
        assert!(
            last_before < **stamp && **stamp < first_after,
            "the cycle at {stamp:?} was lost while segmentation ran ({last_before:?} .. {first_after:?})"
        );
    }
    assert!(still.iter().filter(|stamp| **stamp > first_after).count() >= CYCLES_AFTER);

    drop(player);
    for node in [detection, segmentation] {
        assert!(node.interrupt());
    }
    let Ear { node, reduced, still, .. } = ear;
    drop((reduced, still));
    node.close().await;
}
