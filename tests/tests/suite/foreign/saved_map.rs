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
use super::place::Place;
use crate::playing::{self, IMAGES};
use crate::program::{Running, succeed};

/// Poses in the map that are to be heard: of a map with some keyframes, and of a camera that is found in it.
const ENOUGH_TO_SAVE: usize = 100;
const ENOUGH_TO_BE_FOUND: usize = 20;
/// Longer than it takes to hear them: on a busy machine the map is made, and searched, in the time that is left.
const LONGEST_PLAY: Duration = Duration::from_secs(120);

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

    /// Hears until enough poses are in the map.
    async fn hear(&self, poses_in_map: usize) -> Heard {
        let mut heard = Heard::default();
        let enough = async {
            while heard.in_map.len() < poses_in_map {
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
            }
        };
        let is_enough = timeout(LONGEST_PLAY, enough).await.is_ok();
        let (all, in_map) = (heard.all.len(), heard.in_map.len());
        assert!(is_enough, "{in_map} of {all} poses are in the map");
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

/// The bag of a camera that goes round a desk, over and over, no faster than the node takes it.
fn play(place: &Place, bag: &Path) -> Running {
    let namespace = place.namespace();
    let topics = [
        ("/camera/rgb/image_raw", "rgb/image"),
        ("/camera/rgb/camera_info", "rgb/camera_info"),
        (IMAGES, "depth/image"),
    ];
    let mut arguments = playing::play(bag, namespace, &topics);
    arguments.extend(["--rate=0.33", "--loop"].map(str::to_owned));
    arguments.push(format!("--pace={IMAGES}={namespace}/pose/report"));
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
    ear.hear(ENOUGH_TO_SAVE).await;
    drop((player, ear));
    says(&call(&mut peer, &place, "save_map").await, true, "keyframes");
    let saved = std::fs::read(&map).unwrap();
    assert!(node.interrupt());

    // It hears nothing of the node that has ended.
    let ear = Ear::new(&place);
    let node = start_node(&place, &[map_file, "localisation_only:=true".to_owned()]);
    let player = play(&place, &bag);
    let heard = ear.hear(ENOUGH_TO_BE_FOUND).await;
    drop((player, ear));
    let found = heard.in_map[0];
    let unfound = heard.all.iter().filter(|stamp| **stamp < found).count();
    println!("found after {unfound} images in view");
    says(&call(&mut peer, &place, "reset").await, true, "in the map of");
    says(&call(&mut peer, &place, "load_map").await, true, "loaded a map of");
    // It is the map of the first day still.
    says(&call(&mut peer, &place, "save_map").await, true, "keyframes");
    assert_eq!(std::fs::read(&map).unwrap(), saved);
    assert!(node.interrupt());
}
