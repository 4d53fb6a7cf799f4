//! The number of messages of each topic of a database, and their time span.

use std::collections::BTreeMap;

use rusqlite::types::ValueRef;

use super::rows::{Rows, TIME_IS_NONE, TOPIC_IS_UNKNOWN, data_is};
use super::{Database, Paths, connect, loss_of_rows};
use crate::error::{BagError, Loss, LossKind, add_loss};
use crate::message::Filter;

/// Counts of the messages of a topic.
#[derive(Default)]
pub(crate) struct Counted {
    pub(crate) messages: u64,
    pub(crate) first_ns: u64,
    pub(crate) last_ns: u64,
}

type Counts = (BTreeMap<i64, Counted>, Vec<Loss>);

fn count(counts: &mut BTreeMap<i64, Counted>, topic: i64, time_ns: u64) {
    let fresh = Counted { messages: 0, first_ns: time_ns, last_ns: time_ns };
    let counted = counts.entry(topic).or_insert(fresh);
    counted.messages += 1;
    counted.first_ns = counted.first_ns.min(time_ns);
    counted.last_ns = counted.last_ns.max(time_ns);
}

/// Counts the messages of all topics by reading each of them.
pub(crate) fn read_through(paths: Paths<'_>, database: &Database) -> Result<Counts, BagError> {
    let all = Filter::all();
    let mut rows = Rows::open(paths, database, &all)?;
    let mut counts = BTreeMap::new();
    while rows.next_ns().is_some() {
        for row in rows.batch(&all) {
            count(&mut counts, row.topic_id, row.log_time_ns);
        }
    }
    Ok((counts, rows.take_losses()))
}

/// Counts the messages of all topics by scanning the table, without their data; an error if it cannot be
/// read to its end.
pub(crate) fn walk(paths: Paths<'_>, database: &Database) -> Result<Counts, BagError> {
    let connection = connect(paths)?;
    let failed = |error: rusqlite::Error| BagError::Database {
        path: paths.named.to_owned(),
        reason: error.to_string(),
    };
    let mut losses = Vec::new();
    let mut lose = |reason: &str| {
        let kind = LossKind::BadMessages { reason: reason.to_owned() };
        add_loss(&mut losses, loss_of_rows(paths.named, Some(1), kind));
    };
    let mut counts: BTreeMap<i64, Counted> = BTreeMap::new();
    let query = "SELECT topic_id, timestamp, typeof(data) FROM messages NOT INDEXED";
    let mut statement = connection.prepare(query).map_err(failed)?;
    let mut rows = statement.query([]).map_err(failed)?;
    while let Some(row) = rows.next().map_err(failed)? {
        let value = |column| row.get_ref(column).map_err(failed);
        let (topic, time, kind) = (value(0)?, value(1)?, value(2)?);
        let time_ns = match time {
            ValueRef::Integer(time) => u64::try_from(time).ok(),
            _ => None,
        };
        let Some(time_ns) = time_ns else {
            lose(TIME_IS_NONE);
            continue;
        };
        let topic = match topic {
            ValueRef::Integer(id) if database.topics.contains_key(&id) => id,
            _ => {
                lose(TOPIC_IS_UNKNOWN);
                continue;
            }
        };
        match kind.as_str() {
            Ok("blob") => {}
            other => {
                lose(&data_is(other.unwrap_or("unknown")));
                continue;
            }
        }
        count(&mut counts, topic, time_ns);
    }
    Ok((counts, losses))
}
