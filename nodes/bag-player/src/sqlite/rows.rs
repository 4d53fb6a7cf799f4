//! The rows of the table of messages, in the order of their times.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;

use rusqlite::types::{Value, ValueRef};
use rusqlite::{Connection, Statement, params};

use super::{Database, Paths, connect, damage, loss_of_rows};
use crate::catalogue::Channel;
use crate::compression::{self, ZSTD_MAGIC};
use crate::error::{BagError, Loss, LossKind, add_loss};
use crate::message::Filter;

/// The number of messages that are read at once.
const BATCH_BYTES: usize = 4 << 20;

/// Keys (time and row id) that are read at once: 2 MiB in memory. A table without an index of times is scanned
/// once for each such page.
const PAGE_ROWS: usize = 1 << 16;

/// The largest time, that of `i64`.
const LAST_NS: u64 = i64::MAX as u64;

/// A message.
pub(crate) struct Row {
    pub(crate) log_time_ns: u64,
    /// Its position among the rows that have been read.
    pub(crate) place: usize,
    /// Its topic's id in the table of topics.
    pub(crate) topic_id: i64,
    pub(crate) channel: Arc<Channel>,
    pub(crate) data: Vec<u8>,
}

/// The time and the id of a row.
struct Key {
    time: Value,
    row: i64,
}

impl Key {
    fn time_ns(&self) -> Option<u64> {
        match self.time {
            Value::Integer(time) => u64::try_from(time).ok(),
            _ => None,
        }
    }
}

/// A cursor over the messages of a database.
pub(crate) struct Rows {
    named: PathBuf,
    connection: Connection,
    topics: BTreeMap<i64, Arc<Channel>>,
    row_query: String,
    keys: VecDeque<Key>,
    /// The key after which the next page begins.
    after: Key,
    last_ns: u64,
    /// Whether the index of times has been found to be damaged.
    without_index: bool,
    is_at_end: bool,
    place: usize,
    losses: Vec<Loss>,
}

impl Rows {
    /// Begins before the first selected message.
    pub(crate) fn open(
        paths: Paths<'_>,
        database: &Database,
        filter: &Filter,
    ) -> Result<Self, BagError> {
        let (start_ns, end_ns) = filter.times();
        let is_wanted = |channel: &Channel| filter.wants_topic(&channel.topic);
        let unwanted: Vec<String> = database
            .topics
            .iter()
            .filter(|(_, channel)| !is_wanted(channel))
            .map(|(id, _)| id.to_string())
            .collect();
        // The data of other topics are not read from the file.
        let data = if unwanted.is_empty() {
            "data".to_owned()
        } else {
            format!("CASE WHEN topic_id NOT IN ({}) THEN data END", unwanted.join(", "))
        };
        let mut rows = Self {
            named: paths.named.to_owned(),
            connection: connect(paths)?,
            topics: database.topics.clone(),
            row_query: format!("SELECT topic_id, {data} FROM messages WHERE rowid = ?1"),
            keys: VecDeque::new(),
            after: Key {
                // The largest row id of the time before.
                time: Value::Integer(i64::try_from(start_ns).unwrap_or(i64::MAX) - 1),
                row: i64::MAX,
            },
            last_ns: end_ns.map_or(LAST_NS, |end_ns| end_ns.saturating_sub(1).min(LAST_NS)),
            without_index: false,
            is_at_end: start_ns > LAST_NS || end_ns.is_some_and(|end_ns| end_ns <= start_ns),
            place: 0,
            losses: Vec::new(),
        };
        rows.count_without_time();
        Ok(rows)
    }

    /// The losses since the last call.
    pub(crate) fn take_losses(&mut self) -> Vec<Loss> {
        std::mem::take(&mut self.losses)
    }

    /// Whether there is no row left.
    pub(crate) fn is_at_end(&self) -> bool {
        self.is_at_end && self.keys.is_empty()
    }

    /// Time of the next row; `None` at the end.
    pub(crate) fn next_ns(&mut self) -> Option<u64> {
        loop {
            if self.keys.is_empty() {
                self.read_keys();
            }
            if let Some(time_ns) = self.keys.front()?.time_ns() {
                return Some(time_ns);
            }
            self.keys.pop_front();
            self.lose(TIME_IS_NONE.to_owned(), 1);
        }
    }

    /// The next messages of the selected topics.
    pub(crate) fn batch(&mut self, filter: &Filter) -> Vec<Row> {
        let mut batch = Vec::new();
        let mut bytes = 0;
        while bytes < BATCH_BYTES {
            let Some(log_time_ns) = self.next_ns() else { break };
            let mut lost = BTreeMap::new();
            let read = self.rows_of_page(log_time_ns, filter, &mut batch, &mut bytes, &mut lost);
            for (reason, count) in lost {
                self.lose(reason, count);
            }
            if let Err(error) = read {
                self.keys.clear();
                self.end_with(&error);
            }
        }
        batch
    }

    /// Reads the rows of a page of keys, with one statement, up to the next key with an invalid time.
    fn rows_of_page(
        &mut self,
        first_ns: u64,
        filter: &Filter,
        batch: &mut Vec<Row>,
        bytes: &mut usize,
        lost: &mut BTreeMap<String, u64>,
    ) -> rusqlite::Result<()> {
        let mut statement = self.connection.prepare(&self.row_query)?;
        let mut next = Some(first_ns);
        while let Some(log_time_ns) = next.filter(|_| *bytes < BATCH_BYTES) {
            let Some(key) = self.keys.pop_front() else { break };
            match message(&mut statement, key.row, &self.topics, filter) {
                Ok(Some((topic_id, channel, data))) => {
                    *bytes += data.len() + size_of::<Row>();
                    batch.push(Row { log_time_ns, place: self.place, topic_id, channel, data });
                    self.place += 1;
                }
                Ok(None) => {}
                Err(reason) => *lost.entry(reason).or_insert(0) += 1,
            }
            next = self.keys.front().and_then(Key::time_ns);
        }
        Ok(())
    }

    /// Reads the next page of keys.
    fn read_keys(&mut self) {
        if self.is_at_end {
            return;
        }
        let hint = if self.without_index { "NOT INDEXED" } else { "" };
        let (mut keys, mut fault) = self.page(hint);
        if fault.is_some() && !self.without_index {
            // Perhaps only the index is damaged. The table is read whole or not at all, since its order is another.
            if let (all, None) = self.page("NOT INDEXED") {
                if let Some(error) = fault.take() {
                    let loss = loss_of_rows(&self.named, Some(0), damage(&error));
                    add_loss(&mut self.losses, loss);
                }
                (keys, self.without_index) = (all, true);
            }
        }
        self.is_at_end = keys.len() < PAGE_ROWS;
        if let Some(last) = keys.back() {
            self.after = Key { time: last.time.clone(), row: last.row };
        }
        self.keys = keys;
        if let Some(error) = fault {
            self.end_with(&error);
        }
    }

    fn page(&self, hint: &str) -> (VecDeque<Key>, Option<rusqlite::Error>) {
        let query = format!(
            "SELECT timestamp, rowid FROM messages {hint} WHERE (timestamp, rowid) > (?1, ?2) AND timestamp <= ?3 \
             ORDER BY timestamp, rowid LIMIT ?4"
        );
        let mut keys = VecDeque::new();
        let mut read = || {
            let mut statement = self.connection.prepare(&query)?;
            let last_ns = i64::try_from(self.last_ns).unwrap_or(i64::MAX);
            let page_rows = PAGE_ROWS as i64;
            let mut rows =
                statement.query(params![self.after.time, self.after.row, last_ns, page_rows])?;
            while let Some(row) = rows.next()? {
                keys.push_back(Key { time: row.get(0)?, row: row.get(1)? });
            }
            Ok(())
        };
        let fault = read().err();
        (keys, fault)
    }

    fn end_with(&mut self, error: &rusqlite::Error) {
        self.is_at_end = true;
        add_loss(&mut self.losses, loss_of_rows(&self.named, None, damage(error)));
    }

    fn lose(&mut self, reason: String, messages: u64) {
        let kind = LossKind::BadMessages { reason };
        add_loss(&mut self.losses, loss_of_rows(&self.named, Some(messages), kind));
    }

    /// Counts the rows with an invalid time, which are not read by time.
    fn count_without_time(&mut self) {
        let query = "SELECT count(*) FROM messages WHERE timestamp IS NULL OR timestamp < 0 OR timestamp > ?1";
        // An unreadable index is reported by the cursor.
        let count = self.connection.query_row(query, [i64::MAX], |row| row.get::<_, i64>(0));
        if let Some(count) = count.ok().filter(|count| *count > 0) {
            self.lose(TIME_IS_NONE.to_owned(), count.unsigned_abs());
        }
    }
}

pub(super) const TIME_IS_NONE: &str = "its time is not a number of nanoseconds since 1970";
pub(super) const TOPIC_IS_UNKNOWN: &str = "its topic is not in the table of topics";

type Message = (i64, Arc<Channel>, Vec<u8>);

/// The message in a row; `None` if its topic is not selected.
fn message(
    statement: &mut Statement<'_>,
    row: i64,
    topics: &BTreeMap<i64, Arc<Channel>>,
    filter: &Filter,
) -> Result<Option<Message>, String> {
    let unreadable = |error: rusqlite::Error| format!("its row cannot be read: {error}");
    let mut rows = statement.query([row]).map_err(unreadable)?;
    let missing = || "its row is missing".to_owned();
    let found = rows.next().map_err(unreadable)?.ok_or_else(missing)?;
    let topic_id = match found.get_ref(0).map_err(unreadable)? {
        ValueRef::Integer(id) => id,
        _ => return Err(TOPIC_IS_UNKNOWN.to_owned()),
    };
    let channel = topics.get(&topic_id).ok_or(TOPIC_IS_UNKNOWN)?;
    if !filter.wants_topic(&channel.topic) {
        return Ok(None);
    }
    match found.get_ref(1).map_err(unreadable)? {
        ValueRef::Blob(data) => {
            let data = compression::message(&channel.encoding, data.to_vec())?;
            Ok(Some((topic_id, Arc::clone(channel), data)))
        }
        other => Err(data_is(other.data_type().to_string().to_lowercase().as_str())),
    }
}

pub(super) fn data_is(kind: &str) -> String {
    format!("its data is {kind}, not a blob")
}

/// The times of the first and of the last row. Where only the end cannot be read, the last is arbitrary.
pub(super) fn span_ns(connection: &Connection) -> rusqlite::Result<Option<(u64, u64)>> {
    let one = |hint: &str, order: &str| {
        let query = format!(
            "SELECT timestamp FROM messages {hint} WHERE timestamp BETWEEN 0 AND ?1 AND typeof(timestamp) = 'integer' \
             ORDER BY timestamp {order} LIMIT 1"
        );
        let read = |row: &rusqlite::Row<'_>| row.get::<_, i64>(0);
        match connection.query_row(&query, [i64::MAX], read) {
            Ok(time) => Ok(Some(time.unsigned_abs())),
            Err(rusqlite::Error::QueryReturnedNoRows) => Ok(None),
            Err(error) => Err(error),
        }
    };
    // Perhaps only the index is damaged.
    let first_ns = one("", "ASC").or_else(|error| one("NOT INDEXED", "ASC").map_err(|_| error))?;
    let Some(first_ns) = first_ns else { return Ok(None) };
    let last_ns = one("", "DESC").ok().flatten().unwrap_or(LAST_NS);
    Ok(Some((first_ns, last_ns)))
}

/// Whether the first row is a zstd frame.
pub(super) fn first_is_packed(connection: &Connection) -> bool {
    let query = "SELECT substr(data, 1, 4) FROM messages LIMIT 1";
    let start = connection.query_row(query, [], |row| row.get::<_, Vec<u8>>(0));
    start.is_ok_and(|start| start == ZSTD_MAGIC)
}
