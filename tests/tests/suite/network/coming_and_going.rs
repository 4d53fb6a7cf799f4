//! Peers that end, vanish and return.

use std::time::{Duration, Instant};

use msgs::sensor_msgs::Image;
use node_shell::{Node, Qos, RosArguments, Subscription, Transport};

use super::end::{BEFORE_THE_LEASE, End, PATIENCE, Published, RELIABLE, Subscribed};
use super::site::Site;

/// The rate at which an interrupted link is looked at.
const HZ: u64 = 50;

async fn wait_for_publishers(subscription: &Subscription<Image>, count: usize) -> Duration {
    let start = Instant::now();
    while subscription.publisher_count() != count {
        assert!(start.elapsed() < PATIENCE, "{} publishers", subscription.publisher_count());
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    start.elapsed()
}

#[test]
fn a_clean_end_is_seen_at_once_on_the_other_machine() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, _) = site.two_machines();
    let mut publisher =
        End::publish(&driver, &[], "--topic image --bytes 100 --hz 10 --seconds 300");
    let seen_after = compute.inside(|| async move {
        let arguments = RosArguments::parse([""; 0]).unwrap();
        let transport = Transport::on_domain(0).unwrap();
        let node = Node::start_on(transport, "watcher", &arguments).unwrap();
        let subscription = node.subscription::<Image>("/image", &Qos::sensor(5)).unwrap();
        wait_for_publishers(&subscription, 1).await;
        publisher.wait_for_match();
        let ended = Instant::now();
        let end = tokio::task::spawn_blocking(|| publisher.interrupt::<Published>());
        wait_for_publishers(&subscription, 0).await;
        let seen_after = ended.elapsed();
        end.await.unwrap();
        drop(subscription);
        node.close().await;
        seen_after
    });
    let Some(seen_after) = seen_after else { return };
    println!("a clean end is seen after {seen_after:?}");
    assert!(seen_after < BEFORE_THE_LEASE, "{seen_after:?}");
}

#[test]
fn a_killed_peer_that_returns_is_matched_again() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, _) = site.two_machines();
    let publish = format!("--topic scan --bytes 4000 --hz 20 --wait {RELIABLE}");
    // One may be of the first publisher.
    let subscribe = format!("--topic scan --count 21 {RELIABLE}");
    let subscriber = End::subscribe(&compute, &[], &subscribe);
    let mut first = End::publish(&driver, &[], &format!("{publish} --count 1"));
    first.wait_for_match();
    first.kill();

    let returned = Instant::now();
    let mut second = End::publish(&driver, &[], &publish);
    second.wait_for_match();
    let matched_after = returned.elapsed();
    let subscribed: Subscribed = subscriber.finish();
    let published: Published = second.interrupt();
    println!("a killed publisher that returns is matched after {matched_after:?}");
    assert!(matched_after < BEFORE_THE_LEASE, "{matched_after:?}");
    assert_eq!(published.refused, 0, "{published:?}");
    assert_eq!((subscribed.received, subscribed.lost), (21, Some(0)), "{subscribed:?}");
}

#[test]
fn a_killed_subscriber_that_returns_is_served_again() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, _) = site.two_machines();
    let publish = format!("--topic scan --bytes 4000 --hz 20 {RELIABLE}");
    let publisher = End::publish(&driver, &[], &publish);
    let subscribe = format!("--topic scan {RELIABLE}");
    let mut first = End::subscribe(&compute, &[], &subscribe);
    first.wait_for_match();
    first.kill();

    let subscribe = format!("{subscribe} --count 20");
    let second: Subscribed = End::subscribe(&compute, &[], &subscribe).finish();
    let published: Published = publisher.interrupt();
    let first_s = second.first_s.unwrap();
    println!("a killed subscriber that returns is served after {first_s:.2} s");
    assert!(Duration::from_secs_f64(first_s) < BEFORE_THE_LEASE, "{first_s} s");
    assert_eq!((second.received, second.lost), (20, Some(0)), "{second:?}");
    assert_eq!(published.refused, 0, "{published:?}");
}

#[test]
fn after_a_broken_link_messages_arrive_again() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, link) = site.two_machines();
    let subscriber = End::subscribe(&compute, &[], "--topic scan --seconds 300");
    let publish = format!("--topic scan --bytes 1000 --hz {HZ} --wait --seconds 300");
    let publisher = End::publish(&driver, &[], &publish);
    // Far more than discovery takes: a second of messages.
    let flows = || {
        let (before, start) = (compute.received_packets(link), Instant::now());
        while compute.received_packets(link) < before + 2 * HZ {
            assert!(start.elapsed() < PATIENCE, "no messages on the link");
            std::thread::sleep(Duration::from_millis(10));
        }
    };
    flows();
    driver.set_up(link, false);
    let down = Duration::from_secs(2);
    // The length of the interruption is what is given; there is nothing to wait for in it.
    std::thread::sleep(down);
    driver.set_up(link, true);
    flows();
    publisher.interrupt::<Published>();
    let subscribed: Subscribed = subscriber.interrupt();
    let away = Duration::from_secs_f64(subscribed.lost.unwrap() as f64 / HZ as f64);
    println!("a link that was down for {down:?} took the messages of {away:?}");
    // What was lost beyond the interruption is how long the return took.
    assert!(away < down + BEFORE_THE_LEASE, "{subscribed:?}");
    assert!(!away.is_zero(), "the link was down: {subscribed:?}");
}

#[test]
fn nodes_that_started_apart_meet_when_the_link_comes_up() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, link) = site.two_machines();
    driver.set_up(link, false);
    let mut publisher =
        End::publish(&driver, &[], "--topic scan --bytes 1000 --hz 10 --seconds 300");
    let mut subscriber = End::subscribe(&compute, &[], "--topic scan --seconds 300");
    // Both have announced themselves into the void by then.
    for end in [&mut publisher, &mut subscriber] {
        assert!(!end.finds_a_peer_within(Duration::from_secs(1)));
    }
    driver.set_up(link, true);
    let up = Instant::now();
    publisher.wait_for_match();
    subscriber.wait_for_match();
    let matched_after = up.elapsed();
    println!("nodes that started apart meet {matched_after:?} after the link came up");
    assert!(matched_after < BEFORE_THE_LEASE, "{matched_after:?}");
}

#[test]
fn who_comes_late_gets_the_map_of_the_other_machine() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, _) = site.two_machines();
    let mapper = End::publish(
        &compute,
        &[],
        "--topic map --bytes 4000000 --hz 10 --count 3 --latched --linger 300",
    );
    let mut early = End::subscribe(&driver, &[], "--topic map --latched --seconds 300");
    early.wait_for_match();
    let late: Subscribed = End::subscribe(&driver, &[], "--topic map --latched --count 1").finish();
    mapper.interrupt::<Published>();
    let first_s = late.first_s.unwrap();
    println!("a latched map of 4 MB reaches a late joiner after {first_s:.2} s");
    assert_eq!(late.received, 1, "{late:?}");
}

/// The lease of our nodes is 50 s, and is looked at every two.
const LONGER_THAN_THE_LEASE: Duration = Duration::from_secs(60);

#[test]
fn after_a_link_was_broken_for_longer_than_the_lease_messages_arrive_again() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, link) = site.two_machines();
    let mut subscriber = End::subscribe(&compute, &[], "--topic scan --seconds 300");
    let publish = format!("--topic scan --bytes 1000 --hz {HZ} --wait --seconds 300");
    let mut publisher = End::publish(&driver, &[], &publish);
    publisher.wait_for_match();
    driver.set_up(link, false);
    std::thread::sleep(LONGER_THAN_THE_LEASE);
    driver.set_up(link, true);
    let up = Instant::now();
    for end in [&mut subscriber, &mut publisher] {
        assert!(end.wait_for_line(PATIENCE, |line| line.contains("is heard again")));
    }
    println!("after a link was broken the ends hear of each other after {:?}", up.elapsed());
    assert!(up.elapsed() < BEFORE_THE_LEASE, "{:?}", up.elapsed());
    let (before, heard) = (compute.received_packets(link), Instant::now());
    while compute.received_packets(link) < before + 3 * HZ {
        assert!(heard.elapsed() < PATIENCE, "no messages {:?} after that", heard.elapsed());
        std::thread::sleep(Duration::from_millis(10));
    }
    publisher.interrupt::<Published>();
    let received = subscriber.interrupt::<Subscribed>().received;
    // Some of the packets are not messages, and some messages were lost while the ends met again.
    assert!(received > HZ, "{received}");
}
