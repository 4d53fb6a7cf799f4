//! The MCAP conformance suite: every file with the records that it must give.

use std::path::Path;

use serde_json::Value;

use super::{committed, every_encoding, files_below, read_all, recorded};
use crate::{Bag, BagMessage};

/// An expected message: log time, publish time, topic, type, encoding, data.
type Expected = (i64, i64, String, String, String, Vec<u8>);

fn field<'a>(record: &'a Value, name: &str) -> &'a Value {
    let fields = record["fields"].as_array().unwrap();
    &fields.iter().find(|field| field[0] == name).unwrap()[1]
}

fn text(record: &Value, name: &str) -> String {
    field(record, name).as_str().unwrap().to_owned()
}

fn number(record: &Value, name: &str) -> i64 {
    text(record, name).parse().unwrap()
}

/// The messages that the JSON beside a file lists, in the order of their log times.
fn expected_messages(json: &Path) -> Vec<Expected> {
    let parsed: Value = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    let records = parsed["records"].as_array().unwrap();
    let find = |kind: &str, id: i64| {
        records.iter().find(|record| record["type"] == kind && number(record, "id") == id)
    };
    let mut messages: Vec<Expected> = records
        .iter()
        .filter(|record| record["type"] == "Message")
        .map(|message| {
            let channel = find("Channel", number(message, "channel_id")).unwrap();
            let schema = find("Schema", number(channel, "schema_id"));
            let data = field(message, "data").as_array().unwrap();
            (
                number(message, "log_time"),
                number(message, "publish_time"),
                text(channel, "topic"),
                schema.map_or_else(String::new, |schema| text(schema, "name")),
                text(channel, "message_encoding"),
                data.iter().map(|byte| byte.as_str().unwrap().parse().unwrap()).collect(),
            )
        })
        .collect();
    messages.sort_by_key(|message| message.0);
    messages
}

fn found(message: BagMessage) -> Expected {
    (
        message.log_time.as_nanos(),
        message.publish_time.as_nanos(),
        message.topic.to_string(),
        message.type_name.to_string(),
        message.encoding.to_string(),
        message.data,
    )
}

fn check(path: &Path) {
    let name = path.display();
    let bag = Bag::open(path).unwrap();
    let (messages, losses) = read_all(&bag, &every_encoding()).unwrap();
    assert_eq!(losses, [], "{name}");
    let messages: Vec<Expected> = messages.into_iter().map(found).collect();
    let expected = expected_messages(&path.with_extension("json"));
    assert_eq!(messages, expected, "{name}");

    let info = bag.info().unwrap();
    assert_eq!(info.message_count, expected.len() as u64, "{name}");
    assert_eq!(info, bag.check().unwrap(), "{name}: by the index and by reading");
    let times = expected.first().zip(expected.last()).map(|(first, last)| (first.0, last.0));
    let stated = info.start.zip(info.end).map(|(start, end)| (start.as_nanos(), end.as_nanos()));
    assert_eq!(stated, times, "{name}");
}

#[test]
fn committed_files_give_what_they_must() {
    let files = files_below(&committed("conformance"), "mcap");
    assert_eq!(files.len(), 8);
    files.iter().for_each(|path| check(path));
}

#[test]
fn the_whole_suite_gives_what_it_must() {
    let Some(folder) = recorded("mcap-conformance") else { return };
    let files = files_below(&folder, "mcap");
    assert_eq!(files.len(), 416);
    files.iter().for_each(|path| check(path));
}
