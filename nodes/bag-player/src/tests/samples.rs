//! Small bags made for a test.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use msgs::std_msgs::String as Text;
use msgs::{RosMessage, cdr};
use rusqlite::{Connection, ToSql};
use tempfile::TempDir;

use crate::OfferedQos;

/// A writer of a bag in memory.
pub(super) type MemoryWriter = Writer<Cursor<Vec<u8>>>;

/// A bag written with the mcap crate's own writer: texts of topics at given times, a chunk for each
/// slice of `chunks`.
pub(super) fn texts_in_chunks(options: WriteOptions, chunks: &[&[(&str, u64)]]) -> Vec<u8> {
    let mut writer: MemoryWriter =
        options.profile("ros2").chunk_size(None).create(Cursor::new(Vec::new())).unwrap();
    let mut sequence = 0;
    for chunk in chunks {
        for (topic, log_time) in *chunk {
            write_text(&mut writer, topic, sequence, *log_time);
            sequence += 1;
        }
        writer.flush().unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// Adds a text to a bag: long enough and little enough alike that compression leaves some of it.
pub(super) fn write_text(writer: &mut MemoryWriter, topic: &str, sequence: u32, log_time: u64) {
    let schema = writer.add_schema(Text::TYPE_NAME, "ros2msg", Text::schema().as_bytes()).unwrap();
    let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
    let data = cdr::encode(&text(topic, log_time)).unwrap();
    writer.write_to_known_channel(&header, &data).unwrap();
}

/// The text that [`write_text`] writes.
pub(super) fn text(topic: &str, log_time: u64) -> Text {
    let mut state = log_time.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let noise: String = (0..40)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            char::from(b'a' + (state % 26) as u8)
        })
        .collect();
    Text { data: format!("{topic} {log_time} {noise}") }
}

/// The bytes as a file in a folder of their own.
pub(super) fn on_disk(bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// The tables of a version of rosbag2's schema for the storage sqlite3.
const SCHEMAS: [&str; 4] = [
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
     serialization_format TEXT NOT NULL);",
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
     serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);",
    "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
     CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
     CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
     serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
     INSERT INTO schema VALUES (3, 'humble');",
    "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
     CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
     CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
     serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);
     CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL, \
     encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
     INSERT INTO schema VALUES (4, 'jazzy');",
];

/// The messages and their index, the same in all versions; the rows may be wrong, which rosbag2's are not.
const MESSAGES: &str =
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
     CREATE INDEX timestamp_idx ON messages (timestamp ASC);";

/// The hash that the tables of version 4 hold in [`database`].
pub(super) const TYPE_HASH: &str = "RIHS01_0123";

/// A database of a version of the schema, 1 to 4, with the topics `/a` and `/b` of texts, numbers 1 and 2, and no
/// messages.
pub(super) fn database(path: &Path, version: usize, qos: OfferedQos) -> Connection {
    let connection = Connection::open(path).unwrap();
    connection.execute_batch(SCHEMAS[version - 1]).unwrap();
    connection.execute_batch(MESSAGES).unwrap();
    for (id, topic) in [(1, "/a"), (2, "/b")] {
        let (name, qos) = (Text::TYPE_NAME, qos.to_yaml());
        let values: [&dyn ToSql; 6] = [&id, &topic, &name, &"cdr", &qos, &TYPE_HASH];
        let columns = [4, 5, 5, 6][version - 1];
        let places = vec!["?"; columns].join(", ");
        connection
            .execute(&format!("INSERT INTO topics VALUES ({places})"), &values[..columns])
            .unwrap();
    }
    if version == 4 {
        let insert = "INSERT INTO message_definitions VALUES (1, ?1, 'ros2msg', ?2, ?3)";
        connection.execute(insert, (Text::TYPE_NAME, Text::schema(), TYPE_HASH)).unwrap();
    }
    connection
}

/// Adds the text of [`text`] to a topic of [`database`].
pub(super) fn insert_text(connection: &Connection, topic: &str, log_time: i64) {
    let data = cdr::encode(&text(topic, log_time.unsigned_abs())).unwrap();
    insert(connection, if topic == "/a" { 1 } else { 2 }, log_time, &data);
}

/// Adds a row with some data.
pub(super) fn insert(connection: &Connection, topic_id: i64, log_time: i64, data: &[u8]) {
    let insert = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
    connection.execute(insert, (topic_id, log_time, data)).unwrap();
}
