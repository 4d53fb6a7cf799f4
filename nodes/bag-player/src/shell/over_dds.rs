//! Tests of the player over DDS: player and subscriber are two participants in one process.

use std::path::{Path, PathBuf};
use std::time::Duration;

use free_domain::FreeDomain;
use geometry::{DepthImage, DepthPixels, Stamp};
use msgs::convert;
use msgs::rosgraph_msgs::Clock;
use msgs::sensor_msgs::{CompressedImage, Image, LaserScan};
use msgs::std_msgs::String as Text;
use msgs::stillmap_msgs::StageReport;
use node_shell::{Node, Publisher, Qos, RosArguments, Subscription, Transport};
use tempfile::TempDir;

use super::{DepthFormat, Ending, PlayError, PlayOptions, play};
use crate::{BagError, BagWriter, OfferedQos};

/// Longer than anything takes on a busy machine; a test that waits this long has failed.
const PATIENCE: Duration = Duration::from_secs(120);

const SCANS: u32 = 40;
const SCAN_PERIOD_S: f64 = 0.02;
const START: Stamp = Stamp::from_secs_nanos(1_700_000_000, 0);

/// A player and a subscriber, separated from all other tests by their domain.
fn nodes() -> (FreeDomain, Node, Node) {
    let domain = FreeDomain::new();
    let transport = Transport::on_domain(domain.number()).unwrap();
    let arguments = RosArguments::parse(std::iter::empty::<String>()).unwrap();
    let start = |name: &str| Node::start_on(transport.clone(), name, &arguments).unwrap();
    (domain, start("bag_player"), start("listener"))
}

fn scan(index: u32) -> LaserScan {
    let ranges = (0..90).map(|beam| (index * 100 + beam) as f32 * 0.01).collect();
    LaserScan { ranges, ..LaserScan::default() }
}

fn time(index: u32) -> Stamp {
    START.plus_seconds(f64::from(index) * SCAN_PERIOD_S)
}

/// A bag of scans at 50 Hz, with a latched string and one message in another encoding.
fn bag() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let write = |path: &Path| -> Result<(), BagError> {
        let mut writer = BagWriter::create(path)?;
        let text = writer.channel::<Text>("/map_name", OfferedQos::latched())?;
        let scans = writer.channel::<LaserScan>("/scan", OfferedQos::reliable(10))?;
        writer.write(text, time(0), &Text { data: "hall".into() })?;
        for index in 0..SCANS {
            writer.write(scans, time(index), &scan(index))?;
        }
        writer.finish().map(drop)
    };
    write(&path).unwrap();
    (folder, path)
}

async fn receive<M: msgs::RosMessage>(subscription: &Subscription<M>, count: u32) -> Vec<M> {
    let mut received = Vec::new();
    while (received.len() as u32) < count {
        match tokio::time::timeout(PATIENCE, subscription.next()).await {
            Ok(next) => received.push(M::clone(&next.message)),
            Err(_) => panic!("{} of {count} messages came", received.len()),
        }
    }
    received
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_message_arrives_in_order_at_its_time_and_under_its_new_name() {
    let (_folder, path) = bag();
    let (_domain, player, listener) = nodes();
    {
        let scans = listener.subscription::<LaserScan>("/front/scan", &Qos::reliable(50)).unwrap();
        let texts = listener.subscription::<Text>("/map_name", &Qos::latched()).unwrap();
        let clock = listener.subscription::<Clock>("/clock", &Qos::sensor(1000)).unwrap();
        let options = PlayOptions {
            remap: vec!["scan:=/front/scan".parse().unwrap()],
            wait_for: vec!["/front/scan".into(), "map_name".into()],
            wait_timeout_s: PATIENCE.as_secs_f64(),
            clock: true,
            ..PlayOptions::new(path)
        };
        let received = tokio::spawn(async move {
            let received = receive(&scans, SCANS).await;
            (received, receive(&texts, 1).await, clock)
        });
        let summary = play(options, &player).await.unwrap();
        let (received, texts, clock) = received.await.unwrap();
        let expected: Vec<LaserScan> = (0..SCANS).map(scan).collect();
        assert_eq!(received, expected);
        assert_eq!(texts, [Text { data: "hall".into() }]);

        assert_eq!((summary.ending, summary.passes), (Ending::Finished, 1));
        assert_eq!(summary.published(), u64::from(SCANS) + 1);
        assert!(summary.is_complete());
        let span_s = f64::from(SCANS - 1) * SCAN_PERIOD_S;
        assert!(summary.duration_s >= span_s, "{} s for {span_s} s", summary.duration_s);
        let scan = &summary.topics[1];
        assert_eq!((scan.topic.as_str(), scan.published_as.as_str()), ("/scan", "/front/scan"));
        assert_eq!(scan.most_subscribers, 1);

        let mut times = Vec::new();
        while let Some(next) = clock.try_next() {
            let time = next.message.clock;
            times.push(Stamp::from_secs_nanos(time.sec, time.nanosec));
        }
        // At 100 Hz; a machine that is busy skips ticks.
        assert!(times.is_sorted() && !times.is_empty(), "{times:?}");
        let last_s = times[times.len() - 1].seconds_since(START);
        assert!(times[0] >= START && last_s <= summary.duration_s, "{last_s} s");
    }
    player.close().await;
    listener.close().await;
}

/// Regression: with `--start` a latched message of before was never published, in no pass.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_latched_from_before_the_start_is_published_in_each_pass() {
    let (_folder, path) = bag();
    let (_domain, player, listener) = nodes();
    let shutdown = player.shutdown_signal();
    let names = listener.subscription::<Text>("/map_name", &Qos::latched()).unwrap();
    let options = PlayOptions {
        start_s: Some(f64::from(SCANS / 2) * SCAN_PERIOD_S),
        looping: true,
        rate: 8.0,
        wait_for: vec!["/map_name".into()],
        wait_timeout_s: PATIENCE.as_secs_f64(),
        ..PlayOptions::new(path.clone())
    };
    let three_passes = tokio::spawn(async move {
        receive(&names, 3).await;
        shutdown.trigger();
    });
    let summary = tokio::time::timeout(PATIENCE, play(options, &player)).await.unwrap().unwrap();
    three_passes.await.unwrap();
    let of = |topic: &str| summary.topics.iter().find(|one| one.topic == topic).unwrap();
    let passes = summary.passes;
    assert!(passes > 2 && of("/map_name").published + of("/map_name").failed >= passes - 1);
    assert!(of("/scan").published <= passes * u64::from(SCANS / 2), "{summary:?}");
    player.close().await;
    listener.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_loop_goes_on_until_it_is_interrupted() {
    let (_folder, path) = bag();
    let (_domain, player, listener) = nodes();
    let shutdown = player.shutdown_signal();
    let options = PlayOptions {
        looping: true,
        rate: 8.0,
        topics: vec!["/map_name".into(), "scan".into()],
        ..PlayOptions::new(path)
    };
    let names = listener.subscription::<Text>("/map_name", &Qos::reliable(10)).unwrap();
    let three_passes = tokio::spawn(async move {
        // The string is published once in a pass.
        receive(&names, 3).await;
        shutdown.trigger();
    });
    let summary = tokio::time::timeout(PATIENCE, play(options, &player)).await.unwrap().unwrap();
    three_passes.await.unwrap();
    assert_eq!(summary.ending, Ending::Interrupted);
    assert!(summary.passes > 2, "{} passes", summary.passes);
    let pass = u64::from(SCANS) + 1;
    // A latched string is not sent while a newly discovered reader has not acknowledged the one before.
    let played = summary.published() + summary.failed();
    assert!(played >= (summary.passes - 1) * pass && played <= summary.passes * pass, "{played}");
    player.close().await;
    listener.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_cannot_be_played_is_refused_in_words() {
    let (_folder, path) = bag();
    let (_domain, player, listener) = nodes();
    let refused =
        async |options: PlayOptions| play(options, &player).await.unwrap_err().to_string();
    let options = || PlayOptions::new(path.clone());

    let nobody = PlayOptions { wait_for: vec!["/scan".into()], wait_timeout_s: 0.3, ..options() };
    let nobody = refused(nobody).await;
    assert!(nobody.starts_with("nobody subscribed to /scan within 0.3 s"), "{nobody}");
    let unplayed = refused(PlayOptions { wait_for: vec!["/points".into()], ..options() }).await;
    assert!(unplayed.contains("there are /map_name, /scan"), "{unplayed}");
    let unknown = refused(PlayOptions { topics: vec!["/points".into()], ..options() }).await;
    assert!(unknown.ends_with("has no topic /points; it has: /map_name, /scan"), "{unknown}");
    let nothing = refused(PlayOptions { start_s: Some(60.0), ..options() }).await;
    assert!(nothing.contains("has no message to play"), "{nothing}");
    let rate = refused(PlayOptions { rate: 0.0, ..options() }).await;
    assert!(rate.starts_with("the rate must be a positive number"), "{rate}");
    let hz = refused(PlayOptions { clock: true, clock_hz: 0.0, ..options() }).await;
    assert_eq!(hz, "--clock-hz must be more than 0 and at most 10000, not 0");
    let late = play(PlayOptions { late_ms: f64::NAN, ..options() }, &player).await;
    assert!(matches!(late, Err(PlayError::Number { option: "late-ms", .. })));
    player.close().await;
    listener.close().await;
}

fn depth_image(index: u32) -> DepthImage {
    let pixels = (0..64 * 48).map(|pixel| (pixel * 7 + index * 1000) as u16).collect();
    DepthImage::new(time(index), "camera".into(), (64, 48), DepthPixels::Millimetres(pixels))
        .unwrap()
}

/// A bag of 20 depth images, one of them cut, and one colour image.
fn bag_of_images() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let write = |path: &Path| -> Result<(), BagError> {
        let mut writer = BagWriter::create(path)?;
        let depth = writer.channel::<Image>("/depth/image", OfferedQos::reliable(50))?;
        let colour = writer.channel::<Image>("/colour", OfferedQos::reliable(50))?;
        let scans = writer.channel::<LaserScan>("/scan", OfferedQos::reliable(50))?;
        for index in 0..20 {
            let mut image = convert::message_from_depth(&depth_image(index));
            if index == 10 {
                image.data.truncate(100);
            }
            writer.write(depth, time(index), &image)?;
            writer.write(scans, time(index), &scan(index))?;
        }
        let encoding = "rgb8".to_owned();
        let data = [200, 30, 20].repeat(8 * 8);
        let image = Image { encoding, width: 8, height: 8, step: 24, data, ..Image::default() };
        writer.write(colour, time(20), &image)?;
        writer.finish().map(drop)
    };
    write(&path).unwrap();
    (folder, path)
}

/// Regression: it was ignored, and the topic was published under its name in the bag.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_not_played_gets_no_other_name() {
    let (_folder, path) = bag();
    let (_domain, player, _listener) = nodes();
    let remap = |text: &str| PlayOptions {
        topics: vec!["/scan".into()],
        remap: vec![text.parse().unwrap()],
        ..PlayOptions::new(path.clone())
    };
    for text in ["/scam:=/laser/scan", "/map_name:=/name"] {
        let refused = play(remap(text), &player).await.unwrap_err().to_string();
        let from = text.split(":=").next().unwrap();
        assert_eq!(refused, format!("--remap {from}: no such topic is played; there are /scan"));
    }
    assert!(play(remap("scan:=/laser/scan"), &player).await.is_ok());
}

/// Reports each scan after the next one would be due.
async fn report_slowly(scans: Subscription<LaserScan>, reports: Publisher<StageReport>) -> usize {
    for reported in 0..SCANS as usize {
        if tokio::time::timeout(PATIENCE, scans.next()).await.is_err() {
            return reported;
        }
        tokio::time::sleep(Duration::from_secs_f64(2.0 * SCAN_PERIOD_S)).await;
        reports.publish(StageReport::default()).unwrap();
    }
    SCANS as usize
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_is_slower_than_the_bag_is_waited_for() {
    let (_folder, path) = bag();
    let (_domain, player, listener) = nodes();
    // Without --pace most messages would be lost: they are published twice as fast as they are taken.
    let scans = listener.subscription("scan", &Qos::reliable(4)).unwrap();
    let reports = listener.publisher("slow/report", &Qos::reliable(100)).unwrap();
    let node = tokio::spawn(report_slowly(scans, reports));
    let options = PlayOptions {
        wait_for: vec!["/scan".into()],
        wait_timeout_s: PATIENCE.as_secs_f64(),
        paces: vec!["scan=/slow/report".parse().unwrap()],
        ..PlayOptions::new(path.clone())
    };
    let summary = play(options, &player).await.unwrap();
    assert_eq!(node.await.unwrap(), SCANS as usize);
    let least_s = f64::from(SCANS - 4) * 2.0 * SCAN_PERIOD_S;
    assert!(summary.duration_s >= least_s, "{} s", summary.duration_s);
    let absent = PlayOptions {
        wait_timeout_s: 0.3,
        paces: vec!["scan=/nobody/report".parse().unwrap()],
        ..PlayOptions::new(path.clone())
    };
    let error = play(absent, &player).await.unwrap_err().to_string();
    assert!(error.contains("nobody published /nobody/report within 0.3 s"), "{error}");
    let unplayed =
        PlayOptions { paces: vec!["/scam=/r".parse().unwrap()], ..PlayOptions::new(path) };
    let error = play(unplayed, &player).await.unwrap_err().to_string();
    assert!(error.contains("--pace /scam: no such topic is played"), "{error}");
    player.close().await;
    listener.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn depth_images_arrive_compressed_below_their_name() {
    let (_folder, path) = bag_of_images();
    for (depth_format, format) in [
        (DepthFormat::Png, "16UC1; compressedDepth png"),
        (DepthFormat::Rvl, "16UC1; compressedDepth rvl"),
    ] {
        let (_domain, player, listener) = nodes();
        let name = "/front/depth/compressedDepth";
        let images = listener.subscription::<CompressedImage>(name, &Qos::reliable(50)).unwrap();
        let options = PlayOptions {
            topics: vec!["/depth/image".into(), "/scan".into()],
            remap: vec!["/depth/image:=/front/depth".parse().unwrap()],
            compress_depth: vec!["depth/image".into()],
            depth_format,
            wait_for: vec![name.into()],
            wait_timeout_s: PATIENCE.as_secs_f64(),
            ..PlayOptions::new(path.clone())
        };
        let received = tokio::spawn(async move { receive(&images, 19).await });
        let summary = play(options, &player).await.unwrap();
        let received = received.await.unwrap();
        assert!(received.iter().all(|message| message.format == format), "{format}");
        let received: Vec<DepthImage> = received
            .iter()
            .map(|message| convert::compressed_depth_from_message(message).unwrap())
            .collect();
        let expected: Vec<DepthImage> =
            (0..20).filter(|index| *index != 10).map(depth_image).collect();
        assert_eq!(received, expected);
        let depth = &summary.topics[0];
        assert_eq!((depth.topic.as_str(), depth.published_as.as_str()), ("/depth/image", name));
        assert_eq!(depth.type_name, "sensor_msgs/msg/CompressedImage");
        assert_eq!((depth.published, depth.failed), (19, 1));
        assert_eq!((summary.topics[1].published, summary.is_complete()), (20, false));
        player.close().await;
        listener.close().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn colour_images_arrive_as_jpeg_below_their_name() {
    let (_folder, path) = bag_of_images();
    let (_domain, player, listener) = nodes();
    {
        let name = "/colour/compressed";
        let images = listener.subscription::<CompressedImage>(name, &Qos::reliable(5)).unwrap();
        let options = PlayOptions {
            topics: vec!["/colour".into()],
            compress_color: vec!["colour=90".parse().unwrap()],
            wait_for: vec![name.into()],
            wait_timeout_s: PATIENCE.as_secs_f64(),
            ..PlayOptions::new(path)
        };
        let received = tokio::spawn(async move { receive(&images, 1).await });
        let summary = play(options, &player).await.unwrap();
        let message = &received.await.unwrap()[0];
        assert_eq!(message.format, "rgb8; jpeg compressed bgr8");
        let image = convert::image_from_compressed_message(message).unwrap();
        assert_eq!((image.encoding.as_str(), image.width, image.height), ("rgb8", 8, 8));
        let wanted = [200_u8, 30, 20];
        let is_near = |pixel: &[u8]| pixel.iter().zip(wanted).all(|(a, b)| a.abs_diff(b) < 5);
        assert!(image.data.chunks(3).all(is_near), "{:?}", image.data);
        assert_eq!(summary.topics[0].published_as, name);
    }
    player.close().await;
    listener.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_no_depth_image_is_not_compressed() {
    let (_folder, path) = bag_of_images();
    let (_domain, player, listener) = nodes();
    let refused = async |topic: &str, topics: &[&str]| {
        let options = PlayOptions {
            compress_depth: vec![topic.into()],
            topics: topics.iter().map(|topic| (*topic).to_owned()).collect(),
            ..PlayOptions::new(path.clone())
        };
        play(options, &player).await.unwrap_err().to_string()
    };
    let other = refused("/scan", &[]).await;
    assert_eq!(
        other,
        "--compress-depth /scan: it carries sensor_msgs/msg/LaserScan, not sensor_msgs/msg/Image"
    );
    for (topic, topics) in [("/points", &[][..]), ("/depth/image", &["/scan"])] {
        let unplayed = refused(topic, topics).await;
        assert_eq!(
            unplayed,
            format!(
                "--compress-depth {topic}: no such topic is played; the bag's images are /colour, \
                 /depth/image"
            )
        );
    }
    let colour = refused("/colour", &["/colour"]).await;
    assert!(colour.starts_with("--compress-depth: an image on /colour cannot be"), "{colour}");
    assert!(colour.contains("\"rgb8\" is no depth image"), "{colour}");

    let refused = async |topic: &str, depth: &[&str]| {
        let options = PlayOptions {
            compress_depth: depth.iter().map(|topic| (*topic).to_owned()).collect(),
            compress_color: vec![topic.parse().unwrap()],
            ..PlayOptions::new(path.clone())
        };
        play(options, &player).await.unwrap_err().to_string()
    };
    let depth = refused("/depth/image", &[]).await;
    assert!(depth.starts_with("--compress-color: an image on /depth/image cannot be"), "{depth}");
    assert!(depth.contains("\"16UC1\" is no image for JPEG"), "{depth}");
    let twice = refused("colour", &["/colour"]).await;
    assert_eq!(twice, "colour is to be compressed twice, by different codecs; name it once");
    player.close().await;
    listener.close().await;
}
