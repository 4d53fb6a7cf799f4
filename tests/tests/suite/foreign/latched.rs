//! A map that was published before anybody came: the peer comes late and gets it, and its copy
//! reaches a node of ours that comes later still.

use std::time::Instant;

use msgs::RosMessage;
use msgs::sensor_msgs::PointCloud2;
use node_shell::{Qos, Subscription};
use tokio::time::timeout;

use super::build::Make;
use super::fill::{Floats, filled};
use super::peer::Peer;
use super::place::{PATIENCE, Place, largest_safe_message, publish, receive};

/// The size of a usual map, in bytes.
const MAP: usize = 4_000_000;

async fn a_map_reaches_who_comes_late(make: Make) {
    let place = Place::new().await;
    let mapper = place.node("mapper");
    // A kernel at its defaults lets no socket take a whole map; repair is slow.
    let bytes = MAP.min(largest_safe_message(&mapper) / 2);
    let map = PointCloud2 { data: vec![7; bytes], ..filled(1, Floats::SaidInJson, None) };
    let publisher = mapper
        .publisher::<PointCloud2>(&format!("there/{}", PointCloud2::TYPE_NAME), &Qos::latched())
        .unwrap();
    publish(&publisher, &PointCloud2::default());
    publish(&publisher, &map);

    let arguments = [place.namespace(), "reliable", "transient_local"];
    let Some(peer) = Peer::start(make, "echo", &place, &arguments).await else {
        drop(publisher);
        return mapper.close().await;
    };
    let viewer = place.node("viewer");
    let subscription = viewer
        .subscription::<PointCloud2>(&format!("back/{}", PointCloud2::TYPE_NAME), &Qos::latched())
        .unwrap();
    let started = Instant::now();
    wait_for_map(&subscription, &map).await;
    println!("{make:?}: {bytes} bytes there and back in {:?}", started.elapsed());

    // Debian's Fast DDS ends with a failed assertion when a second reader comes that has a multicast address
    // in common with the first, as all readers of RustDDS have; so there is one at a time.
    drop(subscription);
    viewer.close().await;

    // Now the copy is surely there before the one who wants it.
    let late = place.node("late");
    let late_subscription = late
        .subscription::<PointCloud2>(&format!("back/{}", PointCloud2::TYPE_NAME), &Qos::latched())
        .unwrap();
    let started = Instant::now();
    wait_for_map(&late_subscription, &map).await;
    println!("{make:?}: its latched copy came after {:?}", started.elapsed());
    drop((publisher, late_subscription, peer));
    for node in [mapper, late] {
        node.close().await;
    }
}

/// Waits for the map. The one before it may come first, until the library has cleared it away.
async fn wait_for_map(subscription: &Subscription<PointCloud2>, map: &PointCloud2) {
    let came = async { while receive(subscription, PATIENCE).await.as_ref() != Some(map) {} };
    timeout(PATIENCE, came).await.expect("the map comes");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_latched_map_and_cyclone() {
    a_map_reaches_who_comes_late(Make::Cyclone).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_latched_map_and_cyclone_python() {
    a_map_reaches_who_comes_late(Make::CyclonePython).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_latched_map_and_fast_dds() {
    a_map_reaches_who_comes_late(Make::FastDds).await;
}
