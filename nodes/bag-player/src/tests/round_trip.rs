//! Written bags are read back unchanged.

use geometry::Stamp;
use msgs::rosgraph_msgs::Clock;
use msgs::sensor_msgs::LaserScan;
use msgs::std_msgs::String as Text;
use msgs::{RosMessage, cdr};

use super::read_all;
use crate::{Bag, BagError, BagWriter, OfferedQos, Selection};

fn scan(index: u32) -> LaserScan {
    LaserScan {
        angle_min: -1.0,
        range_max: 8.0,
        ranges: (0..360).map(|beam| (beam * index) as f32 * 0.01).collect(),
        ..LaserScan::default()
    }
}

fn time(index: u32) -> Stamp {
    Stamp::from_secs_nanos(1_700_000_000, 0).plus_seconds(f64::from(index) / 7.0)
}

/// A chunk was closed by its size alone: of a scanner a minute was lost with a process that was killed, of an IMU ten.
#[test]
fn of_a_recording_that_is_cut_off_two_seconds_are_lost() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("written.mcap");
    let mut writer = BagWriter::create(&path)?;
    let scans = writer.channel::<LaserScan>("/scan", OfferedQos::sensor(5))?;
    for index in 0..70 {
        writer.write(scans, time(index), &scan(index))?;
    }
    let cut_off = folder.path().join("cut_off.mcap");
    std::fs::copy(writer.temporary(), &cut_off).unwrap();
    let (messages, losses) = read_all(&Bag::open(&cut_off)?, &Selection::default())?;
    let last = messages.last().unwrap().log_time;
    assert!(time(69).seconds_since(last) <= 2.5, "{} messages", messages.len());
    assert!(!losses.is_empty());
    Ok(())
}

#[test]
fn messages_types_and_qos_are_read_back() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("written.mcap");
    let mut writer = BagWriter::create(&path)?;
    let scans = writer.channel::<LaserScan>("/scan", OfferedQos::sensor(5))?;
    let texts = writer.channel::<Text>("/map_name", OfferedQos::latched())?;
    writer.write(texts, time(0), &Text { data: "hall".into() })?;
    for index in 0..2000 {
        writer.write(scans, time(index), &scan(index))?;
    }
    assert!(!path.exists(), "an unfinished bag must not have the name of a whole one");
    let summary = writer.finish()?;
    assert!(!path.with_extension("mcap.tmp").exists());
    assert_eq!(summary.message_count, 2001);
    assert_eq!(summary.topic_counts["/scan"], 2000);
    assert_eq!((summary.start, summary.end), (Some(time(0)), Some(time(1999))));
    assert_eq!(summary.size_bytes, std::fs::metadata(&path).unwrap().len());

    let bag = Bag::open(&path)?;
    let (messages, losses) = read_all(&bag, &Selection::default())?;
    assert_eq!(losses, []);
    assert_eq!(messages.len(), 2001);
    assert_eq!(messages[0].decode::<Text>()?, Text { data: "hall".into() });
    for (index, message) in messages[1..].iter().enumerate() {
        assert_eq!(message.decode::<LaserScan>()?, scan(index as u32));
        assert_eq!(message.log_time, time(index as u32));
        assert_eq!(message.publish_time, message.log_time);
    }

    let info = bag.info()?;
    let by_topic: Vec<_> = info
        .topics
        .iter()
        .map(|topic| {
            (topic.topic.as_str(), topic.type_name.as_str(), topic.message_count, topic.qos)
        })
        .collect();
    assert_eq!(
        by_topic,
        [
            ("/map_name", "std_msgs/msg/String", 1, Some(OfferedQos::latched())),
            ("/scan", "sensor_msgs/msg/LaserScan", 2000, Some(OfferedQos::sensor(5))),
        ]
    );
    assert!((info.topics[1].rate_hz.unwrap() - 7.0).abs() < 1e-6);
    assert_eq!(info.files[0].profile, "ros2");
    assert_eq!(info.files[0].compression, ["zstd"]);
    assert!(info.files[0].indexed && info.files[0].chunks > 1, "seeking needs several chunks");
    Ok(())
}

/// Regression: a bag had no hash, and on Zenoh what has no definition is played by it alone.
#[test]
fn the_hash_of_a_type_without_a_definition_is_read_back() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let mut writer = BagWriter::create(&path)?;
    let (kind, qos) = (("other_msgs/msg/Thing", ""), OfferedQos::reliable(5).to_yaml());
    let channel = writer.hashed_channel("/thing", kind, Some("RIHS01_ab"), &qos)?;
    writer.write_raw(channel, time(0), time(0), &[0, 1, 0, 0, 7])?;
    writer.finish()?;
    let info = Bag::open(&path)?.info()?;
    let topic = &info.topics[0];
    assert_eq!((&topic.definition, topic.type_hash.as_deref()), (&None, Some("RIHS01_ab")));
    Ok(())
}

/// A rate was once that of the topic over the whole bag: half of it for a sensor that was started halfway.
#[test]
fn a_rate_is_that_from_a_topics_first_message_to_its_last() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let mut writer = BagWriter::create(&path)?;
    let whole = writer.channel::<LaserScan>("/whole", OfferedQos::sensor(5))?;
    let late = writer.channel::<LaserScan>("/late", OfferedQos::sensor(5))?;
    let once = writer.channel::<Text>("/once", OfferedQos::latched())?;
    let none = writer.channel::<Text>("/none", OfferedQos::latched())?;
    assert_ne!(once, none);
    writer.write(once, time(700), &Text::default())?;
    for index in 0..2000 {
        writer.write(whole, time(index), &scan(index))?;
        if (1000..1500).contains(&index) {
            writer.write(late, time(index), &scan(index))?;
        }
    }
    writer.finish()?;
    let rates = |info: &crate::BagInfo| -> Vec<(String, Option<f64>)> {
        let rounded = |rate_hz: f64| (rate_hz * 1e6).round() * 1e-6;
        info.topics.iter().map(|one| (one.topic.clone(), one.rate_hz.map(rounded))).collect()
    };
    let expected = [("/late", Some(7.0)), ("/none", None), ("/once", None), ("/whole", Some(7.0))]
        .map(|(topic, rate_hz)| (topic.to_owned(), rate_hz));
    let info = Bag::open(&path)?.info()?;
    assert!(info.files[0].chunks > 3);
    assert_eq!(rates(&info), expected);
    // The same of a file that was cut off, and has no index.
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() - 1000]).unwrap();
    let cut = Bag::open(&path)?.info()?;
    assert!(!cut.files[0].indexed);
    assert_eq!(rates(&cut), expected);
    Ok(())
}

#[test]
fn the_same_calls_give_the_same_bytes() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str| -> Result<Vec<u8>, BagError> {
        std::fs::create_dir_all(folder.path().join(name)).unwrap();
        let path = folder.path().join(name).join("bag.mcap");
        let mut writer = BagWriter::create(&path)?;
        let scans = writer.channel::<LaserScan>("/scan", OfferedQos::sensor(5))?;
        for index in 0..2000 {
            writer.write(scans, time(index), &scan(index))?;
        }
        writer.finish()?;
        Ok(std::fs::read(path).unwrap())
    };
    assert_eq!(write("one")?, write("other")?);
    Ok(())
}

#[test]
fn the_file_says_what_rosbag2_asks_of_it() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let mut writer = BagWriter::create(&path)?;
    let scans = writer.channel::<LaserScan>("/scan", OfferedQos::sensor(5))?;
    writer.write(scans, time(0), &scan(0))?;
    writer.write(scans, time(7), &scan(1))?;
    writer.finish()?;

    let bytes = std::fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let schema = summary.schemas.values().next().unwrap();
    assert_eq!((schema.name.as_str(), schema.encoding.as_str()), (LaserScan::TYPE_NAME, "ros2msg"));
    assert_eq!(schema.data.as_ref(), LaserScan::schema().as_bytes());
    let channel = summary.channels.values().next().unwrap();
    assert_eq!(channel.message_encoding, "cdr");
    assert!(channel.metadata["offered_qos_profiles"].starts_with("- history: 1\n  depth: 5\n"));
    let index = summary.metadata_indexes.iter().find(|index| index.name == "rosbag2").unwrap();
    let metadata = mcap::read::metadata(&bytes, index).unwrap();
    let yaml: serde_json::Value =
        serde_saphyr::from_str(&metadata.metadata["serialized_metadata"]).unwrap();
    assert_eq!(yaml["version"], 8);
    assert_eq!(yaml["message_count"], 2);
    assert_eq!(yaml["duration"]["nanoseconds"], 1_000_000_000);
    assert_eq!(yaml["relative_file_paths"][0], "bag.mcap");
    Ok(())
}

#[test]
fn a_dropped_writer_leaves_what_it_has() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let mut writer = BagWriter::create(&path)?;
    let scans = writer.channel::<LaserScan>("/scan", OfferedQos::sensor(5))?;
    writer.write(scans, time(0), &scan(0))?;
    drop(writer);
    assert!(!path.exists());
    let left = Bag::open(&folder.path().join("bag.mcap.tmp"))?;
    assert_eq!(read_all(&left, &Selection::default())?.0.len(), 1);
    Ok(())
}

#[test]
fn wrong_types_and_times_are_refused() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let mut writer = BagWriter::create(&path)?;
    let scans = writer.channel::<LaserScan>("/scan", OfferedQos::sensor(5))?;
    let refused = writer.write(scans, time(0), &Clock::default()).unwrap_err().to_string();
    assert_eq!(
        refused,
        "channel /scan is for sensor_msgs/msg/LaserScan; a rosgraph_msgs/msg/Clock was written to it"
    );
    let early = writer.write(scans, Stamp::from_nanos(-1), &scan(0));
    assert!(matches!(early, Err(BagError::TimeBeforeEpoch { .. })));
    writer.write(scans, time(0), &scan(0))?;
    writer.write_raw(scans, time(1), time(1), &cdr::encode(&scan(1)).unwrap()[..20])?;
    writer.finish()?;

    let (messages, _) = read_all(&Bag::open(&path)?, &Selection::default())?;
    let wrong = messages[0].decode::<Clock>().unwrap_err().to_string();
    assert_eq!(
        wrong,
        "topic /scan carries sensor_msgs/msg/LaserScan, not rosgraph_msgs/msg/Clock: choose another topic or remap it"
    );
    assert!(matches!(messages[1].decode::<LaserScan>(), Err(BagError::Decode { .. })));
    Ok(())
}

#[test]
fn a_folder_that_is_not_there_is_named() {
    let error = BagWriter::create(std::path::Path::new("/nowhere/at/all.mcap")).err().unwrap();
    assert!(error.to_string().starts_with("cannot create /nowhere/at/all.mcap.tmp"), "{error}");
}

/// Regression: `eval scans --scan right_scan` read the scans of /right_scan and took each for a pose; other commands
/// knew no such topic. Bags that were converted from ROS 1 have names without a slash, too.
#[test]
fn topics_are_known_with_and_without_their_slash() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("names.mcap");
    let mut writer = BagWriter::create(&path)?;
    for name in ["/scan", "rear_scan"] {
        let topic = writer.channel::<LaserScan>(name, OfferedQos::sensor(5))?;
        writer.write(topic, time(0), &scan(0))?;
    }
    writer.finish()?;
    let bag = Bag::open(&path)?;
    let info = bag.info()?;
    for (named, recorded) in [
        ("scan", "/scan"),
        ("/scan", "/scan"),
        ("rear_scan", "rear_scan"),
        ("/rear_scan", "rear_scan"),
    ] {
        assert_eq!(info.topic(named).map(|topic| topic.topic.as_str()), Some(recorded));
        assert_eq!(info.recorded_name(named), recorded);
        let (messages, _) = read_all(&bag, &Selection::default())?;
        let on_it: Vec<&str> =
            messages.iter().filter(|message| message.is_on(named)).map(|one| &*one.topic).collect();
        assert_eq!(on_it, [recorded]);
    }
    assert!(info.topic("front_scan").is_none());
    assert_eq!(info.recorded_name("front_scan"), "front_scan");
    Ok(())
}

/// Regression: it was found when the recording was finished.
#[test]
fn a_bag_in_place_of_a_folder_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let refused = BagWriter::create(folder.path()).err().unwrap();
    assert!(matches!(refused, BagError::Create { .. }), "{refused}");
    assert!(!BagWriter::temporary_of(folder.path()).exists());
}
