//! Who finds whom, and by which way.

use std::time::{Duration, Instant};

use msgs::sensor_msgs::LaserScan;
use node_shell::{Node, Publisher, Qos, RosArguments, Subscription, Transport};

use super::end::PATIENCE;
use super::site::{Machine, Site};

/// More than the twelve places that a DDS participant looks into on its own machine.
const MANY: usize = 16;

/// One of many nodes, which both talks and listens on the same topic.
struct Talker {
    publisher: Publisher<LaserScan>,
    subscription: Subscription<LaserScan>,
    node: Node,
}

fn talker(transport: Transport, name: &str) -> Talker {
    let node = Node::start_on(transport, name, &RosArguments::parse([""; 0]).unwrap()).unwrap();
    Talker {
        publisher: node.publisher("scan", &Qos::sensor(5)).unwrap(),
        subscription: node.subscription("scan", &Qos::sensor(5)).unwrap(),
        node,
    }
}

/// Starts many nodes on a machine and returns how long it takes until each has found each.
fn all_find_each_other(
    machine: &Machine,
    transport: impl Fn() -> Transport + Send,
) -> Option<Duration> {
    machine.inside(|| async move {
        let start = Instant::now();
        let talkers: Vec<_> =
            (0..MANY).map(|number| talker(transport(), &format!("talker_{number}"))).collect();
        let found = || -> Vec<(usize, usize)> {
            talkers
                .iter()
                .map(|one| (one.publisher.subscriber_count(), one.subscription.publisher_count()))
                .collect()
        };
        // Each finds itself too.
        while !found().iter().all(|one| *one == (MANY, MANY)) {
            assert!(start.elapsed() < PATIENCE, "subscribers and publishers found: {:?}", found());
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        let elapsed = start.elapsed();
        for Talker { publisher, subscription, node } in talkers {
            drop((publisher, subscription));
            node.close().await;
        }
        elapsed
    })
}

#[test]
fn sixteen_nodes_of_a_machine_find_each_other() {
    let Some(site) = Site::new() else { return };
    let (machine, _other, _) = site.two_machines();
    let Some(took) = all_find_each_other(&machine, || Transport::on_domain(0).unwrap()) else {
        return;
    };
    println!("with multicast: {took:?}");
}

#[test]
fn sixteen_nodes_of_a_machine_without_network_find_each_other() {
    let Some(site) = Site::new() else { return };
    let machine = site.machine();
    let Some(took) = all_find_each_other(&machine, || Transport::on_domain(0).unwrap()) else {
        return;
    };
    println!("loopback alone: {took:?}");
}

#[test]
fn sixteen_nodes_of_a_machine_in_localhost_mode_find_each_other() {
    let Some(site) = Site::new() else { return };
    let (machine, _other, _) = site.two_machines();
    let transport = || Transport::on_domain(0).unwrap().loopback_only();
    let Some(took) = all_find_each_other(&machine, transport) else { return };
    println!("localhost mode: {took:?}");
}
