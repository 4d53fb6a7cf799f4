//! The errors of a bag, and the losses of one that could still be read.

use std::fmt;
use std::io;
use std::path::PathBuf;

use geometry::Stamp;
use serde::Serialize;

use crate::foreign::ForeignFile;
use crate::ros1::Ros1Error;

/// Why a bag cannot be read or written. Every message names the file or topic, and the fix.
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// The path cannot be opened at all.
    #[error("cannot open {path}: {source}; check the path and its permissions", path = path.display())]
    Open {
        /// The path to open.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The file has no bytes.
    #[error("{path} is empty (0 bytes): nothing was recorded or the copy failed; record or copy it again", path = path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file is not a bag of a known format.
    #[error("{path} is not a bag: {found}", path = path.display())]
    NotABag {
        /// The file.
        path: PathBuf,
        /// The kind of file, with the fix in its text.
        found: ForeignFile,
    },
    /// The file is a SQLite database that is not a bag, or is too damaged to be read.
    #[error("{path} cannot be read as a bag of the storage sqlite3: {reason}; copy or record it again", path = path.display())]
    Database {
        /// The database.
        path: PathBuf,
        /// SQLite's error, or what is missing in it.
        reason: String,
    },
    /// The file is compressed as a whole and cannot be unpacked.
    #[error("{path} cannot be unpacked (zstd): {reason}", path = path.display())]
    Compressed {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The unpacked or converted file cannot be written.
    #[error("{path} cannot be unpacked into {folder}: {source}; set TMPDIR to a folder with room for it", path = path.display(), folder = folder.display())]
    Temporary {
        /// The file.
        path: PathBuf,
        /// The folder of temporary files.
        folder: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// It was interrupted while it was unpacked or converted.
    #[error("{path} was being unpacked or converted when that was interrupted", path = path.display())]
    Interrupted {
        /// The file.
        path: PathBuf,
    },
    /// A bag of ROS 1 cannot be read.
    #[error(transparent)]
    Ros1(Box<Ros1Error>),
    /// The bag uses another storage than MCAP or sqlite3.
    #[error("{path} uses the storage `{storage}`; mcap and sqlite3 are read", path = path.display())]
    UnknownStorage {
        /// The directory.
        path: PathBuf,
        /// Its storage identifier.
        storage: String,
    },
    /// rosbag2 compressed the files or the messages, in another format than zstd.
    #[error("{path} was compressed by rosbag2 (mode {mode}) in the format `{format}`; zstd is read", path = path.display())]
    OuterCompression {
        /// The directory.
        path: PathBuf,
        /// `FILE` or `MESSAGE`.
        mode: String,
        /// For example `zstd`.
        format: String,
    },
    /// A directory without any file of a bag.
    #[error("{path} holds neither metadata.yaml nor an .mcap or .db3 file, so it is not a bag; give the folder of a recording, or its file", path = path.display())]
    NoBagInDirectory {
        /// The directory.
        path: PathBuf,
    },
    /// `metadata.yaml` cannot be parsed as that of rosbag2.
    #[error("{path} cannot be parsed: {reason}; move it away to read the .mcap or .db3 files without it", path = path.display())]
    BadMetadata {
        /// The metadata file.
        path: PathBuf,
        /// Where and why.
        reason: String,
    },
    /// Not one of the files that the metadata lists could be read.
    #[error("none of the {listed} files that {path} lists can be read; the first: {first}", path = path.display())]
    NoFileLeft {
        /// The bag's directory.
        path: PathBuf,
        /// How many are listed.
        listed: usize,
        /// The error of the first one.
        first: String,
    },
    /// A topic was requested that the bag does not have.
    #[error("{path} has no topic {topic}; it has: {available}", path = path.display())]
    NoSuchTopic {
        /// The bag.
        path: PathBuf,
        /// The topic requested.
        topic: String,
        /// Its topics, comma-separated.
        available: String,
    },
    /// A time of the selection is invalid.
    #[error("{name} must be a number of seconds, 0 or more, not {value_s}")]
    BadSelection {
        /// Its name.
        name: &'static str,
        /// The given value.
        value_s: f64,
    },
    /// A message was to be decoded as another type than its own.
    #[error("topic {topic} carries {found}, not {wanted}: choose another topic or remap it")]
    WrongType {
        /// The topic.
        topic: String,
        /// The type in the bag.
        found: String,
        /// The type wanted.
        wanted: &'static str,
    },
    /// A message in another encoding than CDR.
    #[error("topic {topic} is encoded as `{encoding}`; only cdr (ROS 2) is decoded")]
    WrongEncoding {
        /// The topic.
        topic: String,
        /// Its encoding.
        encoding: String,
    },
    /// A message cannot be decoded.
    #[error("the message of {topic} at {nanos} ns is damaged: {source}", nanos = log_time.as_nanos())]
    Decode {
        /// The topic.
        topic: String,
        /// When it was logged.
        log_time: Stamp,
        /// Why.
        source: msgs::cdr::CdrError,
    },
    /// A message cannot be encoded.
    #[error("a message for {topic} cannot be encoded: {source}")]
    Encode {
        /// The topic.
        topic: String,
        /// Why.
        source: msgs::cdr::CdrError,
    },
    /// A channel that is not one of this writer.
    #[error("channel {id} is not one of this bag's {count}")]
    NoSuchChannel {
        /// Its number.
        id: u16,
        /// The number of its channels.
        count: usize,
    },
    /// A message was to be written as another type than its channel's.
    #[error("channel {topic} is for {expected}; a {given} was written to it")]
    WrongChannelType {
        /// The channel's topic.
        topic: String,
        /// The channel's type.
        expected: String,
        /// The type of the message.
        given: &'static str,
    },
    /// A time before 1970, which MCAP cannot represent.
    #[error("a message for {topic} has the log time {nanos} ns, before 1970, which a bag cannot hold", nanos = log_time.as_nanos())]
    TimeBeforeEpoch {
        /// The topic.
        topic: String,
        /// The log time.
        log_time: Stamp,
    },
    /// The bag cannot be written.
    #[error("cannot write {path}: {}; check the free space and the permissions of its directory", cause(source), path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error.
        source: mcap::McapError,
    },
    /// Another process writes it.
    #[error("{path} is being written by another process; give another name with -o", path = path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// The finished bag cannot be renamed to its final path.
    #[error("cannot create {path}: {source}; check that its directory exists and may be written to", path = path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

/// A part of the bag that could not be read.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Loss {
    /// The file.
    pub file: PathBuf,
    /// The offset of the lost part in the file.
    pub offset_bytes: u64,
    /// The size of the lost part in bytes.
    pub size_bytes: u64,
    /// The number of lost messages, where that is known.
    pub messages: Option<u64>,
    /// The kind of loss.
    pub kind: LossKind,
}

/// The cause of a loss.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case", tag = "what")]
pub enum LossKind {
    /// A file that the metadata lists does not exist.
    MissingFile,
    /// A file of the bag cannot be read.
    UnreadableFile {
        /// Why.
        reason: String,
    },
    /// The file ends in the middle of a record, or before its footer.
    CutOff {
        /// Messages that were recovered from its last record.
        recovered_messages: u64,
    },
    /// The index at the end of the file is damaged; the file was read without it.
    Summary {
        /// Why.
        reason: String,
    },
    /// A record is invalid, and the records after it cannot be found.
    BadRecord {
        /// Why.
        reason: String,
    },
    /// A chunk's content does not have the stored checksum.
    ChunkChecksum {
        /// The stored checksum.
        stored: u32,
        /// The content's checksum.
        computed: u32,
    },
    /// A chunk cannot be decompressed or parsed.
    BadChunk {
        /// Why.
        reason: String,
    },
    /// Single messages are invalid.
    BadMessages {
        /// Why.
        reason: String,
    },
    /// The database is damaged.
    Database {
        /// SQLite's error.
        reason: String,
    },
    /// A file that is compressed as a whole is damaged; the part before the damage was read.
    Compression {
        /// Why.
        reason: String,
    },
    /// A topic of a bag of ROS 1 that cannot be converted to ROS 2.
    LeftOut {
        /// The topic.
        topic: String,
        /// Why.
        reason: String,
    },
    /// A bag of ROS 1 could not be read to its end.
    BrokenOff {
        /// Why.
        reason: String,
    },
    /// Messages of a channel that the file never describes.
    UnknownChannel {
        /// Its number.
        channel_id: u16,
    },
}

impl Loss {
    /// The topic of a bag of ROS 1 that is left out, where this is the loss.
    #[must_use]
    pub fn topic_left_out(&self) -> Option<&str> {
        match &self.kind {
            // Its type is behind it.
            LossKind::LeftOut { topic, .. } => topic.split(' ').next(),
            _ => None,
        }
    }

    /// Whether messages are lost, or may be. It is false where only the index of the bag is damaged.
    #[must_use]
    pub fn costs_messages(&self) -> bool {
        self.messages != Some(0)
    }
}

/// Adds a loss; losses of one kind in one file whose messages are counted are merged.
pub(crate) fn add_loss(losses: &mut Vec<Loss>, loss: Loss) {
    let known = losses.iter_mut().find(|known| known.file == loss.file && known.kind == loss.kind);
    match (known, loss.messages) {
        (Some(Loss { messages: Some(counted), size_bytes, .. }), Some(more)) => {
            *counted += more;
            *size_bytes += loss.size_bytes;
        }
        _ => losses.push(loss),
    }
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.file.display();
        match &self.kind {
            LossKind::MissingFile => write!(f, "{file}: the file is missing")?,
            LossKind::UnreadableFile { reason } => write!(f, "{reason}")?,
            LossKind::BadMessages { reason } => {
                write!(f, "{file}: messages are damaged ({reason})")?
            }
            LossKind::Database { reason } => {
                write!(f, "{file}: the database is damaged ({reason})")?
            }
            LossKind::Compression { reason } => {
                write!(
                    f,
                    "{file}: the zstd frame is damaged ({reason}); what lies before was read"
                )?;
            }
            LossKind::LeftOut { topic, reason } => {
                write!(f, "{file}: {topic} is left out: {reason}")?
            }
            LossKind::BrokenOff { reason } => {
                write!(f, "{file}: it could not be read to its end: {reason}")?;
            }
            kind => {
                write!(f, "{file}: {} bytes at {}: ", self.size_bytes, self.offset_bytes)?;
                match kind {
                    LossKind::CutOff { .. } if self.size_bytes == 0 => {
                        write!(f, "the file ends here without its footer")?;
                    }
                    LossKind::CutOff { recovered_messages: 0 } => {
                        write!(f, "the file is cut off here")?;
                    }
                    LossKind::CutOff { recovered_messages } => write!(
                        f,
                        "the file is cut off here; {recovered_messages} messages of its last chunk were recovered"
                    )?,
                    LossKind::Summary { reason } => {
                        write!(f, "the index is damaged ({reason}); read without it")?;
                    }
                    LossKind::BadRecord { reason } => {
                        write!(
                            f,
                            "damaged record ({reason}); nothing can be found up to the next known chunk"
                        )?;
                    }
                    LossKind::ChunkChecksum { stored, computed } => write!(
                        f,
                        "the chunk's checksum is {computed:08x} where {stored:08x} was stored"
                    )?,
                    LossKind::BadChunk { reason } => write!(f, "damaged chunk ({reason})")?,
                    LossKind::UnknownChannel { channel_id } => {
                        write!(f, "the file does not describe channel {channel_id}")?;
                    }
                    LossKind::MissingFile
                    | LossKind::UnreadableFile { .. }
                    | LossKind::BadMessages { .. }
                    | LossKind::Database { .. }
                    | LossKind::Compression { .. }
                    | LossKind::LeftOut { .. }
                    | LossKind::BrokenOff { .. } => {}
                }
            }
        }
        match self.messages {
            Some(0) => write!(f, "; no message lost"),
            Some(1) => write!(f, "; 1 message lost"),
            Some(count) => write!(f, "; {count} messages lost"),
            None => Ok(()),
        }
    }
}
/// What the system said, which the library's own words leave out.
fn cause(error: &mcap::McapError) -> String {
    match error {
        mcap::McapError::Io(error) => error.to_string(),
        other => other.to_string(),
    }
}
