//! rosbag2's sqlite3 storage: a database with a row for each message.
//!
//! The tables are those of the four versions of its schema: `topics` and `messages` (1), the publishers' QoS (2),
//! `schema` and `metadata` (3), `message_definitions` and the hashes of the types (4). A cursor reads the rows in the order
//! of their times, never the whole file. The database is opened for reading only, and no file is written
//! beside it.

mod connection;
mod counts;
mod rows;
mod tables;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use rusqlite::Connection;

pub(crate) use self::connection::without_cut_page;
pub(crate) use self::counts::{read_through, walk};
pub(crate) use self::rows::Rows;
use crate::catalogue::Channel;
use crate::error::{BagError, Loss, LossKind};

/// The contents of a database that are read without its messages.
#[derive(Clone, Debug)]
pub(crate) struct Database {
    /// By their id in the table of topics.
    pub(crate) topics: BTreeMap<i64, Arc<Channel>>,
    /// The times of the first and of the last message.
    pub(crate) span_ns: Option<(u64, u64)>,
    /// The program that wrote it, if known.
    pub(crate) writer: String,
    /// Whether its first message is a zstd frame.
    pub(crate) has_packed_messages: bool,
}

/// The path for messages, and the one to open, which is another where the file was unpacked.
#[derive(Clone, Copy)]
pub(crate) struct Paths<'a> {
    pub(crate) named: &'a Path,
    pub(crate) opened: &'a Path,
}

impl Database {
    /// Opens a database; returns it with the known losses.
    pub(crate) fn open(paths: Paths<'_>) -> Result<(Self, Vec<Loss>), BagError> {
        let unreadable =
            |reason: String| BagError::Database { path: paths.named.to_owned(), reason };
        let mut losses = Vec::new();
        let connection =
            connection::open(paths.opened).map_err(|error| unreadable(error.to_string()))?;
        losses.extend(connection::fault_of_file(paths));
        let tables = tables::read(&connection).map_err(unreadable)?;
        if tables.unreadable_topics > 0 {
            let reason = "its row in the table of topics is invalid".to_owned();
            losses.push(loss_of_rows(paths.named, None, LossKind::BadMessages { reason }));
        }
        let span_ns = match rows::span_ns(&connection) {
            Ok(span_ns) => span_ns,
            Err(error) => {
                // The cursor reports the rows that it cannot read.
                losses.push(loss_of_rows(paths.named, Some(0), damage(&error)));
                Some((0, i64::MAX as u64))
            }
        };
        let database = Self {
            topics: tables.topics,
            span_ns,
            writer: tables.writer,
            has_packed_messages: rows::first_is_packed(&connection),
        };
        Ok((database, losses))
    }
}

/// A loss without a position in the file.
fn loss_of_rows(file: &Path, messages: Option<u64>, kind: LossKind) -> Loss {
    Loss { file: file.to_owned(), offset_bytes: 0, size_bytes: 0, messages, kind }
}

fn damage(error: &rusqlite::Error) -> LossKind {
    LossKind::Database { reason: error.to_string() }
}

/// A connection for reading the messages.
fn connect(paths: Paths<'_>) -> Result<Connection, BagError> {
    connection::open(paths.opened).map_err(|error| BagError::Database {
        path: paths.named.to_owned(),
        reason: error.to_string(),
    })
}
