//! Tests over real DDS: two nodes are two participants, in one process.

mod busy;
mod discovery;
mod loss;
mod troubles;

use std::sync::atomic::{AtomicU16, Ordering};
use std::time::Duration;

use free_domain::FreeDomain;
use msgs::RosMessage;
use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use msgs::sensor_msgs::{Image, LaserScan};
use rustdds::LostReason;

use crate::two_nodes::{arguments, matched, scan, soon};
use crate::{
    DiscoveredEndpoint, Node, Publisher, Qos, Role, RosArguments, Subscription, Transport,
};

/// Nodes of one test, apart from those of all others by domain and namespace.
struct Place {
    transport: Transport,
    namespace: String,
    _domain: FreeDomain,
}

impl Place {
    fn new() -> Self {
        static COUNT: AtomicU16 = AtomicU16::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let domain = FreeDomain::new();
        let namespace = format!("/test_{}_{count}", std::process::id());
        Self {
            transport: Transport::on_domain(domain.number()).unwrap(),
            namespace,
            _domain: domain,
        }
    }

    fn node(&self, name: &str) -> Node {
        self.node_with(name, &[])
    }

    fn node_with(&self, name: &str, extra: &[&str]) -> Node {
        Node::start_on(self.transport.clone(), name, &arguments(&self.namespace, extra)).unwrap()
    }
}

/// An image whose encoding is no multiple of four bytes.
fn odd_image(bytes: usize) -> Image {
    let image = Image { data: (0..bytes).map(|at| (at % 251) as u8).collect(), ..Image::default() };
    assert_ne!(msgs::cdr::encode(&image).unwrap().len() % 4, 0);
    image
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn messages_arrive_in_order_with_the_time_of_sending() {
    let place = Place::new();
    let (talker, listener) = (place.node("talker"), place.node("listener"));
    {
        let publisher = talker.publisher::<LaserScan>("scan", &Qos::reliable(10)).unwrap();
        let subscription = listener.subscription::<LaserScan>("scan", &Qos::reliable(10)).unwrap();
        assert_eq!(publisher.topic(), format!("{}/scan", place.namespace));
        matched(&publisher, &subscription).await;
        for beams in 0..10 {
            publisher.publish(scan(beams)).unwrap();
        }
        for beams in 0..10 {
            let received = soon("a scan", subscription.next()).await;
            assert_eq!(*received.message, scan(beams));
            assert!(received.sent.is_some());
        }
        assert_eq!(subscription.received_count(), 10);
        assert!(subscription.try_next().is_none());
    }
    talker.close().await;
    listener.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_large_message_of_odd_length_arrives_whole() {
    let place = Place::new();
    let (talker, listener) = (place.node("talker"), place.node("listener"));
    {
        let publisher = talker.publisher::<Image>("image", &Qos::sensor(5)).unwrap();
        let subscription = listener.subscription::<Image>("image", &Qos::sensor(5)).unwrap();
        matched(&publisher, &subscription).await;
        let image = odd_image(150_001);
        publisher.publish(image.clone()).unwrap();
        assert_eq!(*soon("the image", subscription.next()).await.message, image);
    }
    talker.close().await;
    listener.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn bytes_of_a_bag_arrive_as_the_message_that_they_are() {
    let place = Place::new();
    let (player, listener) = (place.node("player"), place.node("listener"));
    {
        let publisher = player.raw_publisher("image", Image::TYPE_NAME, &Qos::reliable(5)).unwrap();
        let subscription = listener.subscription::<Image>("image", &Qos::sensor(5)).unwrap();
        soon("the match", publisher.wait_for_subscribers(1)).await;
        soon("the match", subscription.wait_for_publishers(1)).await;
        let image = odd_image(9);
        publisher.publish(&msgs::cdr::encode(&image).unwrap()).unwrap();
        assert_eq!(*soon("the image", subscription.next()).await.message, image);
        assert!(publisher.publish(&[0, 0, 0, 0, 1]).is_err());
    }
    player.close().await;
    listener.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_comes_late_gets_the_last_map() {
    let place = Place::new();
    let (mapper, viewer) = (place.node("mapper"), place.node("viewer"));
    {
        let publisher = mapper.publisher::<LaserScan>("map", &Qos::latched()).unwrap();
        publisher.publish(scan(1)).unwrap();
        publisher.publish(scan(2)).unwrap();
        let subscription = viewer.subscription::<LaserScan>("map", &Qos::latched()).unwrap();
        soon("the last map", async { while *subscription.next().await.message != scan(2) {} })
            .await;
    }
    mapper.close().await;
    viewer.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn remapped_topics_match() {
    let place = Place::new();
    let talker = place.node_with("talker", &["-r", "scan:=/laser_of_the_test/scan"]);
    let listener = place.node("listener");
    {
        let publisher = talker.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
        assert_eq!(publisher.topic(), "/laser_of_the_test/scan");
        let subscription =
            listener.subscription::<LaserScan>("/laser_of_the_test/scan", &Qos::sensor(5)).unwrap();
        matched(&publisher, &subscription).await;
    }
    talker.close().await;
    listener.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_topic_of_another_type_is_not_ours() {
    let place = Place::new();
    let (talker, right, listener) =
        (place.node("talker"), place.node("right"), place.node("listener"));
    {
        let wrong = talker.publisher::<Image>("scan", &Qos::reliable(5)).unwrap();
        let subscription = listener.subscription::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        let right = right.publisher::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        matched(&right, &subscription).await;
        wrong.publish(odd_image(9)).unwrap();
        right.publish(scan(3)).unwrap();
        assert_eq!(*soon("the scan", subscription.next()).await.message, scan(3));
        assert_eq!(subscription.publisher_count(), 1);
    }
    for node in [talker, right, listener] {
        node.close().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_that_closes_is_gone_at_once() {
    let place = Place::new();
    let (talker, listener) = (place.node("talker"), place.node("listener"));
    {
        let subscription = listener.subscription::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
        {
            let publisher = talker.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
            matched(&publisher, &subscription).await;
        }
        // The patience of a test is shorter than the lease, at the end of which it would be gone in any case.
        soon("the talker's end", talker.close()).await;
        soon("the end of the match", async {
            let mut changes = listener.matches();
            while changes.iter().any(|one| one.topic.ends_with("/scan") && one.peers > 0) {
                tokio::time::sleep(Duration::from_millis(5)).await;
                changes = listener.matches();
            }
        })
        .await;
        assert_eq!(subscription.publisher_count(), 0);
    }
    listener.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_node_reports_its_peers_and_counts() {
    let place = Place::new();
    let (talker, observer) = (place.node("talker"), place.node("observer"));
    {
        let reports =
            observer.subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(50)).unwrap();
        let image = talker.subscription::<Image>("image", &Qos::sensor(5)).unwrap();
        let scans = talker.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
        let heard = observer.subscription::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
        matched(&scans, &heard).await;
        talker.counters().count_cycle();
        talker.counters().count_drop("no pose");
        let expected = [
            ("cycles", "1"),
            ("dropped: no pose", "1"),
            (&format!("publishers {}", image.topic()), "0"),
            (&format!("subscribers {}", scans.topic()), "1"),
        ]
        .map(|(key, value)| (key.to_owned(), value.to_owned()));
        let own_name = talker.full_name();
        let status = soon("the report", async {
            loop {
                let array = reports.next().await.message;
                let status = array.status.iter().find(|status| {
                    let has = |(key, value): &(String, String)| status.value(key) == Some(value);
                    status.name == own_name && expected.iter().all(has)
                });
                if let Some(status) = status {
                    return status.clone();
                }
            }
        })
        .await;
        assert_eq!(status.level, DiagnosticStatus::WARN);
        assert_eq!(status.message, format!("waiting for {}", image.topic()));
        let matches = talker.matches();
        assert!(matches.iter().any(|one| one.role == Role::Publisher && one.peers == 1));
    }
    talker.close().await;
    observer.close().await;
}

/// The library's cache once gave a reader of depth 1 the message before the newest one.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_slow_reader_gets_the_newest_messages() {
    let place = Place::new();
    let (talker, listener) = (place.node("talker"), place.node("listener"));
    {
        let publisher = talker.publisher::<LaserScan>("scan", &Qos::reliable(10)).unwrap();
        let slow = listener.subscription::<LaserScan>("scan", &Qos::sensor(2)).unwrap();
        let prompt = listener.subscription::<LaserScan>("scan", &Qos::reliable(10)).unwrap();
        matched(&publisher, &slow).await;
        matched(&publisher, &prompt).await;
        soon("both matches", publisher.wait_for_subscribers(2)).await;
        for beams in 1..=6 {
            publisher.publish(scan(beams)).unwrap();
        }
        soon("the last", async { while *prompt.next().await.message != scan(6) {} }).await;
        assert_eq!(*soon("the newest but one", slow.next()).await.message, scan(5));
        assert_eq!(*soon("the newest", slow.next()).await.message, scan(6));
        assert!(slow.try_next().is_none());
    }
    talker.close().await;
    listener.close().await;
}

/// A new reader finds what the library's cache still holds; that is nothing new.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_reader_that_is_replaced_goes_on_where_the_last_one_stopped() {
    let place = Place::new();
    let (talker, listener) = (place.node("talker"), place.node("listener"));
    {
        let publisher = talker.publisher::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        let subscription = listener.subscription::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
        matched(&publisher, &subscription).await;
        let (mut sent, mut newest) = (0, 0);
        for _ in 0..4 {
            let heard = soon("a message", async {
                // The talker sees the old reader go and the new one come; one that is there hears.
                loop {
                    sent += 1;
                    publisher.publish(scan(sent)).unwrap();
                    let next =
                        tokio::time::timeout(Duration::from_millis(100), subscription.next());
                    if let Ok(received) = next.await {
                        break received.message.ranges.len();
                    }
                }
            })
            .await;
            assert!(heard > newest, "{heard} after {newest}");
            newest = heard;
            subscription.renew_reader();
        }
    }
    talker.close().await;
    listener.close().await;
}

/// After a link was down for longer than the lease, the library matches new endpoints alone.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn endpoints_created_again_after_a_broken_link_exchange_messages_again() {
    let place = Place::new();
    let (talker, listener) = (place.node("talker"), place.node("listener"));
    {
        let map = talker.publisher::<LaserScan>("map", &Qos::latched()).unwrap();
        let scans = talker.publisher::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        let maps_heard = listener.subscription::<LaserScan>("map", &Qos::latched()).unwrap();
        let scans_heard = listener.subscription::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        let aside = listener.subscription::<LaserScan>("aside", &Qos::sensor(5)).unwrap();
        matched(&map, &maps_heard).await;
        matched(&scans, &scans_heard).await;
        map.publish(scan(7)).unwrap();
        assert_eq!(*soon("the map", maps_heard.next()).await.message, scan(7));
        let silence = LostReason::Timeout {
            lease: rustdds::Duration::from_secs(50),
            elapsed: rustdds::Duration::from_secs(51),
        };
        let is_named = |one: &DiscoveredEndpoint| one.node == Some(listener.full_name());
        let prefix = soon("the listener's name", async {
            loop {
                if let Some(found) = talker.survey().into_iter().find(is_named) {
                    return found.participant.0;
                }
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        })
        .await;
        talker.graph().participant_lost(prefix, &silence);
        assert_eq!((map.subscriber_count(), scans.subscriber_count()), (0, 0));
        talker.graph().participant_heard(prefix);
        matched(&scans, &scans_heard).await;
        // The map is there for late subscribers; to the reader, its new writer is another one.
        assert_eq!(*soon("the map again", maps_heard.next()).await.message, scan(7));
        scans.wait_for_subscribers(1).await;
        scans.publish(scan(3)).unwrap();
        assert_eq!(*soon("a scan", scans_heard.next()).await.message, scan(3));
        assert_eq!(aside.publisher_count(), 0);
    }
    talker.close().await;
    listener.close().await;
}

#[test]
fn without_a_runtime_there_is_no_node() {
    let arguments = RosArguments::parse(std::iter::empty::<String>()).unwrap();
    let transport = Transport::on_domain(1).unwrap();
    assert!(Node::start_on(transport, "talker", &arguments).is_err());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_survey_lists_the_endpoints_of_others() {
    let place = Place::new();
    let (talker, doctor) = (place.node("talker"), place.node("doctor"));
    {
        let scans = talker.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
        let images = talker.subscription::<Image>("image", &Qos::latched()).unwrap();
        let survey = soon("the discovery", async {
            loop {
                let survey = doctor.survey();
                let is_named = |one: &&DiscoveredEndpoint| one.node == Some(talker.full_name());
                let ours = |role| survey.iter().filter(is_named).any(|one| one.role == role);
                let all = survey.iter().filter(is_named).count() >= 3;
                if all && ours(Role::Publisher) && ours(Role::Subscription) {
                    return survey;
                }
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        })
        .await;
        let scan = survey.iter().find(|one| one.topic == scans.topic()).unwrap();
        assert_eq!((scan.role, &*scan.type_name), (Role::Publisher, LaserScan::TYPE_NAME));
        assert_eq!(scan.qos.to_string(), "best effort, volatile");
        assert_eq!(scan.participant.vendor(), "RustDDS");
        assert_eq!(scan.owner(), format!("node {}", talker.full_name()));
        assert!(!scan.addresses.is_empty());
        let image = survey.iter().find(|one| one.topic == images.topic()).unwrap();
        assert_eq!(image.role, Role::Subscription);
        assert!(image.qos.is_reliable() && image.qos.to_string().contains("transient local"));
        assert!(survey.iter().all(|one| one.node != Some(doctor.full_name())));
    }
    talker.close().await;
    doctor.close().await;
}
