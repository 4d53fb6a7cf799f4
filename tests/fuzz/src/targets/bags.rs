//! Bags: MCAP, sqlite3, ROS 1, and rosbag2's metadata.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use bag_player::{Bag, BagWriter, OfferedQos, Selection, convert_ros1};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use msgs::RosMessage;
use msgs::sensor_msgs::LaserScan;
use msgs::std_msgs::String as Text;
use rusqlite::Connection;
use tempfile::TempDir;

use super::{OF_FILES, samples, text_of};
use crate::{MemoryBound, Target, checksums};

/// What is read at once (4 MiB), indices and decoders; what a chunk unpacks to. zstd's and SQLite's own memory is not counted: they
/// are written in C, and bound by `segment.rs` and by SQLite's page cache.
const BAG: MemoryBound = MemoryBound { base_bytes: 16 << 20, per_byte: 4096 };

const fn target(
    name: &'static str,
    body: fn(&[u8]),
    seeds: fn() -> Vec<Vec<u8>>,
    words: &'static [&'static [u8]],
) -> Target {
    Target { name, body, seeds, words, memory: BAG, gate_cases: OF_FILES }
}

pub(super) const TARGETS: &[Target] = &[
    target(
        "mcap",
        mcap_bag,
        mcap_bags,
        &[b"zstd", b"lz4", b"ros2msg", b"cdr", &[0x28, 0xb5, 0x2f, 0xfd]],
    ),
    target("sqlite", sqlite_bag, sqlite_bags, &[b"messages", b"topics", b"timestamp", b"BLOB"]),
    target("packed_bag", packed_bag, packed_bags, &[&[0x28, 0xb5, 0x2f, 0xfd]]),
    target(
        "ros1",
        ros1_bag,
        ros1_bags,
        &[b"conn=", b"op=", b"index_pos=", b"none", b"bz2", b"lz4"],
    ),
    target(
        "ros1_definition",
        ros1_definition,
        || {
            vec![b"Header header\nfloat32[] ranges\nPart[2] parts\n===\nMSG: p/Part\nstring name\nuint8 a\n".to_vec()]
        },
        &[
            b"\n===\nMSG: p/",
            b"\nstring ",
            b"\nuint8[",
            b"]",
            b"\nfloat64 ",
            b"\nHeader h",
            b"\nPart[] ",
            b"\nduration d",
        ],
    ),
    target(
        "bag_metadata",
        metadata,
        metadata_files,
        &[b"&a ", b"*a ", b"<<: *a", b"- ", b"  ", b": "],
    ),
    Target {
        gate_cases: 1000,
        ..target(
            "offered_qos",
            |bytes| {
                let _ = OfferedQos::from_yaml(text_of(bytes));
            },
            || vec![OfferedQos::latched().to_yaml().into_bytes()],
            &[b"- history: 3", b"depth: ", b"nsec: ", b"&a", b"*a"],
        )
    },
];

thread_local! {
    static FOLDER: OnceCell<TempDir> = const { OnceCell::new() };
}

/// A file of this name with these bytes, in a folder of this thread. It is in memory where the machine has such a folder.
pub(super) fn on_disk<T>(name: &str, bytes: &[u8], read: impl FnOnce(&Path) -> T) -> T {
    FOLDER.with(|folder| {
        let folder = folder.get_or_init(|| {
            let in_memory = PathBuf::from("/dev/shm");
            let within = if in_memory.is_dir() { in_memory } else { std::env::temp_dir() };
            tempfile::tempdir_in(within).expect("a folder can be made")
        });
        let path = folder.path().join(name);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).expect("a folder can be made");
        }
        std::fs::write(&path, bytes).expect("a file can be written");
        read(&path)
    })
}

/// All that the program asks of a bag.
fn read(path: &Path) {
    /// As many messages of a small file as any has; a hostile one may list one of them any number of times.
    const MOST_MESSAGES: usize = 20_000;
    let Ok(bag) = Bag::open(path) else { return };
    let _ = bag.info();
    let _ = bag.check();
    let Ok(mut messages) = bag.messages(&Selection::default()) else { return };
    for message in messages.by_ref().take(MOST_MESSAGES) {
        let Ok(message) = message else { break };
        let _ = message.decode::<Text>();
        let _ = message.decode::<LaserScan>();
    }
    assert!(messages.losses().iter().all(|loss| !loss.to_string().is_empty()));
}

fn mcap_bag(bytes: &[u8]) {
    on_disk("bag.mcap", &checksums::of_mcap(bytes), read);
}

fn mcap_bags() -> Vec<Vec<u8>> {
    let plain = || WriteOptions::new().compression(None);
    let options = [
        plain(),
        plain().use_chunks(false),
        WriteOptions::new().compression(Some(Compression::Zstd)).compression_threads(0),
        WriteOptions::new().compression(Some(Compression::Lz4)),
    ];
    options.into_iter().map(mcap_of).collect()
}

/// Two topics in two chunks.
fn mcap_of(options: WriteOptions) -> Vec<u8> {
    let mut writer = options
        .profile("ros2")
        .chunk_size(None)
        .create(Cursor::new(Vec::new()))
        .expect("in memory");
    let scan = samples::bytes(&samples::scan());
    let text = samples::bytes(&Text { data: "static static static static".to_owned() });
    for sequence in 0..4_u32 {
        let topics = [(Text::TYPE_NAME, "/text", &text), (LaserScan::TYPE_NAME, "/scan", &scan)];
        for (type_name, topic, data) in topics {
            let schema =
                writer.add_schema(type_name, "ros2msg", b"string data").expect("in memory");
            let channel_id =
                writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("in memory");
            let log_time = 1_700_000_000_000_000_000 + u64::from(sequence);
            let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, data).expect("in memory");
        }
        writer.flush().expect("in memory");
    }
    writer.finish().expect("in memory");
    writer.into_inner().into_inner()
}

fn sqlite_bag(bytes: &[u8]) {
    on_disk("bag.db3", bytes, read);
}

fn sqlite_bags() -> Vec<Vec<u8>> {
    let text = samples::bytes(&Text { data: "static static static static".to_owned() });
    let packed = zstd::encode_all(text.as_slice(), 1).expect("in memory");
    vec![database(&text), database(&packed)]
}

/// A database of rosbag2 with small pages, so that mutations meet something.
fn database(data: &[u8]) -> Vec<u8> {
    on_disk("made.db3", &[], |path| {
        std::fs::remove_file(path).expect("it was made above");
        let connection = Connection::open(path).expect("a database can be made");
        let tables = "PRAGMA page_size = 512;
            CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
                serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
            CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
            CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
        connection.execute_batch(tables).expect("a table can be made");
        let topic = "INSERT INTO topics VALUES (1, '/text', 'std_msgs/msg/String', 'cdr', ?1)";
        connection.execute(topic, [OfferedQos::latched().to_yaml()]).expect("a row");
        for stamp in 0..6_i64 {
            let row = "INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?1, ?2)";
            connection.execute(row, (stamp, data)).expect("a row");
        }
        drop(connection);
        std::fs::read(path).expect("it was written")
    })
}

/// The content of the zstd frame, or the frame itself where the bytes begin as one.
fn packed_bag(bytes: &[u8]) {
    if bytes.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
        on_disk("bag.mcap.zstd", bytes, read);
    } else if let Ok(packed) = zstd::encode_all(bytes, 1) {
        on_disk("bag.mcap.zstd", &packed, read);
    }
}

fn packed_bags() -> Vec<Vec<u8>> {
    let bag = mcap_of(WriteOptions::new().compression(None));
    vec![zstd::encode_all(bag.as_slice(), 1).expect("in memory"), bag]
}

fn ros1_bag(bytes: &[u8]) {
    on_disk("bag.bag", bytes, read);
}

/// A record of ROS 1 (format 2.0): the fields of its header, and its data.
fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let mut header = Vec::new();
    for (name, value) in fields {
        header.extend((name.len() as u32 + 1 + value.len() as u32).to_le_bytes());
        header.extend(name.as_bytes());
        header.push(b'=');
        header.extend(*value);
    }
    let mut record = (header.len() as u32).to_le_bytes().to_vec();
    record.extend(header);
    record.extend((data.len() as u32).to_le_bytes());
    record.extend(data);
    record
}

/// A bag of ROS 1 with a topic of a type, and messages of these bytes.
fn ros1_of(type_name: &str, definition: &str, messages: &[&[u8]]) -> Vec<u8> {
    /// The first record is padded to this length, after the line with the version.
    const HEADER_BYTES: usize = 4096;
    let about = record(
        &[
            ("topic", b"/topic"),
            ("type", type_name.as_bytes()),
            ("md5sum", b"0123456789abcdef0123456789abcdef"),
            ("message_definition", definition.as_bytes()),
        ],
        &[],
    );
    let inner = about.get(4..about.len() - 4).unwrap_or_default();
    let id = 0_u32.to_le_bytes();
    let connection = record(&[("op", &[7]), ("conn", &id), ("topic", b"/topic")], inner);
    let mut chunk = connection.clone();
    for message in messages {
        let time = 1_700_000_000_u64.to_le_bytes();
        chunk.extend(record(&[("op", &[2]), ("conn", &id), ("time", &time)], message));
    }
    let size = (chunk.len() as u32).to_le_bytes();
    let chunk = record(&[("op", &[5]), ("compression", b"none"), ("size", &size)], &chunk);
    let index_at = (13 + HEADER_BYTES + chunk.len()) as u64;
    let one = 1_u32.to_le_bytes();
    let fields: [(&str, &[u8]); 4] = [
        ("op", &[3]),
        ("index_pos", &index_at.to_le_bytes()),
        ("conn_count", &one),
        ("chunk_count", &one),
    ];
    let empty = record(&fields, &[]).len();
    let padding = vec![b' '; HEADER_BYTES - empty];
    let parts = [b"#ROSBAG V2.0\n".to_vec(), record(&fields, &padding), chunk, connection];
    parts.concat()
}

fn ros1_bags() -> Vec<Vec<u8>> {
    let message = [3, 0, 0, 0, b'a', b'b', b'c'];
    vec![ros1_of("std_msgs/String", "string data\n", &[&message, &message])]
}

/// The definition of a message, and behind a zero a message of it.
fn ros1_definition(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let definition = text_of(parts.next().unwrap_or_default());
    let message = parts.next().unwrap_or(&[0; 64]);
    let bag = ros1_of("p/Whole", definition, &[message]);
    on_disk("defined.bag", &bag, |path| {
        let _ = convert_ros1(path, &path.with_extension("mcap"), || true);
    });
}

fn metadata(bytes: &[u8]) {
    on_disk("folder/metadata.yaml", bytes, |path| {
        if let Some(folder) = path.parent() {
            read(folder);
        }
    });
}

fn metadata_files() -> Vec<Vec<u8>> {
    on_disk("folder/bag.mcap", &[], |path| {
        let mut bag = BagWriter::create(path).expect("a bag can be made");
        let channel = bag.channel::<Text>("/text", OfferedQos::latched()).expect("a topic");
        let text = Text { data: "static".to_owned() };
        bag.write(channel, samples::STAMP, &text).expect("a message");
        bag.finish().expect("a bag can be written");
    });
    let yaml = "rosbag2_bagfile_information:\n  version: 8\n  storage_identifier: mcap\n  duration:\n    \
         nanoseconds: 5\n  relative_file_paths:\n    - bag.mcap\n  topics_with_message_count:\n    - \
         topic_metadata:\n        name: /text\n        type: std_msgs/msg/String\n        \
         serialization_format: cdr\n        offered_qos_profiles: \"- history: 3\\n  depth: 0\"\n      \
         message_count: 1\n  compression_format: \"\"\n  compression_mode: \"\"\n  files:\n    - path: \
         bag.mcap\n      message_count: 1\n";
    vec![yaml.as_bytes().to_vec()]
}
