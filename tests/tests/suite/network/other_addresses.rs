//! Machines whose addresses come and go under a running node.

use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};

use super::end::{End, VARIABLES};
use super::site::{Machine, Site};
use crate::program::Running;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(120);
/// How often something is looked at.
const LOOK: Duration = Duration::from_millis(50);

/// Of a camera that sends all the time.
const IMAGES: &str = "--topic depth/image --bytes 1000 --hz 20 --seconds 300";

/// A node that waits for depth images.
struct Waiting {
    process: Running,
    log: tempfile::NamedTempFile,
}

impl Waiting {
    fn start(machine: &Machine, environment: &[(&str, &str)]) -> Self {
        let log = tempfile::NamedTempFile::new().unwrap();
        let mut command = machine.command(env!("CARGO_BIN_EXE_stillmap-under-test"));
        for variable in VARIABLES {
            command.env_remove(variable);
        }
        let command = command.args(["node", "compression"]).envs(environment.iter().copied());
        let process = Running::spawn(command.stderr(File::create(log.path()).unwrap()));
        Self { process, log }
    }

    fn said(&self) -> String {
        read(self.log.path())
    }

    fn wait_until_it_says(&self, text: &str) {
        let start = Instant::now();
        while !self.said().contains(text) {
            assert!(start.elapsed() < PATIENCE, "{text} is not said: {}", self.said());
            std::thread::sleep(LOOK);
        }
    }

    /// Waits until it ends by itself, as one that is to be started again.
    fn wait_until_it_is_to_be_started_again(mut self) -> String {
        let start = Instant::now();
        while self.process.is_up() {
            assert!(start.elapsed() < PATIENCE, "it lives on: {}", self.said());
            std::thread::sleep(LOOK);
        }
        println!("it ended {:?} after the change", start.elapsed());
        assert_eq!(self.process.wait().code(), Some(1));
        read(self.log.path())
    }
}

fn read(log: &Path) -> String {
    std::fs::read_to_string(log).unwrap()
}

/// Regression: the node went on with the address of its start, which nobody reaches, deaf and without a word.
#[test]
fn a_node_whose_machine_gets_another_address_is_started_again() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, link) = site.two_machines();
    // As where the network carries no multicast: images are sent to the address that the node has announced.
    let (first, second) = (link.first_address(), link.second_address());
    let to_driver = [("ROS_STATIC_PEERS", first.as_str())];
    let to_compute = [("ROS_STATIC_PEERS", second.as_str())];
    let mut camera = End::publish(&driver, &to_compute, IMAGES);
    let node = Waiting::start(&compute, &to_driver);
    let mut local = Waiting::start(&compute, &[("ROS_LOCALHOST_ONLY", "1")]);
    camera.wait_for_match();
    local.wait_until_it_says("nothing publishes");
    compute.take_addresses(link);
    compute.give_address(link, &link.another_address());
    let said = node.wait_until_it_is_to_be_started_again();
    for part in [link.second_address(), link.another_address(), "/depth/image".to_owned()] {
        assert!(said.contains(&part), "{part}: {said}");
    }
    camera.kill();
    let _again = Waiting::start(&compute, &to_driver);
    End::publish(&driver, &[], IMAGES).wait_for_match();
    // Nodes of one machine use no network that could change.
    assert!(local.process.is_up() && !local.said().contains("has changed"), "{}", local.said());
}

/// Regression: a network that comes up after the start of the machine was never used.
#[test]
fn a_node_that_waits_is_started_again_when_a_network_comes() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, link) = site.two_machines();
    compute.take_addresses(link);
    let node = Waiting::start(&compute, &[]);
    node.wait_until_it_says("of which there is this machine's own alone");
    compute.give_address(link, &link.second_address());
    let said = node.wait_until_it_is_to_be_started_again();
    assert!(said.contains(&format!("({}) has come", link.second_address())), "{said}");
    let _again = Waiting::start(&compute, &[]);
    End::publish(&driver, &[], IMAGES).wait_for_match();
}

/// What has an address again is heard again without a new start.
#[test]
fn an_address_that_comes_back_is_used_again() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, link) = site.two_machines();
    let mut camera = End::publish(&driver, &[], IMAGES);
    let mut node = Waiting::start(&compute, &[]);
    camera.wait_for_match();
    compute.take_addresses(link);
    node.wait_until_it_says("has gone");
    compute.give_address(link, &link.second_address());
    node.wait_until_it_says("the network is again as it was at the start");
    camera.kill();
    End::publish(&driver, &[], IMAGES).wait_for_match();
    assert!(node.process.is_up());
}
