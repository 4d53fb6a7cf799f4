//! Bags of every format, told by their content: what each subcommand does with them, and what it says of those that
//! cannot be read.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::Command;

use bag_player::{Bag, BagMessage, Selection};
use rusqlite::Connection;

use crate::bags::small_room;
use crate::program::{stillmap, succeed, summary};
use crate::python::python_with;

/// A recorded bag of rosbag2, in the storage sqlite3.
fn talker() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../nodes/bag-player/tests/data/rosbag2/sqlite3/talker/talker.db3")
}

fn messages_of(bag: &Path) -> Vec<BagMessage> {
    let messages = Bag::open(bag).unwrap().messages(&Selection::default()).unwrap();
    messages.map(Result::unwrap).collect()
}

/// A bag as rosbag2 of the first version would have stored it.
fn as_database(bag: &Path, path: &Path) {
    let database = Connection::open(path).unwrap();
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
             serialization_format TEXT NOT NULL);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, \
             data BLOB NOT NULL);
             CREATE INDEX timestamp_idx ON messages (timestamp ASC);
             BEGIN;",
        )
        .unwrap();
    let mut topics: BTreeMap<String, i64> = BTreeMap::new();
    for message in messages_of(bag) {
        let id = topics.len() as i64 + 1;
        let id = *topics.entry(message.topic.to_string()).or_insert_with(|| {
            let insert = "INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr')";
            database.execute(insert, (id, &*message.topic, &*message.type_name)).unwrap();
            id
        });
        let insert = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
        database.execute(insert, (id, message.log_time.as_nanos(), message.data)).unwrap();
    }
    database.execute_batch("COMMIT").unwrap();
}

#[test]
fn one_recording_gives_one_map_in_every_storage() {
    let folder = tempfile::tempdir().unwrap();
    let mcap = small_room(folder.path());
    let name = |ending: &str| folder.path().join(format!("{ending}/small.mcap"));
    for place in ["database", "packed"] {
        std::fs::create_dir(folder.path().join(place)).unwrap();
    }
    as_database(&mcap, &name("database"));
    let bytes = std::fs::read(name("database")).unwrap();
    std::fs::write(name("packed"), zstd::encode_all(bytes.as_slice(), 1).unwrap()).unwrap();

    let run = |bag: &Path, out: &str| {
        let out = folder.path().join(out);
        let arguments =
            ["run", bag.to_str().unwrap(), "--no-timing", "--out", out.to_str().unwrap()];
        succeed(arguments);
        (summary(&out), std::fs::read(out.join("map.ply")).unwrap())
    };
    let expected = run(&mcap, "mcap-out");
    assert!(expected.0["cycles"]["total"].as_u64().unwrap() > 10);
    for place in ["database", "packed"] {
        assert!(run(&name(place), &format!("{place}-out")) == expected, "{place}");
        let info = succeed(["info", name(place).to_str().unwrap()]);
        assert!(info.contains("storage    sqlite3"), "{info}");
        let doctor = |bag: &Path| stillmap(["doctor", bag.to_str().unwrap()]).stdout;
        assert_eq!(doctor(&name(place)), doctor(&mcap), "{place}");
    }
    let copy = folder.path().join("copy.mcap");
    succeed(["import", "bag", name("database").to_str().unwrap(), "-o", copy.to_str().unwrap()]);
    assert!(messages_of(&copy) == messages_of(&mcap));
}

#[test]
fn a_recorded_database_is_imported_and_played() {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("talker.mcap");
    let (bag, to) = (talker(), copy.to_str().unwrap().to_owned());
    let said = succeed(["import", "bag", bag.to_str().unwrap(), "-o", &to]);
    assert!(said.contains("20 messages"), "{said}");
    assert!(messages_of(&copy) == messages_of(&bag));
    let played = succeed(["play", bag.to_str().unwrap(), "--rate", "20", "--json"]);
    let played: serde_json::Value = serde_json::from_str(&played).unwrap();
    let topics = played["topics"].as_array().unwrap();
    let published: u64 = topics.iter().map(|topic| topic["published"].as_u64().unwrap()).sum();
    assert_eq!(published, 20, "{played}");
}

/// An MCAP file with a topic of scans in another encoding.
fn encoded_as(encoding: &str) -> Vec<u8> {
    let mut writer = mcap::Writer::new(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/LaserScan", "jsonschema", b"{}").unwrap();
    let channel = writer.add_channel(schema, "/scan", encoding, &BTreeMap::new()).unwrap();
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: 0,
        log_time: 1,
        publish_time: 1,
    };
    writer.write_to_known_channel(&header, b"{}").unwrap();
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A database in which one of two rows makes no sense.
fn with_a_bad_row(folder: &Path) -> Vec<u8> {
    let path = folder.join("bad-row");
    std::fs::copy(talker(), &path).unwrap();
    let change = "UPDATE messages SET timestamp = -1 WHERE id = 3";
    Connection::open(&path).unwrap().execute(change, []).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn what_cannot_be_read_is_said_with_the_fix_and_an_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let database = std::fs::read(talker()).unwrap();
    // Without its last page, which holds no message.
    let cut = &database[..6 * 4096];
    let ros1 = b"#ROSBAG V2.0\n\x45\0\0\0index_pos=\0\0\0\0\0\0\0\0".to_vec();
    let inputs: [(&str, Vec<u8>); 10] = [
        ("cut.db3", cut.to_vec()),
        ("head.db3", database[..300].to_vec()),
        ("row.db3", with_a_bad_row(folder.path())),
        ("unclosed.bag", ros1),
        ("json.mcap", encoded_as("json")),
        ("protobuf.mcap", encoded_as("protobuf")),
        // Regression: of a bag of ROS 1 in MCAP the advice was that of a bag without a scanner, and the import was empty.
        ("ros1.mcap", encoded_as("ros1")),
        ("cut.db3.zstd", zstd::encode_all(cut, 1).unwrap()),
        ("diary.zst", zstd::encode_all(&b"dear diary"[..], 1).unwrap()),
        ("diary.txt", b"dear diary".to_vec()),
    ];
    for (name, bytes) in &inputs {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    for (line, wanted, code) in [
        ("info @cut.db3", "lost: @cut.db3: 4096 bytes at 24576: the file is cut off here", 3),
        ("import bag @cut.db3 -o @out.mcap", "the file is cut off here", 3),
        ("info @cut.db3.zstd", "zstd, the whole file", 3),
        ("info @head.db3", "head.db3 cannot be read as a bag of the storage sqlite3", 1),
        ("run @head.db3 --out @out", "head.db3 cannot be read as a bag of the storage sqlite3", 1),
        ("play @head.db3", "head.db3 cannot be read as a bag of the storage sqlite3", 1),
        ("doctor @head.db3", "head.db3 cannot be read as a bag of the storage sqlite3", 1),
        ("import bag @head.db3 -o @out.mcap", "cannot be read as a bag of the storage sqlite3", 1),
        ("info @row.db3", "its time is not a number of nanoseconds since 1970); 1 message lost", 3),
        ("play @row.db3 --rate 20", "its time is not a number", 3),
        ("run @row.db3 --out @out", "no topic of type sensor_msgs/msg/LaserScan", 1),
        ("run @unclosed.bag --out @out", "`rosbag reindex` fixes that", 1),
        ("import ros1 @unclosed.bag -o @out.mcap", "`rosbag reindex` fixes that", 1),
        ("import ros1 @diary.txt -o @out.mcap", "it begins with 64 65 61 72", 1),
        ("info @json.mcap", "[json, not played]", 0),
        ("play @json.mcap", "its messages are encoded as json", 1),
        ("run @json.mcap --out @out", "it has messages in json", 1),
        ("run @json.mcap --scan /scan --out @out", "topic /scan is encoded as json", 1),
        ("run @protobuf.mcap --pose lidar --out @out", "it has messages in protobuf", 1),
        ("import bag @protobuf.mcap -o @out.mcap", "it has messages in protobuf", 1),
        ("run @ros1.mcap --out @out", "give the .bag itself, which is read", 1),
        ("import bag @ros1.mcap -o @out.mcap", "give the .bag itself, which is read", 1),
        ("info @diary.zst", "compressed with zstd, and within it it begins with 64 65", 1),
        ("run @diary.txt --out @out", "it begins with 64 65 61 72", 1),
    ] {
        let at = |text: &str| text.replace('@', &format!("{}/", folder.path().display()));
        let _ = std::fs::remove_file(folder.path().join("out.mcap"));
        let output = stillmap(line.split(' ').map(at));
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert_eq!(output.status.code(), Some(code), "{line}: {said}");
        assert!(said.contains(&at(wanted)), "{line}: no '{wanted}' in: {said}");
        for other in ["ros2 bag convert", "rosbags", "mcap convert", "panicked"] {
            assert!(!said.contains(other), "{line}: {said}");
        }
    }
}

/// Reads a database as rosbags does, and prints for each the number of messages and a checksum of them.
const READ_BY_ROSBAGS: &str = "
import struct, sys, zlib
from pathlib import Path
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader
for path in sys.argv[1:]:
    reader = Sqlite3Reader(Path(path))
    reader.open()
    count, crc = 0, 0
    for connection, time, data in reader.messages(reader.connections):
        count += 1
        crc = zlib.crc32(struct.pack('<q', time) + connection.topic.encode() + bytes(data), crc)
    reader.close()
    print(count, crc)
";

#[test]
fn rosbags_reads_the_same_of_every_recorded_database() {
    let Some(python) = python_with("rosbags") else { return };
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    for folder in ["../nodes/bag-player/tests/data/rosbag2", "../../shared/data/rosbag2-samples"] {
        databases_below(&here.join(folder), &mut paths);
    }
    assert!(paths.len() >= 3);
    let output = Command::new(python).args(["-c", READ_BY_ROSBAGS]).args(&paths).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let theirs = String::from_utf8(output.stdout).unwrap();
    let ours: String = paths
        .iter()
        .map(|path| {
            let selection = Selection { all_encodings: true, ..Selection::default() };
            let (mut count, mut hasher) = (0, crc32fast::Hasher::new());
            for message in Bag::open(path).unwrap().messages(&selection).unwrap() {
                let message = message.unwrap();
                hasher.update(&message.log_time.as_nanos().to_le_bytes());
                hasher.update(message.topic.as_bytes());
                hasher.update(&message.data);
                count += 1;
            }
            format!("{count} {}\n", hasher.finalize())
        })
        .collect();
    assert_eq!(ours, theirs, "{paths:?}");
}

/// Nothing where there is no such folder.
fn databases_below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            databases_below(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "db3") {
            found.push(path);
        }
    }
}
