//! Tests of nodes that share a process: pointers between them, DDS for those outside.

use std::sync::Arc;

use free_domain::FreeDomain;
use geometry::DetectedCycle;
use msgs::RosMessage;
use msgs::sensor_msgs::{Image, LaserScan};
use msgs::stillmap_msgs::ReducedCloud;

use crate::two_nodes::{arguments, scan, soon};
use crate::{Arrived, Host, Node, PublishError, Qos, RosArguments, Transport};

fn node(host: &Host, name: &str) -> Node {
    host.node(name, &arguments("/test", &[])).unwrap()
}

#[test]
fn a_message_between_two_nodes_is_the_same_value() {
    let host = Host::in_process();
    let (talker, listener) = (node(&host, "talker"), node(&host, "listener"));
    let publisher = talker.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
    let first = listener.subscription::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
    let second = talker.subscription::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
    assert_eq!((publisher.subscriber_count(), first.publisher_count()), (2, 1));
    let message = Arc::new(scan(7));
    publisher.publish(Arc::clone(&message)).unwrap();
    for subscription in [&first, &second] {
        let received = subscription.try_next().unwrap();
        assert!(Arc::ptr_eq(&received.message, &message));
        assert!(received.sent.is_some());
        assert!(subscription.try_next().is_none());
    }
}

/// A cycle as detection publishes it.
fn cycle(index: u32) -> DetectedCycle {
    DetectedCycle {
        depth: None,
        scan_rays: std::sync::Arc::default(),
        index,
        setup: geometry::CycleSetup::default(),
        scan_stamp: geometry::Stamp::from_nanos(1),
        reduced_cloud: geometry::Cloud {
            stamp: geometry::Stamp::from_nanos(2),
            frame_id: "rig".to_owned(),
            points_m: vec![[1.0, 2.0, 3.0].into()],
        },
        voxel_points: vec![1],
        points_before_reduction: 1,
        map_from_rig: nalgebra::Isometry3::identity(),
        map_from_continuous: None,
        map_frame_id: "map".to_owned(),
        zones: Vec::new(),
        moving_beams: Vec::new(),
    }
}

#[test]
fn a_value_between_two_nodes_is_itself_and_a_message_for_who_wants_one() {
    let host = Host::in_process();
    let (talker, listener) = (node(&host, "talker"), node(&host, "listener"));
    let qos = Qos::reliable(5);
    let publisher = talker.value_publisher::<DetectedCycle>("cycles", &qos).unwrap();
    let values = listener.value_subscription::<DetectedCycle>("cycles", &qos).unwrap();
    let sent = Arc::new(cycle(3));
    publisher.publish(Arc::clone(&sent)).unwrap();
    let received = values.try_next().unwrap();
    assert!(Arc::ptr_eq(&received.message.value().unwrap(), &sent));

    let messages = [(); 2].map(|()| listener.subscription::<ReducedCloud>("cycles", &qos).unwrap());
    assert_eq!(publisher.subscriber_count(), 3);
    publisher.publish(Arc::clone(&sent)).unwrap();
    let [first, second] = messages.map(|messages| messages.try_next().unwrap().message);
    assert!(Arc::ptr_eq(&first, &second), "the message is made once");
    assert_eq!(*first, msgs::convert::message_from_detected_cycle(&sent));
    assert!(values.try_next().is_some());
    // And in the other direction: a publisher of messages, encoded or not.
    let peer = talker.publisher::<ReducedCloud>("cycles", &qos).unwrap();
    peer.publish(first).unwrap();
    let raw = talker.raw_publisher("cycles", ReducedCloud::TYPE_NAME, &qos).unwrap();
    raw.publish(&msgs::cdr::encode(&*second).unwrap()).unwrap();
    for _ in 0..2 {
        let arrived = values.try_next().unwrap().message;
        assert!(matches!(*arrived, Arrived::Message(_)));
        assert_eq!(*arrived.value().unwrap(), *sent);
    }
    let counts = listener.counters().snapshot().received;
    assert_eq!(counts["/test/cycles"], 4 + 2, "values and messages share a topic's count");
}

#[test]
fn a_message_without_a_subscriber_is_not_made() {
    let host = Host::in_process();
    let node = node(&host, "talker");
    let publisher = node.publisher::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
    publisher.publish_if_awaited(|| panic!("it is made"));
    let listener = node.subscription::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
    publisher.publish_if_awaited(|| scan(2));
    assert_eq!(listener.try_next().unwrap().message.ranges.len(), 2);
}

#[test]
fn other_topics_and_other_types_hear_nothing() {
    let host = Host::in_process();
    let node = node(&host, "talker");
    let publisher = node.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
    let elsewhere = node.subscription::<LaserScan>("scan2", &Qos::sensor(5)).unwrap();
    let image = node.subscription::<Image>("scan", &Qos::sensor(5)).unwrap();
    let stranger = Host::in_process().node("stranger", &arguments("/test", &[])).unwrap();
    let strange = stranger.subscription::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
    publisher.publish(scan(1)).unwrap();
    assert_eq!(publisher.subscriber_count(), 0);
    assert!(elsewhere.try_next().is_none() && image.try_next().is_none());
    assert!(strange.try_next().is_none());
}

#[test]
fn the_newest_wait_and_the_others_are_counted_as_lost() {
    let host = Host::in_process();
    let node = node(&host, "talker");
    let publisher = node.publisher::<LaserScan>("scan", &Qos::sensor(1)).unwrap();
    let subscription = node.subscription::<LaserScan>("scan", &Qos::sensor(3)).unwrap();
    for beams in 0..10 {
        publisher.publish(scan(beams)).unwrap();
    }
    let beams: Vec<usize> = std::iter::from_fn(|| subscription.try_next())
        .map(|received| received.message.ranges.len())
        .collect();
    assert_eq!(beams, [7, 8, 9]);
    let values = node.counters().snapshot().values;
    let value = |key: &str| values.iter().find(|(name, _)| name == key).unwrap().1.clone();
    assert_eq!(value("received /test/scan"), "3");
    assert_eq!(value("lost /test/scan"), "7");
    assert_eq!(value("published /test/scan"), "10");
}

#[test]
fn who_comes_late_gets_what_a_latched_topic_keeps() {
    let host = Host::in_process();
    let node = node(&host, "mapper");
    let publisher = node.publisher::<LaserScan>("map", &Qos::latched()).unwrap();
    publisher.publish(scan(1)).unwrap();
    let last = Arc::new(scan(2));
    publisher.publish(Arc::clone(&last)).unwrap();
    let late = node.subscription::<LaserScan>("map", &Qos::latched()).unwrap();
    assert!(Arc::ptr_eq(&late.try_next().unwrap().message, &last));
    assert!(late.try_next().is_none());
    let unasked = node.subscription::<LaserScan>("map", &Qos::reliable(5)).unwrap();
    assert!(unasked.try_next().is_none());
    drop(publisher);
    let too_late = node.subscription::<LaserScan>("map", &Qos::latched()).unwrap();
    assert!(too_late.try_next().is_none());
}

#[test]
fn encoded_messages_are_decoded_for_the_host() {
    let host = Host::in_process();
    let node = node(&host, "player");
    let publisher = node.raw_publisher("scan", LaserScan::TYPE_NAME, &Qos::reliable(5)).unwrap();
    let subscription = node.subscription::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
    let encoded = msgs::cdr::encode(&scan(3)).unwrap();
    publisher.publish(&encoded).unwrap();
    assert_eq!(*subscription.try_next().unwrap().message, scan(3));
    let cut = publisher.publish(&encoded[..20]).unwrap_err();
    assert!(matches!(cut, PublishError::Undecodable { .. }), "{cut}");
    assert!(cut.to_string().contains("/test/scan"), "{cut}");
    assert!(subscription.try_next().is_none());
}

#[tokio::test]
async fn waiting_ends_with_the_message_and_with_the_peer() {
    let host = Host::in_process();
    let node = node(&host, "talker");
    let publisher = node.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
    let subscription = {
        let subscribe = async {
            tokio::task::yield_now().await;
            node.subscription::<LaserScan>("scan", &Qos::sensor(5)).unwrap()
        };
        soon("the match", async { tokio::join!(publisher.wait_for_subscribers(1), subscribe) })
            .await
            .1
    };
    let publish = async {
        tokio::task::yield_now().await;
        publisher.publish(scan(4)).unwrap();
    };
    let (received, ()) =
        soon("the message", async { tokio::join!(subscription.next(), publish) }).await;
    assert_eq!(*received.message, scan(4));
}

/// The domain of this process, and a namespace that keeps its tests apart.
fn network(test: u16) -> (Transport, RosArguments) {
    let transport = Transport::on_domain(FreeDomain::of_this_process().number()).unwrap();
    (transport, arguments(&format!("/host_test_{test}"), &[]))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn those_outside_hear_the_host_and_none_hears_twice() {
    let (transport, arguments) = network(0);
    let host = Host::on(transport.clone()).unwrap();
    let (talker, listener) =
        (host.node("talker", &arguments).unwrap(), host.node("listener", &arguments).unwrap());
    let outsider = Node::start_on(transport, "outsider", &arguments).unwrap();
    {
        let publisher = talker.publisher::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        let inside = listener.subscription::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        let outside = outsider.subscription::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        let answer = outsider.publisher::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        soon("the matches", async {
            publisher.wait_for_subscribers(2).await;
            inside.wait_for_publishers(2).await;
            outside.wait_for_publishers(2).await;
            answer.wait_for_subscribers(2).await;
        })
        .await;
        assert_eq!(publisher.subscriber_count(), 2);
        for beams in 1..=3 {
            let message = Arc::new(scan(beams));
            publisher.publish(Arc::clone(&message)).unwrap();
            let received = soon("the message inside", inside.next()).await.message;
            assert!(Arc::ptr_eq(&received, &message));
            assert_eq!(*soon("the message outside", outside.next()).await.message, *message);
        }
        // The answer comes after whatever copies of the three DDS had for the host's own reader.
        answer.publish(scan(9)).unwrap();
        assert_eq!(*soon("the answer", inside.next()).await.message, scan(9));
    }
    for node in [talker, listener, outsider] {
        node.close().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn four_nodes_of_one_process_see_their_matches_in_localhost_mode_too() {
    let (transport, arguments) = network(1);
    let host = Host::on(transport.loopback_only()).unwrap();
    let names = ["one", "two", "three", "four"];
    let nodes = names.map(|name| host.node(name, &arguments).unwrap());
    {
        let publishers = nodes
            .each_ref()
            .map(|node| node.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap());
        let subscriptions = nodes
            .each_ref()
            .map(|node| node.subscription::<LaserScan>("scan", &Qos::sensor(20)).unwrap());
        for (beams, publisher) in publishers.iter().enumerate() {
            assert_eq!(publisher.subscriber_count(), 4);
            publisher.publish(scan(beams)).unwrap();
        }
        for subscription in &subscriptions {
            for beams in 0..publishers.len() {
                let received = soon("a message", subscription.next()).await.message;
                assert_eq!(*received, scan(beams));
            }
        }
        let own = nodes[2].matches().into_iter().filter(|one| one.topic.ends_with("/scan"));
        assert!(own.map(|one| one.peers).eq([4, 4]));
    }
    for node in nodes {
        node.close().await;
    }
}
