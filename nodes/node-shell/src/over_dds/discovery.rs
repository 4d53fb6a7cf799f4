//! More participants on one machine than the DDS library finds by itself.

use super::*;

/// The library finds twelve. Those beyond must find each other, too.
const NODES: usize = 16;
/// Longer than all pairs of them take on the busiest of machines.
const PATIENCE: Duration = Duration::from_secs(600);
/// This many bits distinguish the nodes.
const BITS: u32 = NODES.ilog2();

/// Every pair of nodes differs in at least one bit of its numbers. On that bit's topic one of the two
/// publishes and the other subscribes, so all pairs are matched when all topics are.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn sixteen_nodes_find_each_other_on_this_machine_without_multicast() {
    let mut place = Place::new();
    place.transport = place.transport.loopback_only();
    let nodes: Vec<_> = (0..NODES).map(|number| place.node(&format!("node_{number}"))).collect();
    let mut publishers = Vec::new();
    let mut subscriptions = Vec::new();
    for (number, node) in nodes.iter().enumerate() {
        for bit in 0..BITS {
            let topic = format!("bit_{bit}");
            if number >> bit & 1 == 0 {
                publishers.push(node.publisher::<LaserScan>(&topic, &Qos::sensor(1)).unwrap());
            } else {
                subscriptions
                    .push(node.subscription::<LaserScan>(&topic, &Qos::sensor(1)).unwrap());
            }
        }
    }
    let started = std::time::Instant::now();
    let found = || -> Vec<usize> {
        let subscribers = publishers.iter().map(Publisher::subscriber_count);
        subscribers.chain(subscriptions.iter().map(Subscription::publisher_count)).collect()
    };
    while found().iter().any(|peers| *peers < NODES / 2) {
        assert!(started.elapsed() < PATIENCE, "peers found by each: {:?}", found());
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    println!("{NODES} nodes found each other within {:?}", started.elapsed());
    drop((publishers, subscriptions));
    for node in nodes {
        node.close().await;
    }
}
