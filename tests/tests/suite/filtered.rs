//! The sensors' topics without what moves: of a recording by `stillmap filter`, and live.

mod colours;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use bag_player::{Bag, BagMessage, BagWriter, OfferedQos, Selection};
use free_domain::FreeDomain;
use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert;
use msgs::sensor_msgs::{Image, LaserScan};
use node_shell::{Node, Qos, Role, RosArguments, Transport};
use serde_json::Value;
use tokio::time::timeout;

use crate::bags::{made_once, small_room};
use crate::playing::{IMAGES, TO_DETECTION, play};
use crate::program::{Running, stillmap, succeed};
use crate::python::python_with;
use crate::recorded_kitchen::kitchen;

const SCAN: &str = "/scan";
const DEPTH: &str = IMAGES;

fn messages(bag: &Path) -> Vec<BagMessage> {
    let messages = Bag::open(bag).unwrap().messages(&Selection::default()).unwrap();
    messages.map(Result::unwrap).collect()
}

fn filtered(bag: &Path, more: &[&str]) -> (PathBuf, Value) {
    let out = bag.with_extension("static.mcap");
    let arguments = ["filter", bag.to_str().unwrap(), "-o", out.to_str().unwrap(), "--json"];
    let printed = succeed(arguments.iter().chain(more));
    (out, serde_json::from_str(&printed).unwrap())
}

fn of<M: RosMessage>(messages: &[BagMessage], topic: &str) -> Vec<M> {
    messages.iter().filter(|one| one.is_on(topic)).map(|one| one.decode().unwrap()).collect()
}

/// How many entries a mask keeps and takes out, of those that are static and of those that move.
#[derive(Default, Debug)]
struct Shares {
    moving: usize,
    moving_out: usize,
    still: usize,
    still_out: usize,
}

impl Shares {
    fn add(&mut self, is_moving: bool, is_out: bool) {
        let (all, out) = if is_moving {
            (&mut self.moving, &mut self.moving_out)
        } else {
            (&mut self.still, &mut self.still_out)
        };
        *all += 1;
        *out += usize::from(is_out);
    }

    fn gone(&self) -> f64 {
        self.moving_out as f64 / self.moving.max(1) as f64
    }

    fn kept(&self) -> f64 {
        1.0 - self.still_out as f64 / self.still.max(1) as f64
    }
}

/// The bag with each stamp of its sensors changed: of messages that begin with a header, as all of a sensor do.
fn with_stamps(bag: &Path, name: &str, stamp_s: impl Fn(&BagMessage, i32) -> i32) -> PathBuf {
    let path = bag.with_file_name(name);
    let mut writer = BagWriter::create(&path).unwrap();
    let mut channels = BTreeMap::new();
    for message in messages(bag).iter().filter(|message| !message.topic.starts_with("/truth")) {
        let channel = *channels.entry(message.topic.clone()).or_insert_with(|| {
            let (topic, qos) = (&*message.topic, OfferedQos::reliable(10).to_yaml());
            writer.raw_channel(topic, &message.type_name, "", &qos).unwrap()
        });
        let mut data = message.data.to_vec();
        // Behind the encapsulation.
        let seconds = i32::from_le_bytes(data[4..8].try_into().unwrap());
        data[4..8].copy_from_slice(&stamp_s(message, seconds).to_le_bytes());
        writer.write_raw(channel, message.log_time, message.publish_time, &data).unwrap();
    }
    writer.finish().unwrap();
    path
}

/// What waited for its cycle was lost where the time had jumped back, and each later message was written in the place of an earlier one.
#[test]
fn where_stamps_jump_back_each_message_stays_in_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let start = messages(&bag)[0].log_time;
    let since_start_s = |message: &BagMessage| message.log_time.seconds_since(start);
    let once = messages(&bag).iter().filter(|one| one.is_on(SCAN)).nth(20).unwrap().log_time;
    let clock_set = with_stamps(&bag, "set.mcap", |message, seconds| {
        if since_start_s(message) > 3.0 { seconds - 3 } else { seconds }
    });
    let one_ahead = with_stamps(&bag, "ahead.mcap", |message, seconds| {
        if message.is_on(SCAN) && message.log_time == once { seconds + 3600 } else { seconds }
    });
    for bag in [clock_set, one_ahead] {
        let (out, _) = filtered(&bag, &[]);
        let (raw, now) = (messages(&bag), messages(&out));
        assert_eq!(raw.len(), now.len());
        for (raw, now) in raw.iter().zip(&now) {
            assert_eq!((&raw.topic, raw.log_time), (&now.topic, now.log_time));
            assert_eq!(raw.data[..12], now.data[..12], "{} of another time", raw.topic);
        }
    }
}

#[test]
fn a_filtered_recording_is_the_same_but_for_what_moves() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let (out, printed) = filtered(&bag, &[]);
    let (raw, now) = (messages(&bag), messages(&out));
    assert_eq!(raw.len(), now.len());
    for (raw, now) in raw.iter().zip(&now) {
        assert_eq!((&raw.topic, &raw.type_name), (&now.topic, &now.type_name));
        assert_eq!((raw.log_time, raw.publish_time), (now.log_time, now.publish_time));
        if !raw.is_on(SCAN) && !raw.is_on(DEPTH) {
            assert_eq!(raw.data, now.data, "{} is not as it was", raw.topic);
        }
    }

    let labels = of::<LaserScan>(&raw, "/truth/scan_labels");
    let mut beams = Shares::default();
    for ((raw, now), labels) in
        of::<LaserScan>(&raw, SCAN).iter().zip(of::<LaserScan>(&now, SCAN)).zip(labels)
    {
        let rest = LaserScan { ranges: raw.ranges.clone(), ..now.clone() };
        assert_eq!(format!("{rest:?}"), format!("{raw:?}"));
        for (beam, (raw_m, now_m)) in raw.ranges.iter().zip(&now.ranges).enumerate() {
            let is_out = raw_m.to_bits() != now_m.to_bits();
            assert!(!is_out || now_m.is_nan(), "{raw_m} has become {now_m}");
            if raw_m.is_finite() {
                beams.add(labels.intensities[beam] > 0.0, is_out);
            }
        }
    }
    let labels = of::<Image>(&raw, "/truth/labels");
    let labels: BTreeMap<_, _> = labels
        .iter()
        .map(|message| (message.header.stamp, convert::labels_from_message(message).unwrap()))
        .collect();
    let mut pixels = Shares::default();
    for (raw, now) in of::<Image>(&raw, DEPTH).iter().zip(of::<Image>(&now, DEPTH)) {
        assert_eq!(Image { data: raw.data.clone(), ..now.clone() }, *raw);
        let Some(labels) = labels.get(&raw.header.stamp) else { continue };
        for (pixel, (raw, now)) in raw.data.chunks(2).zip(now.data.chunks(2)).enumerate() {
            assert!(raw == now || now == [0, 0]);
            if raw != [0, 0] {
                pixels.add(labels.object_ids()[pixel] > 0, raw != now);
            }
        }
    }
    println!("{printed}\nbeams: {beams:?}\npixels: {pixels:?}");
    assert!(beams.gone() > 0.75 && beams.kept() > 0.999, "{beams:?}");
    assert!(pixels.gone() > 0.95 && pixels.kept() > 0.99, "{pixels:?}");
    assert_eq!(printed["messages"], raw.len());
    assert_eq!(printed["scans"]["taken_out"], beams.moving_out + beams.still_out);
}

#[test]
fn a_bag_is_filtered_the_same_each_time_and_replaced_only_with_overwrite() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let (out, _) = filtered(&bag, &["--fill", "background"]);
    let first = std::fs::read(&out).unwrap();
    let (bag, name) = (bag.to_str().unwrap(), out.to_str().unwrap());
    let refused = stillmap(["filter", bag, "-o", name]);
    assert_eq!(refused.status.code(), Some(1));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(said.contains("already exists") && said.contains("--overwrite"), "{said}");
    succeed(["filter", bag, "-o", name, "--overwrite", "--fill", "background"]);
    assert_eq!(first, std::fs::read(&out).unwrap());
    let itself = stillmap(["filter", bag, "-o", bag, "--overwrite"]);
    assert_eq!(itself.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&itself.stderr).contains("cannot replace itself"));
}

/// The hall with the crowd, as a bag, in images of a quarter of the size: what is asked of the filter is asked of the scans, and
/// of when images come.
fn crowd(folder: &Path) -> PathBuf {
    let scene = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../nodes/laboratory/simulator/scenes/crowd/hall.yaml"
    );
    let whole = "depth_camera: {rate_hz: 30.0}";
    let small = "depth_camera: {rate_hz: 30.0, camera: {width_px: 160, height_px: 120, fx_px: 143.95, fy_px: 143.95, \
                 cx_px: 78.25, cy_px: 58.5, distortion: None}}";
    let scene = std::fs::read_to_string(scene).unwrap();
    assert!(scene.contains(whole));
    static BAG: OnceLock<Vec<u8>> = OnceLock::new();
    let file = folder.join("crowd.yaml");
    std::fs::write(&file, scene.replace(whole, small)).unwrap();
    made_once(&BAG, folder.join("crowd.mcap"), &["simulate", file.to_str().unwrap()])
}

#[test]
fn a_mapper_of_others_sees_no_ghosts_of_a_crowd() {
    let Some(python) = python_with("rosbags") else { return };
    let folder = tempfile::tempdir().unwrap();
    let bag = crowd(folder.path());
    let (out, printed) = filtered(&bag, &[]);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/grid/ghosts.py");
    let output = Command::new(python)
        .args([script, bag.to_str().unwrap(), &format!("filtered={}", out.display())])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    println!("{printed}\n{told}");
    let count = |bag: &str, name: &str| told[bag][name].as_f64().unwrap();
    let ghosts = |bag: &str| count(bag, "share/ghost_cells_mean");
    assert!(ghosts("raw") > 20.0, "{told}");
    assert!(ghosts("filtered") < 0.4 * ghosts("raw"), "{told}");
    assert!(count("filtered", "log_odds/ghost_cells") <= count("raw", "log_odds/ghost_cells"));
    for grid in ["share", "log_odds"] {
        let lost = count("filtered", &format!("{grid}/static_cells_lost"));
        assert!(lost < 0.01 * count("filtered", &format!("{grid}/static_cells")), "{told}");
    }
}

/// A pixel is steady in an image when its depth is so near to its median over all images.
const STEADY_MM: u16 = 50;

#[test]
fn the_person_goes_from_the_kitchens_images_and_the_room_stays() {
    let folder = tempfile::tempdir().unwrap();
    let Some(bag) = kitchen(folder.path()) else { return };
    let (out, printed) = filtered(&bag, &[]);
    let depths = |bag: &Path| -> Vec<Vec<u16>> {
        let images = of::<Image>(&messages(bag), DEPTH);
        let depths = |image: &Image| {
            image.data.chunks(2).map(|two| u16::from_le_bytes([two[0], two[1]])).collect()
        };
        images.iter().map(depths).collect()
    };
    let (raw, now) = (depths(&bag), depths(&out));
    let labels = of::<Image>(&messages(&bag), "/truth/labels");
    let labels: Vec<_> =
        labels.iter().map(|one| convert::labels_from_message(one).unwrap()).collect();
    let mut pixels = Shares::default();
    for pixel in 0..raw[0].len() {
        let mut measured: Vec<u16> =
            raw.iter().map(|image| image[pixel]).filter(|mm| *mm > 0).collect();
        measured.sort_unstable();
        let Some(median) = measured.get(measured.len() / 2) else { continue };
        for image in (0..raw.len()).filter(|image| raw[*image][pixel] > 0) {
            let is_person = labels[image].object_ids()[pixel] > 0;
            if is_person || raw[image][pixel].abs_diff(*median) <= STEADY_MM {
                pixels.add(is_person, raw[image][pixel] != now[image][pixel]);
            }
        }
    }
    println!("{printed}\n{pixels:?}: {:.4} gone, {:.5} kept", pixels.gone(), pixels.kept());
    // He is there from the first image on, and is found when he first leaves a place.
    assert!(pixels.gone() > 0.4 && pixels.kept() > 0.995, "{pixels:?}");
}

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// The period of the camera's images: 30 Hz.
const IMAGE_PERIOD: Duration = Duration::from_nanos(1_000_000_000 / 30);
/// So many scans, and images that follow another one, are to be heard.
const ENOUGH: usize = 20;

/// When messages came, by their stamps.
type Times = BTreeMap<msgs::builtin_interfaces::Time, Instant>;

fn percentiles(raw: &Times, made: &Times) -> String {
    let mut waits: Vec<Duration> = made
        .iter()
        .filter_map(|(stamp, at)| Some(at.saturating_duration_since(*raw.get(stamp)?)))
        .collect();
    waits.sort();
    let at = |percent: usize| {
        waits.get((waits.len() * percent).div_ceil(100).saturating_sub(1)).copied()
    };
    format!("{} of {}: median {:?}, p99 {:?}", waits.len(), raw.len(), at(50), at(99))
}

/// How many of these images come a period of the camera after another one. Images of cycles alone would be those of every third period.
fn successive(images: &Times) -> usize {
    let stamps: Vec<Stamp> = images.keys().map(|stamp| convert::stamp_from_time(*stamp)).collect();
    let period_s = IMAGE_PERIOD.as_secs_f64();
    let is_next = |pair: &&[Stamp]| pair[1].seconds_since(pair[0]) < 1.5 * period_s;
    stamps.windows(2).filter(is_next).count()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn filtered_topics_come_at_the_rates_of_the_sensors_and_only_while_they_are_wanted() {
    let folder = tempfile::tempdir().unwrap();
    let bag = crowd(folder.path());
    let domain = FreeDomain::new();
    let namespace = format!("/filtered_{}", std::process::id());
    let rule = format!("__ns:={namespace}");
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    let node = Node::start_on(Transport::on_domain(domain.number()).unwrap(), "mapper", &arguments)
        .unwrap();
    let up = Running::start_on(domain.number(), ["up", "--ros-args", "-r", &rule]);
    let qos = Qos::sensor(50);
    let scans = node.subscription::<LaserScan>("scan", &qos).unwrap();
    let images = node.subscription::<Image>("depth/image", &qos).unwrap();
    let raw_readers = |topic: &str| {
        let topic = format!("{namespace}/{topic}");
        let ends = node.survey();
        ends.iter().filter(|end| end.topic == topic && end.role == Role::Subscription).count()
    };
    // Detection alone wants the raw topics.
    let waited = async {
        while raw_readers("scan") < 1 || raw_readers("depth/image") < 1 {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    timeout(PATIENCE, waited).await.unwrap();
    let static_scans = node.subscription::<LaserScan>("static_scan", &qos).unwrap();
    let static_images = node.subscription::<Image>("static_depth/image", &qos).unwrap();
    let waited = async {
        while raw_readers("scan") < 2 || raw_readers("depth/image") < 2 {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    timeout(PATIENCE, waited).await.expect("segmentation subscribes when it is wanted");
    // The program is not optimised, and other tests run beside it.
    let arguments = play(&bag, &namespace, &TO_DETECTION).into_iter();
    let player = Running::start_on(domain.number(), arguments.chain(["--rate=0.3".to_owned()]));
    let [mut raw_scans, mut made_scans, mut raw_images, mut made_images] =
        [const { Times::new() }; 4];
    while made_scans.len() < ENOUGH || successive(&made_images) < ENOUGH {
        let next = async {
            tokio::select! {
                got = scans.next() => raw_scans.insert(got.message.header.stamp, Instant::now()),
                got = static_scans.next() => made_scans.insert(got.message.header.stamp, Instant::now()),
                got = images.next() => raw_images.insert(got.message.header.stamp, Instant::now()),
                got = static_images.next() => made_images.insert(got.message.header.stamp, Instant::now()),
            }
        };
        let heard = timeout(PATIENCE, next).await;
        assert!(heard.is_ok(), "only {} scans, {} images", made_scans.len(), made_images.len());
    }
    println!("static_scan at 10 Hz, {}", percentiles(&raw_scans, &made_scans));
    println!("static_depth at 30 Hz, {}", percentiles(&raw_images, &made_images));

    // Who goes away ends the work.
    drop((static_scans, static_images));
    let waited = async {
        while raw_readers("scan") > 1 || raw_readers("depth/image") > 1 {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    timeout(PATIENCE, waited).await.expect("segmentation gives the raw topics up");
    drop((player, scans, images));
    assert!(up.interrupt());
    node.close().await;
}
