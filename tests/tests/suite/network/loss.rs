//! A link that loses one packet in a hundred, each way.

use super::end::{End, PATIENCE, Published, RELIABLE, Subscribed};
use super::site::{LOSS_PERCENT, Site};

/// A cloud of 640 x 480 points of 16 bytes.
const CLOUD_BYTES: u64 = 4_915_200;
/// Partial messages that the DDS library keeps for a writer.
const PARTIAL_MESSAGES_OF_THE_LIBRARY: u64 = 128;

/// Payload of a packet on a link with an MTU of 1500.
const BYTES_PER_PACKET: f64 = 1400.0;

/// The share of messages of so many bytes that arrive when nothing is sent again.
fn share_that_arrives(bytes: u32) -> f64 {
    (1.0 - f64::from(LOSS_PERCENT) / 100.0).powf((f64::from(bytes) / BYTES_PER_PACKET).ceil())
}

fn megabytes(bytes: u64) -> u64 {
    bytes / 1_000_000
}

#[test]
fn small_reliable_topics_are_complete_and_large_ones_degrade() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, link) = site.two_machines();
    let losses =
        [compute.lose_packets_from(&driver, link), driver.lose_packets_from(&compute, link)];

    // A scan, a reduced cloud, a compressed depth image: topic, bytes, rate, messages.
    let reliable = [("scan", 5_000, 20, 100), ("reduced_cloud", 60_000, 10, 50)];
    let ends = reliable.map(|(topic, bytes, hz, count)| {
        let subscribe = format!("--topic {topic} --count {count} {RELIABLE}");
        let publish = format!("--topic {topic} --bytes {bytes} --hz {hz} --wait {RELIABLE}");
        (End::subscribe(&compute, &[], &subscribe), End::publish(&driver, &[], &publish))
    });
    let (bytes, count) = (150_000, 150);
    let depth = End::subscribe(&compute, &[], "--topic depth --seconds 300");
    let camera = format!("--topic depth --bytes {bytes} --hz 30 --count {count} --wait");
    let camera = End::publish(&driver, &[], &camera);

    for ((topic, _, _, count), (subscriber, publisher)) in reliable.into_iter().zip(ends) {
        let subscribed: Subscribed = subscriber.finish();
        publisher.interrupt::<Published>();
        println!(
            "{topic}, reliable: {} of {count}, {:?}",
            subscribed.received, subscribed.latency_ms
        );
        assert_eq!((subscribed.received, subscribed.lost), (count, Some(0)), "{topic}");
        assert_eq!(subscribed.out_of_order, 0, "{topic}");
    }
    camera.finish::<Published>();
    let subscribed: Subscribed = depth.interrupt();
    let share = subscribed.received as f64 / f64::from(count);
    let expected = share_that_arrives(bytes);
    println!(
        "{bytes} bytes, best effort: {share:.2} arrive, {expected:.2} is what the loss leaves"
    );
    // Three standard deviations of such a share are 0.12; a busy machine loses more, however much.
    assert!(share < expected + 0.15, "the link lost less than it should: {share} of {expected}");
    assert!(subscribed.received > 0, "{subscribed:?}");
    assert_eq!(subscribed.out_of_order, 0);
    for (loss, (at, from)) in losses.iter().zip([(&compute, &driver), (&driver, &compute)]) {
        assert!(at.lost_packets(from, link, loss) > 0, "the link lost nothing");
    }
}

#[test]
fn clouds_that_never_arrive_whole_do_not_fill_the_memory() {
    let Some(site) = Site::new() else { return };
    let (driver, compute, link) = site.two_machines();
    compute.lose_packets_from(&driver, link);
    let mut subscriber = End::subscribe(&compute, &[], "--topic points --seconds 120");
    let publish = format!("--topic points --bytes {CLOUD_BYTES} --hz 30 --seconds 120 --wait");
    let publisher = End::publish(&driver, &[], &publish);
    // However long it takes on a busy machine until so much has come: then the rests are dropped.
    let dropped = subscriber
        .wait_for_line(PATIENCE, |line| line.contains("incomplete messages filled the memory"));
    let published: Published = publisher.interrupt();
    let subscribed: Subscribed = subscriber.interrupt();
    println!(
        "clouds of 4.9 MB, best effort: {} of {} arrive; the subscriber held {} MB, the publisher {} MB",
        subscribed.received,
        published.published,
        megabytes(subscribed.rss_peak_bytes),
        megabytes(published.rss_peak_bytes)
    );
    assert!(dropped, "{subscribed:?}");
    // Long before the library itself gives anything up. How far below depends on how soon the subscriber gets to look.
    assert!(
        subscribed.rss_peak_bytes < PARTIAL_MESSAGES_OF_THE_LIBRARY * CLOUD_BYTES,
        "{subscribed:?}"
    );
    // The publisher keeps the last message, encoded and in fragments.
    assert!(published.rss_peak_bytes < 40 * CLOUD_BYTES, "{published:?}");
}
