//! A depth camera and a scanner as foreign drivers: 640 x 480 pixels of 16 bits and their calibration
//! at 30 Hz, a turn of 720 beams at 7 Hz. What arrives is what was sent, in order; in a minute's drive that is all of it, and soon.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert::stamp_from_time;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan};
use msgs::std_msgs::Header;
use node_shell::{Qos, Subscription};
use tokio::sync::oneshot;
use tokio::time::{sleep, timeout};

use super::build::Make;
use super::peer::Peer;
use super::place::{PATIENCE, Place, largest_safe_message};

/// For how long the drivers drive, in seconds; 60 shows what is promised.
const SECONDS: &str = "STILLMAP_FOREIGN_SECONDS";
/// As long as a test of every day may take.
const USUAL_SECONDS: u64 = 3;
/// From which length on all must arrive, with the latencies that are promised. The suite's nodes subscribe to sensors best effort, to a
/// reliable driver, too: what comes while a busy machine lets nobody empty the socket is lost.
const PROMISED_SECONDS: u64 = 60;
/// The promised 99th percentile of the latency of the depth image.
const PROMISED_P99: Duration = Duration::from_millis(20);
/// What a depth image takes on its way.
const IMAGE_BYTES: usize = 640 * 480 * 2;
/// Nothing more is on the way when the driver has sent all and nothing has come for this long.
const SILENCE: Duration = Duration::from_secs(10);
/// Images in a second.
const IMAGE_HZ: usize = 30;

/// What came of one stream.
#[derive(Default)]
struct Arrived {
    last: Option<Stamp>,
    count: usize,
    out_of_order: usize,
    latencies: Vec<Duration>,
}

impl Arrived {
    fn take(&mut self, header: &Header) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
        let stamp = stamp_from_time(header.stamp);
        let sent = Duration::new(header.stamp.sec as u64, header.stamp.nanosec);
        self.latencies.push(now.saturating_sub(sent));
        self.count += 1;
        if self.last.is_some_and(|last| stamp <= last) {
            self.out_of_order += 1;
        }
        self.last = Some(stamp);
    }

    /// The latency that so many per cent stay below.
    fn percentile(&self, percent: usize) -> Duration {
        let mut sorted = self.latencies.clone();
        sorted.sort();
        sorted
            .get((sorted.len() * percent).div_ceil(100).saturating_sub(1))
            .copied()
            .unwrap_or_default()
    }
}

/// Takes what comes until it is all that was sent, or nothing has come for a while.
async fn collect<M: RosMessage>(
    subscription: Subscription<M>,
    mut told: oneshot::Receiver<usize>,
    header: impl Fn(&M) -> &Header,
    is_whole: impl Fn(&M) -> bool,
) -> Arrived {
    let mut arrived = Arrived::default();
    let mut sent = None;
    while sent.is_none_or(|sent| arrived.count < sent) {
        tokio::select! {
            received = subscription.next() => {
                let message = &received.message;
                arrived.take(header(message));
                assert!(is_whole(message), "a {} is not what was sent", M::TYPE_NAME);
            }
            count = &mut told, if sent.is_none() => sent = Some(count.unwrap()),
            () = sleep(SILENCE), if sent.is_some() => break,
        }
    }
    arrived
}

/// The pixels that the driver sends, made before the first image comes: whoever takes long for each image loses some.
fn sent_pixels() -> Vec<u8> {
    (0..IMAGE_BYTES / 2).flat_map(|at| (1000 + at as u16 % 256).to_le_bytes()).collect()
}

fn is_the_depth_image(image: &Image, pixels: &[u8]) -> bool {
    (image.width, image.height, image.encoding.as_str()) == (640, 480, "16UC1")
        && image.data == pixels
}

async fn a_driver_is_heard(make: Make, reliability: &str) {
    let seconds = std::env::var(SECONDS).map_or(USUAL_SECONDS, |text| text.parse().unwrap());
    let place = Place::alone().await;
    let arguments = [place.namespace(), &seconds.to_string(), reliability];
    let Some(mut driver) = Peer::start(make, "drive", &place, &arguments).await else { return };
    let node = place.node("ours");
    let largest = largest_safe_message(&node);
    if largest < IMAGE_BYTES {
        println!("skipped: a depth image of {IMAGE_BYTES} bytes is lost, at most {largest} arrive");
        return node.close().await;
    }
    let pixels = sent_pixels();
    // As the suite's nodes subscribe, with a queue for all that is sent: a pause of the test loses nothing of it.
    let qos = Qos::sensor(IMAGE_HZ * seconds as usize);
    let images = node.subscription::<Image>("depth/image", &qos).unwrap();
    let infos = node.subscription::<CameraInfo>("depth/camera_info", &qos).unwrap();
    let scans = node.subscription::<LaserScan>("scan", &qos).unwrap();
    let matched = async {
        images.wait_for_publishers(1).await;
        infos.wait_for_publishers(1).await;
        scans.wait_for_publishers(1).await;
    };
    timeout(PATIENCE, matched).await.unwrap();
    driver.wait_for("matched").await;
    driver.tell("go");
    let [(tell_images, told_images), (tell_infos, told_infos), (tell_scans, told_scans)] =
        [(); 3].map(|()| oneshot::channel());
    let streams = [
        tokio::spawn(collect(
            images,
            told_images,
            |image: &Image| &image.header,
            move |image| is_the_depth_image(image, &pixels),
        )),
        tokio::spawn(collect(
            infos,
            told_infos,
            |info: &CameraInfo| &info.header,
            |info| info.distortion_model == "plumb_bob" && info.k[2] == 319.5,
        )),
        tokio::spawn(collect(
            scans,
            told_scans,
            |scan: &LaserScan| &scan.header,
            |scan| scan.ranges.len() == 720 && scan.ranges[719] == 1.0 + 0.001 * 719.0,
        )),
    ];
    let sent = driver.wait_for("sent").await;
    let sent: Vec<usize> = sent.split(' ').map(|count| count.parse().unwrap()).collect();
    let mut arrived = Vec::new();
    for ((stream, tell), sent) in
        streams.into_iter().zip([tell_images, tell_infos, tell_scans]).zip(&sent)
    {
        // A stream that has panicked hears of nothing.
        let _ = tell.send(*sent);
        arrived.push(stream.await.unwrap());
    }
    drop(driver);
    node.close().await;
    for ((name, sent), arrived) in ["image", "info", "scan"].into_iter().zip(sent).zip(&arrived) {
        println!(
            "{make:?}, {reliability}, {seconds} s: {name} {} of {sent}, {} out of order, latency \
             median {:?}, p99 {:?}, longest {:?}",
            arrived.count,
            arrived.out_of_order,
            arrived.percentile(50),
            arrived.percentile(99),
            arrived.percentile(100),
        );
        let least = if seconds >= PROMISED_SECONDS { sent } else { 1 };
        assert!((least..=sent).contains(&arrived.count), "{name}: {} of {sent}", arrived.count);
        assert_eq!(arrived.out_of_order, 0, "{name}");
    }
    if seconds >= PROMISED_SECONDS {
        let p99 = arrived[0].percentile(99);
        assert!(p99 < PROMISED_P99, "the p99 of the image's latency is {p99:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_best_effort_driver_on_cyclone_is_heard() {
    a_driver_is_heard(Make::Cyclone, "best_effort").await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_reliable_driver_on_cyclone_is_heard() {
    a_driver_is_heard(Make::Cyclone, "reliable").await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_best_effort_driver_on_fast_dds_is_heard() {
    a_driver_is_heard(Make::FastDds, "best_effort").await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_reliable_driver_on_fast_dds_is_heard() {
    a_driver_is_heard(Make::FastDds, "reliable").await;
}
