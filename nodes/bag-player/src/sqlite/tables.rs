//! The other tables: topics, definitions of types, the version of the schema.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rusqlite::types::ValueRef;
use rusqlite::{Connection, Row};

use crate::catalogue::{Channel, MSG_FILES};
use crate::qos::OfferedQos;

/// The maximum number of topics of a file; the channels of an MCAP file have 16 bits.
const MAX_TOPICS: usize = 1 << 16;

/// The maximum size of the text in the tables; real ones have some kB per topic.
const MAX_TEXT_BYTES: usize = 64 << 20;

/// The columns that every version of the schema has.
const TOPIC_COLUMNS: [&str; 4] = ["id", "name", "type", "serialization_format"];
const MESSAGE_COLUMNS: [&str; 3] = ["topic_id", "timestamp", "data"];

pub(super) struct Tables {
    pub(super) topics: BTreeMap<i64, Arc<Channel>>,
    /// The number of invalid rows of the table of topics.
    pub(super) unreadable_topics: u64,
    pub(super) writer: String,
}

/// Reads the tables, or returns why this is not a bag.
pub(super) fn read(connection: &Connection) -> Result<Tables, String> {
    let tables = names_of_tables(connection).map_err(|error| error.to_string())?;
    let topic_columns = columns(connection, &tables, "topics", &TOPIC_COLUMNS)?;
    columns(connection, &tables, "messages", &MESSAGE_COLUMNS)?;
    // The definitions are optional.
    let definitions = if tables.contains("message_definitions") {
        definitions(connection).unwrap_or_default()
    } else {
        BTreeMap::new()
    };
    let (topics, unreadable_topics) = topics(connection, &topic_columns, &definitions)?;
    let version = tables.contains("schema").then(|| version(connection)).flatten();
    let writer = version.unwrap_or_else(|| {
        let version = if topic_columns.contains("offered_qos_profiles") { 2 } else { 1 };
        format!("rosbag2 (sqlite3, schema {version})")
    });
    Ok(Tables { topics, unreadable_topics, writer })
}

/// Views and virtual tables do not count: a query of them may take unlimited time.
fn names_of_tables(connection: &Connection) -> rusqlite::Result<BTreeSet<String>> {
    let query = "SELECT name FROM sqlite_schema WHERE type = 'table' AND rootpage > 0";
    connection.prepare(query)?.query_map([], |row| row.get(0))?.collect()
}

fn columns(
    connection: &Connection,
    tables: &BTreeSet<String>,
    table: &str,
    wanted: &[&str],
) -> Result<BTreeSet<String>, String> {
    if !tables.contains(table) {
        return Err(format!("it has no table `{table}`"));
    }
    let read = || -> rusqlite::Result<BTreeSet<String>> {
        let mut statement = connection.prepare(&format!("PRAGMA table_info({table})"))?;
        statement.query_map([], |row| row.get("name"))?.collect()
    };
    let columns = read().map_err(|error| error.to_string())?;
    match wanted.iter().find(|column| !columns.contains(**column)) {
        Some(missing) => Err(format!("its table `{table}` has no column `{missing}`")),
        None => Ok(columns),
    }
}

fn version(connection: &Connection) -> Option<String> {
    let query = "SELECT schema_version, ros_distro FROM schema LIMIT 1";
    let read = |row: &Row<'_>| Ok((row.get::<_, i64>(0)?, row.get::<_, String>(1)?));
    let (version, distribution) = connection.query_row(query, [], read).ok()?;
    let distribution = distribution.trim();
    let of = if distribution.is_empty() { String::new() } else { format!(", {distribution}") };
    Some(format!("rosbag2 (sqlite3, schema {version}{of})"))
}

/// The definitions in the form of `.msg` files, by type.
fn definitions(connection: &Connection) -> rusqlite::Result<BTreeMap<String, Arc<str>>> {
    let query = "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = ?1 ORDER BY id";
    let mut statement = connection.prepare(query)?;
    let mut rows = statement.query([MSG_FILES])?;
    let mut definitions = BTreeMap::new();
    let mut bytes = 0;
    while let Some(row) = rows.next()? {
        if let (Some(name), Some(text)) = (text(row, 0), text(row, 1)) {
            bytes += name.len() + text.len();
            if bytes > MAX_TEXT_BYTES {
                break;
            }
            definitions.entry(name.to_owned()).or_insert_with(|| Arc::from(text));
        }
    }
    Ok(definitions)
}

type Topics = (BTreeMap<i64, Arc<Channel>>, u64);

fn topics(
    connection: &Connection,
    columns: &BTreeSet<String>,
    definitions: &BTreeMap<String, Arc<str>>,
) -> Result<Topics, String> {
    let optional = |column: &'static str| if columns.contains(column) { column } else { "''" };
    let query = format!(
        "SELECT id, name, type, serialization_format, {}, {} FROM topics",
        optional("offered_qos_profiles"),
        optional("type_description_hash")
    );
    let failed = |error: rusqlite::Error| format!("its table `topics` cannot be read: {error}");
    let mut statement = connection.prepare(&query).map_err(failed)?;
    let mut rows = statement.query([]).map_err(failed)?;
    let (mut topics, mut unreadable, mut bytes) = (BTreeMap::new(), 0, 0);
    while let Some(row) = rows.next().map_err(failed)? {
        bytes += (1..6).filter_map(|column| text(row, column)).map(str::len).sum::<usize>();
        if topics.len() >= MAX_TOPICS || bytes > MAX_TEXT_BYTES {
            return Err(format!(
                "its table `topics` has more than {MAX_TOPICS} rows or {} MiB",
                MAX_TEXT_BYTES >> 20
            ));
        }
        match topic(row, definitions) {
            Some((id, channel)) => drop(topics.insert(id, Arc::new(channel))),
            None => unreadable += 1,
        }
    }
    Ok((topics, unreadable))
}

fn topic(row: &Row<'_>, definitions: &BTreeMap<String, Arc<str>>) -> Option<(i64, Channel)> {
    let Ok(ValueRef::Integer(id)) = row.get_ref(0) else { return None };
    let type_name = text(row, 2)?;
    let channel = Channel {
        topic: text(row, 1)?.into(),
        type_name: type_name.into(),
        encoding: text(row, 3)?.into(),
        definition: definitions.get(type_name).cloned().unwrap_or_else(|| Arc::from("")),
        type_hash: text(row, 5).unwrap_or_default().into(),
        qos: text(row, 4).and_then(OfferedQos::from_yaml),
    };
    Some((id, channel))
}

fn text<'a>(row: &'a Row<'_>, column: usize) -> Option<&'a str> {
    row.get_ref(column).ok()?.as_str().ok()
}
