//! A subscriber of another make gets the filtered scans: beams that do not move are those of the driver, bit for bit.

use std::collections::BTreeMap;

use bag_player::{Bag, Selection};
use msgs::RosMessage;
use msgs::sensor_msgs::LaserScan;
use node_shell::Qos;

use super::build::Make;
use super::peer::Peer;
use super::place::{PATIENCE, Place, receive};
use crate::bags::small_room;
use crate::playing::{TO_DETECTION, play};
use crate::program::Running;

/// When enough has come, the recording is over when nothing has come for this long.
const SILENCE: std::time::Duration = std::time::Duration::from_secs(3);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cyclone_subscriber_gets_scans_whose_static_beams_are_the_drivers() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let selection = Selection { topics: Some(vec!["/scan".to_owned()]), ..Selection::default() };
    let raw: BTreeMap<_, LaserScan> = Bag::open(&bag)
        .unwrap()
        .messages(&selection)
        .unwrap()
        .map(|message| message.unwrap().decode::<LaserScan>().unwrap())
        .map(|scan| (scan.header.stamp, scan))
        .collect();

    let place = Place::new().await;
    let namespace = place.namespace();
    let arguments = [namespace, "reliable", "volatile"];
    let Some(peer) = Peer::start(Make::CyclonePython, "echo", &place, &arguments).await else {
        return;
    };
    // What the peer hears it sends back.
    let (there, back) = (
        format!("{namespace}/there/{}", LaserScan::TYPE_NAME),
        format!("{namespace}/back/{}", LaserScan::TYPE_NAME),
    );
    let node = place.node("ours");
    let heard = node.subscription::<LaserScan>(&back, &Qos::reliable(200)).unwrap();
    let up = Running::start_on(
        place.domain_id(),
        [
            "up",
            "--ros-args",
            "-r",
            &format!("__ns:={namespace}"),
            "-r",
            &format!("static_scan:={there}"),
        ],
    );
    let waited = async {
        heard.wait_for_publishers(1).await;
        // Segmentation sees its subscriber and subscribes to the scans, as detection does.
        let topic = format!("{namespace}/scan");
        let readers = || {
            let ends = node.survey();
            let is_it = |end: &&node_shell::DiscoveredEndpoint| {
                end.topic == topic && end.role == node_shell::Role::Subscription
            };
            ends.iter().filter(is_it).count()
        };
        while readers() < 2 {
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        }
    };
    tokio::time::timeout(PATIENCE, waited).await.expect("all find each other");
    let player = Running::start_on(place.domain_id(), play(&bag, namespace, &TO_DETECTION));
    let (mut scans, mut removed) = (0, 0);
    let is_enough = |scans: usize, removed: usize| scans > raw.len() / 2 && removed > 50;
    let mut patience = PATIENCE;
    while let Some(scan) = receive(&heard, patience).await {
        let driver = &raw[&scan.header.stamp];
        let bits = |values: &[f32]| values.iter().map(|one| one.to_bits()).collect::<Vec<_>>();
        assert_eq!(scan.header, driver.header);
        assert_eq!(bits(&scan.intensities), bits(&driver.intensities));
        assert_eq!(scan.ranges.len(), driver.ranges.len());
        let others = scan.ranges.iter().zip(&driver.ranges);
        let others = others.filter(|(one, own)| one.to_bits() != own.to_bits());
        removed += others.inspect(|(one, _)| assert!(one.is_nan(), "{one}")).count();
        scans += 1;
        if is_enough(scans, removed) {
            patience = SILENCE;
        }
    }
    println!("{scans} of {} scans, {removed} beams taken out", raw.len());
    assert!(is_enough(scans, removed), "{scans} of {} scans, {removed} beams", raw.len());
    drop((player, peer));
    assert!(up.interrupt());
    drop(heard);
    node.close().await;
}
