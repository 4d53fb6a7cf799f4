//! Opening a database without writing any file.

use std::fmt::Write;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use rusqlite::config::DbConfig;
use rusqlite::{Connection, OpenFlags};

use super::{Paths, loss_of_rows};
use crate::error::{BagError, Loss, LossKind};
use crate::temporary::Temporary;

/// Header of a write-ahead log (file format of SQLite, 4.1); a shorter one holds nothing.
const WAL_HEADER_BYTES: u64 = 32;

/// Header of a database (file format of SQLite, 1.3).
const HEADER_BYTES: usize = 100;

/// Pages of the database in memory; negative, in KiB (`PRAGMA cache_size`).
const CACHE_KIB: i32 = -8192;

/// Opens a database for reading.
///
/// Without a write-ahead log the file is opened as immutable: no locks, no files beside it. With one the log is read too:
/// with its index in memory (exclusive locking mode, where SQLite keeps no `-shm` file), without locks (the file cannot be
/// locked for writing), and without a checkpoint at the end.
pub(super) fn open(path: &Path) -> rusqlite::Result<Connection> {
    let has_log = size_beside(path, "-wal") > WAL_HEADER_BYTES;
    let mode = if has_log { "mode=ro&vfs=unix-none" } else { "immutable=1" };
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY
        | OpenFlags::SQLITE_OPEN_URI
        | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(format!("{}?{mode}", uri(path)), flags)?;
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, true)?;
    if has_log {
        connection.pragma_update(None, "locking_mode", "EXCLUSIVE")?;
    }
    // The only way to make SQLite read a file that is shorter than its header states; before the schema is read.
    // Nothing is written: the file is opened for reading only.
    connection.pragma_update(None, "writable_schema", true)?;
    // As SQLite advises for files of unknown origin (sqlite.org/security.html).
    connection.pragma_update(None, "trusted_schema", false)?;
    connection.pragma_update(None, "cell_size_check", true)?;
    connection.pragma_update(None, "cache_size", CACHE_KIB)?;
    Ok(connection)
}

/// A copy without the last page, where the file was cut within it; `None` for other files. SQLite fills the missing part of a
/// page with zeros, and would return messages that were not recorded.
pub(crate) fn without_cut_page(paths: Paths<'_>) -> Result<Option<Temporary>, BagError> {
    let refused = |source| BagError::Open { path: paths.named.to_owned(), source };
    let Ok(header) = Header::read(paths.opened) else { return Ok(None) };
    let file = File::open(paths.opened).map_err(refused)?;
    let size_bytes = file.metadata().map_err(refused)?.len();
    let has_log = size_beside(paths.opened, "-wal") > WAL_HEADER_BYTES;
    let rest_bytes = size_bytes.checked_rem(header.page_bytes).unwrap_or(0);
    if rest_bytes == 0 || has_log {
        return Ok(None);
    }
    let temporary = Temporary::place_for(paths.named)?;
    File::create(temporary.path())
        .and_then(|mut copy| io::copy(&mut file.take(size_bytes - rest_bytes), &mut copy))
        .map_err(|error| temporary.refused(paths.named, error))?;
    Ok(Some(temporary))
}

/// Remarks about the file as a whole.
pub(super) fn fault_of_file(paths: Paths<'_>) -> Option<Loss> {
    if size_beside(paths.named, "-journal") > 0 {
        let reason =
            "its -journal file says that it was not closed while it was written; read as it is";
        let kind = LossKind::Database { reason: reason.to_owned() };
        return Some(loss_of_rows(paths.named, None, kind));
    }
    if size_beside(paths.opened, "-wal") > WAL_HEADER_BYTES {
        return None;
    }
    let stated_bytes = Header::read(paths.opened).ok()?.stated_bytes?;
    let size_bytes = std::fs::metadata(paths.opened).ok()?.len();
    (size_bytes < stated_bytes).then(|| Loss {
        offset_bytes: size_bytes,
        size_bytes: stated_bytes - size_bytes,
        ..loss_of_rows(paths.named, None, LossKind::CutOff { recovered_messages: 0 })
    })
}

/// The used part of a database's header.
struct Header {
    page_bytes: u64,
    /// The size of the file; `None` if it is not valid.
    stated_bytes: Option<u64>,
}

impl Header {
    fn read(path: &Path) -> io::Result<Self> {
        let mut header = [0; HEADER_BYTES];
        File::open(path)?.read_exact(&mut header)?;
        let number = |at: usize| {
            let bytes = header.get(at..).and_then(|rest| rest.first_chunk());
            bytes.map_or(0, |bytes| u32::from_be_bytes(*bytes))
        };
        // The page size has two bytes, 1 for 65536; the number of pages is valid where the change counter equals
        // the one that it was written with.
        let page_bytes = match (u64::from(header[16]) << 8) | u64::from(header[17]) {
            1 => 65536,
            bytes => bytes,
        };
        let is_valid = number(24) == number(92);
        let stated_bytes = is_valid.then_some(page_bytes * u64::from(number(28)));
        Ok(Self { page_bytes, stated_bytes })
    }
}

/// The size of the file with this name and suffix; 0 where there is none. Links are followed first, as by SQLite.
fn size_beside(path: &Path, ending: &str) -> u64 {
    let mut beside =
        std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()).into_os_string();
    beside.push(ending);
    std::fs::metadata(PathBuf::from(beside)).map_or(0, |metadata| metadata.len())
}

/// A path with any bytes as a URI.
fn uri(path: &Path) -> String {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut uri = String::from("file://");
    for byte in path.as_os_str().as_encoded_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'-' | b'_' => {
                uri.push(char::from(*byte));
            }
            // Writing to a string cannot fail.
            other => drop(write!(uri, "%{other:02x}")),
        }
    }
    uri
}
