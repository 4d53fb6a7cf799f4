//! The map of the node `pose`, saved, loaded and let go by a peer as `ros2 service call` does; and a node that starts on it.

use std::path::Path;
use std::time::Duration;

use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert::stamp_from_time;
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Odometry;
use msgs::rcl_interfaces::ParameterEvent;
use msgs::std_srvs::Trigger;
use node_shell::{Node, Qos, Subscription};
use serde_json::{Value, json};
use tokio::time::timeout;

use super::build::Make;
use super::peer::Peer;
use super::place::{PATIENCE, Place};
use crate::program::{Running, succeed};

/// Images come thirty times a second, at a third of the bag's speed ten times.
const SILENCE: Duration = Duration::from_secs(3);
/// The bag's seconds in which the camera is to be found.
const LONGEST_SEARCH_S: f64 = 1.0;

/// Hears what the node says of its pose.
struct Ear {
    odometry: Subscription<Odometry>,
    poses: Subscription<PoseStamped>,
    _node: Node,
}

/// What was heard: stamps of all poses, and of those in the map.
#[derive(Default)]
struct Heard {
    all: Vec<Stamp>,
    in_map: Vec<Stamp>,
}

impl Ear {
    fn new(place: &Place) -> Self {
        let node = place.node("ear");
        Self {
            odometry: node.subscription("odom", &Qos::reliable(200)).unwrap(),
            poses: node.subscription("pose", &Qos::reliable(200)).unwrap(),
            _node: node,
        }
    }

    /// Until nothing more comes.
    async fn hear(&self, heard: &mut Heard, longest: Duration) -> bool {
        let next = async {
            tokio::select! {
                odometry = self.odometry.next() => {
                    heard.all.push(stamp_from_time(odometry.message.header.stamp));
                }
                pose = self.poses.next() => {
                    if pose.message.header.frame_id == "map" {
                        heard.in_map.push(stamp_from_time(pose.message.header.stamp));
                    }
                }
            }
        };
        timeout(longest, next).await.is_ok()
    }

    async fn hear_all(&self) -> Heard {
        let mut heard = Heard::default();
        assert!(self.hear(&mut heard, PATIENCE).await, "a pose comes");
        while self.hear(&mut heard, SILENCE).await {}
        heard
    }
}

/// A node that keeps a map, as a process.
fn start_node(place: &Place, more: &[String]) -> Running {
    let namespace = format!("__ns:={}", place.namespace());
    let first = ["node", "pose", "--ros-args", "-r", &namespace, "-p", "slam:=true"];
    let more = more.iter().flat_map(|one| ["-p", one]);
    Running::start_on(place.domain_id(), first.into_iter().chain(more))
}

/// The bag of a camera that goes round a desk.
fn play(place: &Place, bag: &Path) -> Running {
    let namespace = place.namespace();
    let topics = [
        ("/camera/rgb/image_raw", "rgb/image"),
        ("/camera/rgb/camera_info", "rgb/camera_info"),
        ("/camera/depth/image_raw", "depth/image"),
    ];
    let names = topics.map(|(name, _)| name).join(",");
    let waited = topics.map(|(_, name)| format!("{namespace}/{name}")).join(",");
    let mut arguments =
        vec!["play".to_owned(), bag.display().to_string(), "--rate=0.33".to_owned()];
    arguments.extend([format!("--topics={names}"), format!("--wait-for={waited}")]);
    let remaps = topics.map(|(from, to)| format!("--remap={from}:={namespace}/{to}"));
    arguments.extend(remaps);
    Running::start_on(place.domain_id(), arguments)
}

/// What a peer is answered.
async fn call(peer: &mut Peer, place: &Place, service: &str) -> Value {
    let service = format!("{}/pose/{service}", place.namespace());
    let request = json!({ "structure_needs_at_least_one_member": 0 });
    peer.call::<Trigger>(&service, request).await
}

fn says(answer: &Value, is_done: bool, part: &str) {
    assert_eq!(answer["success"], is_done, "{answer}");
    assert!(answer["message"].as_str().unwrap().contains(part), "{answer}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_saves_a_map_and_a_node_that_starts_on_it_finds_its_camera() {
    let place = Place::new().await;
    let topics = ["/parameter_events", ParameterEvent::TYPE_NAME];
    let Some(mut peer) = Peer::start(Make::CyclonePython, "call", &place, &topics).await else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (bag, map) = (folder.path().join("desk.mcap"), folder.path().join("flat.map"));
    let output = bag.to_str().unwrap();
    succeed(["simulate", "desk", "--seconds=4", "--depth-size", "320", "240", "-o", output]);
    let map_file = format!("map_file:={}", map.display());

    let ear = Ear::new(&place);
    let node = start_node(&place, std::slice::from_ref(&map_file));
    says(&call(&mut peer, &place, "save_map").await, false, "there is no map yet");
    says(&call(&mut peer, &place, "load_map").await, false, "could not be loaded");
    let player = play(&place, &bag);
    let heard = ear.hear_all().await;
    assert!(player.wait().success());
    assert!(heard.in_map.len() > 20, "{} poses in the map", heard.in_map.len());
    says(&call(&mut peer, &place, "save_map").await, true, "keyframes");
    let saved = std::fs::read(&map).unwrap();
    assert!(node.interrupt());

    let node = start_node(&place, &[map_file, "localisation_only:=true".to_owned()]);
    let player = play(&place, &bag);
    let heard = ear.hear_all().await;
    assert!(player.wait().success());
    let [first, found] = [heard.all.first(), heard.in_map.first()].map(|stamp| *stamp.unwrap());
    let search_s = found.seconds_since(first);
    assert!(search_s < LONGEST_SEARCH_S, "found after {search_s} s of view");
    assert!(heard.in_map.len() > 20, "{} poses in the map", heard.in_map.len());
    says(&call(&mut peer, &place, "reset").await, true, "in the map of");
    says(&call(&mut peer, &place, "load_map").await, true, "loaded a map of");
    // It is the map of the first day still.
    says(&call(&mut peer, &place, "save_map").await, true, "keyframes");
    assert_eq!(std::fs::read(&map).unwrap(), saved);
    assert!(node.interrupt());
}
