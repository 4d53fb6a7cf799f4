//! rosbag2 directories, as recorded by rosbag2 itself.

use std::fs;
use std::path::Path;

use msgs::std_msgs::String as Text;

use super::{committed, read_all, recorded};
use crate::{Bag, BagError, LossKind, OfferedQos, Selection};

fn copy_files(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
    }
}

fn metadata_of(files: &[(&str, u64)]) -> String {
    let listed: String = files.iter().map(|(name, _)| format!("    - {name}\n")).collect();
    let counted: String = files
        .iter()
        .map(|(name, count)| format!("    - path: {name}\n      message_count: {count}\n"))
        .collect();
    format!(
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  compression_mode: \"\"\n  \
         relative_file_paths:\n{listed}  files:\n{counted}"
    )
}

#[test]
fn a_recorded_directory_is_read() -> Result<(), BagError> {
    let bag = Bag::open(&committed("rosbag2/talker"))?;
    let info = bag.info()?;
    let counts: Vec<(&str, u64)> =
        info.topics.iter().map(|topic| (topic.topic.as_str(), topic.message_count)).collect();
    assert_eq!(counts, [("/parameter_events", 0), ("/rosout", 10), ("/topic", 10)]);
    assert_eq!(info.start.unwrap().as_nanos(), 1_585_866_235_112_411_371);
    assert!((info.duration_s - 4.531_096_768).abs() < 1e-9);
    assert_eq!(info.topics[2].qos, Some(OfferedQos::reliable(10)));
    assert_eq!((&info.losses, &info.remarks), (&Vec::new(), &Vec::new()));

    let selection = Selection { topics: Some(vec!["/topic".into()]), ..Selection::default() };
    let (messages, _) = read_all(&bag, &selection)?;
    let texts: Vec<String> = messages
        .iter()
        .map(|message| Ok(message.decode::<Text>()?.data))
        .collect::<Result<_, BagError>>()?;
    assert_eq!(texts.first().map(String::as_str), Some("Hello, world! 0"));
    assert_eq!(texts.last().map(String::as_str), Some("Hello, world! 9"));

    let by_metadata = Bag::open(&committed("rosbag2/talker/metadata.yaml"))?;
    assert_eq!(by_metadata.info()?.topics, info.topics);
    Ok(())
}

#[test]
fn split_files_are_one_bag_without_metadata_and_say_so() -> Result<(), BagError> {
    let bag = Bag::open(&committed("rosbag2/multiple_files"))?;
    let (messages, losses) = read_all(&bag, &Selection::default())?;
    assert_eq!(losses, []);
    let each: usize = (0..3)
        .map(|number| {
            let file = committed(&format!("rosbag2/multiple_files/multiple_files_{number}.mcap"));
            Ok(read_all(&Bag::open(&file)?, &Selection::default())?.0.len())
        })
        .sum::<Result<usize, BagError>>()?;
    assert_eq!(messages.len(), each);
    assert!(messages.is_sorted_by_key(|message| message.log_time));
    let info = bag.info()?;
    assert_eq!(info.files.len(), 3);
    assert_eq!(info.message_count, each as u64);
    assert!(info.to_string().contains("note: no metadata.yaml: the 3 .mcap files"), "{info}");
    Ok(())
}

#[test]
fn a_missing_split_file_is_a_loss() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    copy_files(&committed("rosbag2/multiple_files"), folder.path());
    let names = ["multiple_files_0.mcap", "multiple_files_1.mcap", "multiple_files_2.mcap"];
    fs::write(
        folder.path().join("metadata.yaml"),
        metadata_of(&[(names[0], 100), (names[1], 101), (names[2], 102)]),
    )
    .unwrap();
    let whole = read_all(&Bag::open(folder.path())?, &Selection::default())?.0.len();
    let second = folder.path().join(names[1]);
    let in_second = read_all(&Bag::open(&second)?, &Selection::default())?.0.len();

    fs::remove_file(&second).unwrap();
    let (messages, losses) = read_all(&Bag::open(folder.path())?, &Selection::default())?;
    assert_eq!(messages.len(), whole - in_second);
    assert_eq!(losses.len(), 1);
    assert_eq!((&losses[0].kind, losses[0].messages), (&LossKind::MissingFile, Some(101)));
    assert!(losses[0].to_string().ends_with("the file is missing; 101 messages lost"));

    fs::write(&second, "no bag").unwrap();
    let (messages, losses) = read_all(&Bag::open(folder.path())?, &Selection::default())?;
    assert_eq!(messages.len(), whole - in_second);
    assert!(matches!(losses[0].kind, LossKind::UnreadableFile { .. }));

    for name in names {
        fs::remove_file(folder.path().join(name)).unwrap();
    }
    let none = Bag::open(folder.path()).unwrap_err().to_string();
    assert!(none.starts_with("none of the 3 files"), "{none}");
    Ok(())
}

#[test]
fn files_outside_of_the_directory_are_not_opened() {
    let folder = tempfile::tempdir().unwrap();
    let outside = committed("rosbag2/talker/talker.mcap");
    fs::write(
        folder.path().join("metadata.yaml"),
        metadata_of(&[(outside.to_str().unwrap(), 20), ("../talker.mcap", 20)]),
    )
    .unwrap();
    assert!(matches!(Bag::open(folder.path()), Err(BagError::NoFileLeft { listed: 2, .. })));
}

#[test]
fn other_storages_and_compressions_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |metadata: &str| {
        fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
        Bag::open(folder.path()).unwrap_err().to_string()
    };
    let listed = metadata_of(&[("bag_0.mcap", 1)]);
    let compressed =
        refused(&listed.replace("mode: \"\"", "mode: FILE\n  compression_format: lz4"));
    assert!(compressed.contains("(mode FILE) in the format `lz4`"), "{compressed}");
    let other = refused(&listed.replace("identifier: mcap", "identifier: my_storage"));
    assert!(other.contains("uses the storage `my_storage`"), "{other}");
    assert!(refused("nonsense: [").contains("cannot be parsed"));
    assert!(refused(&metadata_of(&[])).contains("cannot be parsed"));
}

#[test]
fn directories_without_a_bag_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let empty = Bag::open(folder.path()).unwrap_err().to_string();
    assert!(empty.contains("holds neither metadata.yaml nor an .mcap or .db3 file"), "{empty}");
}

#[test]
fn later_metadata_with_its_profiles_in_yaml_proper_is_read() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(
        committed("rosbag2/multiple_files/multiple_files_0.mcap"),
        folder.path().join("bag_0.mcap"),
    )
    .unwrap();
    let topics = "  topics_with_message_count:\n    - topic_metadata:\n        name: /other\n        \
                  type: std_msgs/msg/String\n        serialization_format: cdr\n        offered_qos_profiles:\n          \
                  - history: keep_last\n            depth: 1\n            reliability: reliable\n            \
                  durability: transient_local\n      message_count: 0\n";
    let metadata = metadata_of(&[("bag_0.mcap", 1)]) + topics;
    fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let bag = Bag::open(folder.path())?;
    assert_eq!(bag.listed_qos("/other"), Some(OfferedQos::latched()));
    Ok(())
}

#[test]
fn every_recorded_mcap_sample_is_read() {
    let Some(folder) = recorded("rosbag2-samples") else { return };
    for path in super::files_below(&folder, "mcap") {
        let bag = Bag::open(&path).unwrap();
        let (messages, losses) = read_all(&bag, &super::every_encoding()).unwrap();
        assert_eq!(losses, [], "{}", path.display());
        assert_eq!(bag.info().unwrap().message_count, messages.len() as u64, "{}", path.display());
    }
}
