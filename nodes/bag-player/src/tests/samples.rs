//! Small bags made for a test.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::PathBuf;

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use msgs::std_msgs::String as Text;
use msgs::{RosMessage, cdr};
use tempfile::TempDir;

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
