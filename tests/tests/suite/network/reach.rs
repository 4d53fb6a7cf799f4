//! How far a node is heard: domains, static peers, this machine alone, one network of several.

use std::time::Duration;

use super::end::{End, Published, RELIABLE, Subscribed};
use super::site::{Machine, Site};

/// Longer than it takes nodes that can find each other; so long is waited for those that must not.
const NOBODY: Duration = Duration::from_secs(2);

/// Where an end runs, and what its environment says.
type Place<'a> = (&'a Machine, &'a [(&'a str, &'a str)]);

const LOCALHOST: [&[(&str, &str)]; 2] =
    [&[("ROS_LOCALHOST_ONLY", "1")], &[("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")]];

/// Publishes scans at one place and expects them to arrive at another, without a gap.
fn scans_arrive(from: Place<'_>, to: Place<'_>) {
    let subscriber = End::subscribe(to.0, to.1, &format!("--topic scan --count 20 {RELIABLE}"));
    let publish = format!("--topic scan --bytes 4000 --hz 50 --wait {RELIABLE}");
    let publisher = End::publish(from.0, from.1, &publish);
    let subscribed: Subscribed = subscriber.finish();
    let published: Published = publisher.interrupt();
    assert_eq!((subscribed.received, subscribed.lost), (20, Some(0)), "{:?} to {:?}", from.1, to.1);
    assert_eq!(published.subscribers_peak, 1, "{published:?}");
}

/// A pair of ends that must not meet. It is started before others that do, and so has their time too.
struct Strangers {
    publisher: End,
    subscriber: End,
}

impl Strangers {
    fn start(from: Place<'_>, to: Place<'_>) -> Self {
        let publish = "--topic secret --bytes 4000 --hz 20 --seconds 300";
        Self {
            subscriber: End::subscribe(to.0, to.1, "--topic secret --seconds 300"),
            publisher: End::publish(from.0, from.1, publish),
        }
    }

    fn did_not_meet(mut self) {
        assert!(!self.publisher.finds_a_peer_within(NOBODY), "strangers have met");
        let published: Published = self.publisher.interrupt();
        let subscribed: Subscribed = self.subscriber.interrupt();
        assert!(published.published > 0, "{published:?}");
        assert_eq!(published.subscribers_peak, 0, "{published:?}");
        assert_eq!((subscribed.publishers_peak, subscribed.received), (0, 0), "{subscribed:?}");
    }
}

#[test]
fn multicast_finds_the_other_machine_and_domains_stay_apart() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, _) = site.two_machines();
    let (seven, eight) = ([("ROS_DOMAIN_ID", "7")], [("ROS_DOMAIN_ID", "8")]);
    let strangers = Strangers::start((&driver, &seven), (&compute, &eight));
    scans_arrive((&driver, &eight), (&compute, &eight));
    scans_arrive((&compute, &seven), (&driver, &seven));
    strangers.did_not_meet();
}

#[test]
fn depth_images_cross_the_link_whole() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, _) = site.two_machines();
    let (bytes, count) = (614_400, 60);
    let granted = compute.raise_receive_buffer(32 << 20);
    println!("net.core.rmem_max is {granted} on the new machines");
    let subscribe = format!("--topic depth --depth {count} --seconds 300");
    let subscriber = End::subscribe(&compute, &[], &subscribe);
    let publish = format!("--topic depth --bytes {bytes} --hz 30 --count {count} --wait");
    End::publish(&driver, &[], &publish).finish::<Published>();
    let subscribed: Subscribed = subscriber.interrupt();
    println!("depth images: {} of {count}, {:?}", subscribed.received, subscribed.latency_ms);
    if subscribed.largest_safe_bytes < bytes {
        println!("not shown, a socket may buffer {} bytes only", subscribed.largest_safe_bytes);
        return;
    }
    // What is best effort is lost while nobody empties the socket; what arrives is whole, since no message is given out in part.
    assert!(subscribed.received > 0 && subscribed.received <= count, "{subscribed:?}");
    assert_eq!(subscribed.out_of_order, 0, "{subscribed:?}");
}

#[test]
fn without_multicast_static_peers_find_each_other() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, link) = site.two_machines();
    for machine in [&driver, &compute] {
        machine.without_multicast(link);
    }
    let strangers = Strangers::start((&driver, &[]), (&compute, &[]));
    // One side is enough, and it may be either.
    let peer = link.second_address();
    let told = [("ROS_STATIC_PEERS", peer.as_str())];
    scans_arrive((&driver, &told), (&compute, &[]));
    scans_arrive((&compute, &[]), (&driver, &told));
    let unlikely = format!("10.77.{}.9;{peer}", 200);
    let told =
        [("ROS_STATIC_PEERS", unlikely.as_str()), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")];
    scans_arrive((&driver, &told), (&compute, &[]));
    strangers.did_not_meet();
}

#[test]
fn localhost_mode_keeps_to_its_machine() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, link) = site.two_machines();
    for environment in LOCALHOST {
        let strangers = Strangers::start((&driver, environment), (&compute, &[]));
        scans_arrive((&driver, environment), (&driver, environment));
        strangers.did_not_meet();
        assert_eq!(driver.sent_packets(link), 0, "packets left the machine with {environment:?}");
    }
    // The count does count: a node without these settings leaves packets there.
    scans_arrive((&driver, &[]), (&compute, &[]));
    assert!(driver.sent_packets(link) > 0);
}

#[test]
fn a_chosen_interface_is_the_only_one_used() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, outsider) = (site.machine(), site.machine(), site.machine());
    let office = site.link(&driver, &outsider);
    let robot = site.link(&driver, &compute);
    for choice in [robot.interface(), robot.first_address()] {
        let chosen = [("STILLMAP_INTERFACES", choice.as_str())];
        let strangers = Strangers::start((&driver, &chosen), (&outsider, &[]));
        scans_arrive((&driver, &chosen), (&compute, &[]));
        scans_arrive((&compute, &[]), (&driver, &chosen));
        strangers.did_not_meet();
        assert_eq!(driver.sent_packets(office), 0, "packets went elsewhere with {choice}");
    }
    scans_arrive((&driver, &[]), (&outsider, &[]));
    assert!(driver.sent_packets(office) > 0);
}
