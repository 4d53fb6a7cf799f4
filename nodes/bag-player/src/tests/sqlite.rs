//! rosbag2's sqlite3 storage: recorded files, and databases made for a test.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use msgs::RosMessage;
use msgs::std_msgs::String as Text;

use super::samples::{TYPE_HASH, database, insert, insert_text, on_disk, text, texts_in_chunks};
use super::{committed, every_encoding, files_below, read_all, recorded};
use crate::info::Storage;
use crate::message::Filter;
use crate::sqlite::{Database, Paths, Rows};
use crate::{Bag, BagError, BagMessage, OfferedQos, Selection};

/// The result of rosbags 0.11.9 on the recorded samples: messages, bytes of their data, and the CRC-32 of their times
/// (8 bytes, little endian), topics and data, in the order of the times.
const GOLDEN: [(&str, u64, usize, u32); 12] = [
    ("evo/tf_example/tf_example.db3", 518, 55944, 0xbfe5_8e4f),
    ("rosbag2/ros2bag/test/resources/empty_bag/empty_bag_0.db3", 0, 0, 0),
    ("rosbag2/rosbag2_cpp/test/rosbag2_cpp/bags/topics_and_services.db3", 13, 1444, 0xe97e_b19a),
    (
        "rosbag2/rosbag2_py/test/resources/sqlite3/convert_a/rewriter_a_0.db3",
        150,
        3100,
        0x4867_d4b2,
    ),
    (
        "rosbag2/rosbag2_py/test/resources/sqlite3/convert_b/rewriter_b_0.db3",
        75,
        11375,
        0xa092_763f,
    ),
    (
        "rosbag2/rosbag2_py/test/resources/sqlite3/reindex_test_bags/multiple_files/multiple_files_0.db3",
        1324,
        21184,
        0x1f42_2ce6,
    ),
    (
        "rosbag2/rosbag2_py/test/resources/sqlite3/reindex_test_bags/multiple_files/multiple_files_1.db3",
        1324,
        21184,
        0xae56_1382,
    ),
    (
        "rosbag2/rosbag2_py/test/resources/sqlite3/reindex_test_bags/multiple_files/multiple_files_2.db3",
        529,
        8464,
        0x4dc9_da5e,
    ),
    ("rosbag2/rosbag2_py/test/resources/sqlite3/talker/talker.db3", 20, 2000, 0xb6cc_367c),
    (
        "rosbag2/rosbag2_transport/test/resources/sqlite3/rewriter_a/rewriter_a_0.db3",
        150,
        3100,
        0x4867_d4b2,
    ),
    (
        "rosbag2/rosbag2_transport/test/resources/sqlite3/rewriter_b/rewriter_b_0.db3",
        75,
        11375,
        0xa092_763f,
    ),
    (
        "rosbag2/rosbag2_transport/test/resources/sqlite3/test_bag_for_seek/test_bag_for_seek_0.db3",
        5,
        260,
        0x8b8f_48aa,
    ),
];

fn checksum(messages: &[BagMessage]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for message in messages {
        hasher.update(&message.log_time.as_nanos().to_le_bytes());
        hasher.update(message.topic.as_bytes());
        hasher.update(&message.data);
    }
    hasher.finalize()
}

fn is_golden(path: &Path, (name, messages, bytes, crc): (&str, u64, usize, u32)) {
    let bag = Bag::open(path).unwrap();
    let (read, losses) = read_all(&bag, &every_encoding()).unwrap();
    let read_bytes: usize = read.iter().map(|message| message.data.len()).sum();
    let found = (read.len() as u64, read_bytes, checksum(&read));
    assert_eq!((found, losses), ((messages, bytes, crc), vec![]), "{name}");
    for info in [bag.info().unwrap(), bag.check().unwrap()] {
        assert_eq!((info.message_count, info.losses), (messages, vec![]), "{name}");
        assert_eq!(info.start, read.first().map(|message| message.log_time), "{name}");
        assert_eq!(info.end, read.last().map(|message| message.log_time), "{name}");
    }
}

#[test]
fn every_recorded_sample_gives_what_rosbags_reads() {
    for golden in GOLDEN {
        let folder =
            golden.0.rsplit_once("sqlite3/").map_or("empty_bag/empty_bag_0.db3", |(_, name)| name);
        let path = match folder.split_once('/') {
            Some(("talker" | "test_bag_for_seek", _)) => committed("rosbag2/sqlite3").join(folder),
            Some(("empty_bag", _)) => committed("rosbag2").join(folder),
            _ => continue,
        };
        if golden.0.ends_with(folder) {
            is_golden(&path, golden);
        }
    }
    let Some(samples) = recorded("rosbag2-samples") else { return };
    let found = files_below(&samples, "db3");
    assert_eq!(found.len(), GOLDEN.len());
    for golden in GOLDEN {
        is_golden(&samples.join(golden.0), golden);
    }
}

#[test]
fn a_recorded_directory_of_databases_is_read() -> Result<(), BagError> {
    let bag = Bag::open(&committed("rosbag2/sqlite3/talker"))?;
    let info = bag.info()?;
    let counts: Vec<(&str, u64)> =
        info.topics.iter().map(|topic| (topic.topic.as_str(), topic.message_count)).collect();
    assert_eq!(counts, [("/parameter_events", 0), ("/rosout", 10), ("/topic", 10)]);
    assert_eq!(info.topics[2].qos, Some(OfferedQos::reliable(10)));
    assert_eq!((info.files[0].storage, info.remarks.len()), (Storage::Sqlite3, 0));
    // The same recording as an MCAP file.
    let mcap = Bag::open(&committed("rosbag2/talker"))?;
    assert_eq!(read_all(&bag, &Selection::default())?.0, read_all(&mcap, &Selection::default())?.0);
    let printed = info.to_string();
    assert!(printed.contains("storage    sqlite3, compression none"), "{printed}");
    Ok(())
}

/// Texts of both topics, ten of each, in another order than that of their times.
fn fill(connection: &rusqlite::Connection, offset: i64) {
    for index in (0..10).rev() {
        insert_text(connection, "/a", offset + index * 1_000_000_000);
        insert_text(connection, "/b", offset + index * 1_000_000_000 + 500_000_000);
    }
}

#[test]
fn every_version_of_the_schema_is_read() -> Result<(), BagError> {
    for version in 1..=4 {
        let folder = tempfile::tempdir().unwrap();
        // The name does not matter.
        let path = folder.path().join("bag?of #version%20.mcap");
        fill(&database(&path, version, OfferedQos::latched()), 5_000_000_000);
        let bag = Bag::open(&path)?;
        let (messages, losses) = read_all(&bag, &Selection::default())?;
        assert_eq!((messages.len(), &losses), (20, &vec![]), "version {version}");
        assert!(messages.is_sorted_by_key(|message| message.log_time));
        let first = messages[0].decode::<Text>()?;
        assert_eq!(first, text("/a", 5_000_000_000));

        let info = bag.info()?;
        let topic = &info.topics[1];
        assert_eq!((topic.topic.as_str(), topic.message_count), ("/b", 10));
        assert!(
            (topic.rate_hz.unwrap() - 1.0).abs() < 1e-9 && (info.duration_s - 9.5).abs() < 1e-9
        );
        assert_eq!(topic.qos, (version > 1).then(OfferedQos::latched), "version {version}");
        assert_eq!(topic.definition, (version > 3).then(Text::schema), "version {version}");
        assert_eq!(topic.type_hash.as_deref(), (version > 3).then_some(TYPE_HASH));
        let writer = &info.files[0].library;
        assert!(writer.contains(&format!("schema {version}")), "{writer}");

        let selection = Selection {
            topics: Some(vec!["b".into()]),
            start_s: Some(2.0),
            duration_s: Some(3.0),
            ..Selection::default()
        };
        let (some, _) = read_all(&bag, &selection)?;
        let times: Vec<i64> = some.iter().map(|message| message.log_time.as_nanos()).collect();
        assert_eq!(times, [7_500_000_000, 8_500_000_000, 9_500_000_000]);
        let missing = Selection { topics: Some(vec!["/c".into()]), ..Selection::default() };
        assert!(matches!(bag.messages(&missing), Err(BagError::NoSuchTopic { .. })));
    }
    Ok(())
}

#[test]
fn split_databases_are_one_bag() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, offset) in [("bag_0.db3", 0), ("bag_1.db3", 5_250_000_000)] {
        fill(&database(&folder.path().join(name), 3, OfferedQos::reliable(1)), offset);
    }
    let bag = Bag::open(folder.path())?;
    let (messages, losses) = read_all(&bag, &Selection::default())?;
    assert_eq!((messages.len(), losses), (40, vec![]));
    assert!(messages.is_sorted_by_key(|message| message.log_time));
    let remark = &bag.info()?.remarks[0];
    assert!(remark.contains("the 2 .db3 files"), "{remark}");

    // Beside MCAP files they may be the same bag once more.
    let mcap = texts_in_chunks(mcap::WriteOptions::new(), &[&[("/a", 1)]]);
    fs::write(folder.path().join("bag.mcap"), mcap).unwrap();
    let both = Bag::open(folder.path())?.info()?;
    assert_eq!(both.message_count, 1);
    assert_eq!(both.remarks[1], "its 2 .db3 files are not read");
    Ok(())
}

#[test]
fn more_rows_than_a_page_come_in_the_order_of_the_file() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.db3");
    let connection = database(&path, 4, OfferedQos::reliable(1));
    connection.execute_batch("BEGIN").unwrap();
    let count = 70_000_u32;
    for number in 0..count {
        insert(&connection, 1, 7, &number.to_le_bytes());
    }
    connection.execute_batch("COMMIT").unwrap();
    for without_index in [false, true] {
        if without_index {
            connection.execute_batch("DROP INDEX timestamp_idx").unwrap();
        }
        let messages = Bag::open(&path)?.messages(&Selection::default())?;
        let read: Vec<u32> = messages
            .map(|message| Ok(u32::from_le_bytes(message?.data.try_into().unwrap())))
            .collect::<Result<_, BagError>>()?;
        assert!(read.into_iter().eq(0..count));
    }
    Ok(())
}

#[test]
fn no_more_is_read_at_once_than_a_batch() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.db3");
    let connection = database(&path, 4, OfferedQos::reliable(1));
    for time in 0..12 {
        insert(&connection, 1 + time % 2, time, &vec![0; 1 << 20]);
    }
    let paths = Paths { named: &path, opened: &path };
    let (database, _) = Database::open(paths)?;
    let filter = Filter::all();
    let mut rows = Rows::open(paths, &database, &filter)?;
    let (mut times, mut batches) = (Vec::new(), 0);
    while rows.next_ns().is_some() {
        let batch = rows.batch(&filter);
        assert!((1..=4).contains(&batch.len()), "{}", batch.len());
        times.extend(batch.iter().map(|row| row.log_time_ns));
        batches += 1;
    }
    assert_eq!((times, batches), ((0..12).collect(), 3));
    Ok(())
}

/// Every file of a folder with its content.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    paths.map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

#[test]
fn a_write_ahead_log_is_read_and_nothing_is_written_beside_it() -> Result<(), BagError> {
    let recording = tempfile::tempdir().unwrap();
    let path = recording.path().join("bag_0.db3");
    let connection = database(&path, 4, OfferedQos::reliable(1));
    connection.pragma_update(None, "journal_mode", "WAL").unwrap();
    connection.pragma_update(None, "wal_autocheckpoint", 0).unwrap();
    fill(&connection, 0);
    // The files of a recorder that was killed, with and without the index of the log.
    for with_index in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        for ending in ["", "-wal", "-shm"] {
            let name = format!("bag_0.db3{ending}");
            if ending != "-shm" || with_index {
                fs::copy(recording.path().join(&name), folder.path().join(&name)).unwrap();
            }
        }
        let before = contents(folder.path());
        assert!(before[&folder.path().join("bag_0.db3-wal")].len() > 1000);
        let bag = Bag::open(&folder.path().join("bag_0.db3"))?;
        let (messages, losses) = read_all(&bag, &Selection::default())?;
        assert_eq!((messages.len(), losses), (20, vec![]));
        assert_eq!(bag.info()?.message_count, 20);
        assert!(contents(folder.path()) == before);
    }
    Ok(())
}

#[test]
fn reading_writes_nothing_beside_the_bag() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.db3");
    let connection = database(&path, 4, OfferedQos::reliable(1));
    connection.pragma_update(None, "journal_mode", "WAL").unwrap();
    fill(&connection, 0);
    drop(connection);
    let before = contents(folder.path());
    assert_eq!(before.len(), 1);
    assert_eq!(read_all(&Bag::open(&path)?, &Selection::default())?.0.len(), 20);
    assert!(contents(folder.path()) == before);
    Ok(())
}

fn packed(data: &[u8]) -> Vec<u8> {
    zstd::encode_all(data, 1).unwrap()
}

#[test]
fn what_rosbag2_compressed_is_read() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let plain = folder.path().join("bag_0.db3");
    fill(&database(&plain, 4, OfferedQos::reliable(1)), 0);
    let expected = read_all(&Bag::open(&plain)?, &Selection::default())?.0;

    let by_message = folder.path().join("messages.db3");
    let connection = database(&by_message, 4, OfferedQos::reliable(1));
    for message in &expected {
        let topic = if &*message.topic == "/a" { 1 } else { 2 };
        insert(&connection, topic, message.log_time.as_nanos(), &packed(&message.data));
    }
    let bag = Bag::open(&by_message)?;
    assert_eq!(read_all(&bag, &Selection::default())?, (expected.clone(), vec![]));
    assert_eq!(bag.info()?.files[0].compression, ["zstd, each message"]);

    let whole = tempfile::tempdir().unwrap();
    let path = whole.path().join("bag_0.db3.zstd");
    fs::write(&path, packed(&fs::read(&plain).unwrap())).unwrap();
    // The folder without metadata, with it, and with it after the file was compressed.
    let metadata = |name: &str| {
        format!(
            "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  compression_format: zstd\n  \
             compression_mode: FILE\n  relative_file_paths:\n    - {name}\n"
        )
    };
    for listed in [None, Some("bag_0.db3.zstd"), Some("bag_0.db3")] {
        if let Some(listed) = listed {
            fs::write(whole.path().join("metadata.yaml"), metadata(listed)).unwrap();
        }
        let bag = Bag::open(whole.path())?;
        assert_eq!(read_all(&bag, &Selection::default())?, (expected.clone(), vec![]));
        let info = bag.info()?;
        assert_eq!(info.files[0].compression, ["zstd, the whole file"]);
        assert_eq!((info.message_count, &info.files[0].path), (20, &path));
    }
    let other = metadata("bag_0.db3.lz4").replace("zstd", "lz4");
    fs::write(whole.path().join("metadata.yaml"), other).unwrap();
    assert!(matches!(Bag::open(whole.path()), Err(BagError::OuterCompression { .. })));
    Ok(())
}

#[test]
fn an_mcap_file_that_rosbag2_compressed_is_read() -> Result<(), BagError> {
    let bytes = texts_in_chunks(mcap::WriteOptions::new(), &[&[("/a", 1), ("/b", 2)]]);
    let (_plain, plain) = on_disk(&bytes);
    let (_folder, whole) = on_disk(&packed(&bytes));
    let expected = read_all(&Bag::open(&plain)?, &Selection::default())?;
    assert_eq!(read_all(&Bag::open(&whole)?, &Selection::default())?, expected);
    let (_folder, other) = on_disk(&packed(b"a diary"));
    let refused = Bag::open(&other).unwrap_err().to_string();
    assert!(
        refused.contains("compressed with zstd, and within it it begins with 61 20"),
        "{refused}"
    );
    Ok(())
}
