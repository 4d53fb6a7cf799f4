//! Writing a bag that `ros2 bag` and Foxglove can open.

use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use geometry::Stamp;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, McapError, WriteOptions, Writer};
use msgs::{RosMessage, cdr};
use serde::Serialize;

use crate::catalogue::{HASH_METADATA_KEY, QOS_METADATA_KEY};
use crate::error::BagError;
use crate::message::CDR;
use crate::qos::OfferedQos;

/// Size of a chunk's content: small enough that a seek decompresses little, large enough to compress well.
const CHUNK_BYTES: u64 = 1 << 20;

/// A chunk has the messages of at most this time, of the log: what is in an open chunk is lost with a
/// process that is killed. It is closed by the first message that is later, so that the last one of a slow topic may be in it for longer.
const CHUNK_S: f64 = 2.0;

/// The fastest level of zstd: recording must keep up with the sensors.
const COMPRESSION_LEVEL: u32 = 1;

/// The newest version of rosbag2's metadata in which QoS policies are numbers, as
/// [`OfferedQos::to_yaml`] writes them.
const METADATA_VERSION: u32 = 8;

/// Writes an MCAP bag: profile `ros2`, ros2msg schemas, zstd chunks with their index, statistics.
///
/// The bag is written to a temporary file (`.tmp` appended to its name) and renamed by
/// [`BagWriter::finish`], so that a bag of that name is always complete; an older one is replaced only
/// then. A writer that is dropped without `finish` leaves the temporary file, which can be read. One is locked while it is written.
/// The same calls give the same bytes.
pub struct BagWriter {
    path: PathBuf,
    temporary: PathBuf,
    writer: Writer<BufWriter<File>>,
    channels: BTreeMap<u16, WrittenChannel>,
    start: Option<Stamp>,
    end: Option<Stamp>,
    /// Log time of the first message of the open chunk, or of a chunk that was full meanwhile.
    chunk_start: Option<Stamp>,
}

struct WrittenChannel {
    topic: String,
    type_name: String,
    messages: u32,
}

/// A channel of the bag being written.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct ChannelId(u16);

/// The counts of written records.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct BagSummary {
    /// The bag.
    pub path: PathBuf,
    /// Its size.
    pub size_bytes: u64,
    /// All messages.
    pub message_count: u64,
    /// Messages of each topic.
    pub topic_counts: BTreeMap<String, u64>,
    /// Log time of the earliest message.
    pub start: Option<Stamp>,
    /// Log time of the latest message.
    pub end: Option<Stamp>,
}

/// An empty file that no other process writes.
fn locked(path: &Path) -> Result<File, BagError> {
    let failed = |source| BagError::Create { path: path.to_owned(), source };
    // Emptied only when it is locked: another process may write it.
    let options = File::options().write(true).create(true).truncate(false).open(path);
    let file = options.map_err(failed)?;
    if let Err(TryLockError::WouldBlock) = file.try_lock() {
        return Err(BagError::InUse { path: path.to_owned() });
    }
    file.set_len(0).map_err(failed)?;
    Ok(file)
}

impl BagWriter {
    /// Creates a bag at `path`.
    ///
    /// # Errors
    /// When its temporary file cannot be created, another process writes it, or `path` is a folder.
    pub fn create(path: &Path) -> Result<Self, BagError> {
        // Else it would be found when all is written.
        if path.is_dir() {
            let source = std::io::ErrorKind::IsADirectory.into();
            return Err(BagError::Create { path: path.to_owned(), source });
        }
        let temporary = Self::temporary_of(path);
        let file = locked(&temporary)?;
        let writer = WriteOptions::new()
            .profile("ros2")
            .library(concat!("stillmap ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_level(COMPRESSION_LEVEL)
            // With more threads the bytes would differ.
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            .create(BufWriter::new(file))
            .map_err(|source| BagError::Write { path: temporary.clone(), source })?;
        Ok(Self {
            path: path.to_owned(),
            temporary,
            writer,
            channels: BTreeMap::new(),
            start: None,
            end: None,
            chunk_start: None,
        })
    }

    /// The file that is written until the bag at `path` is finished.
    #[must_use]
    pub fn temporary_of(path: &Path) -> PathBuf {
        let mut temporary = path.as_os_str().to_owned();
        temporary.push(".tmp");
        PathBuf::from(temporary)
    }

    /// [`BagWriter::temporary_of`] this bag.
    #[must_use]
    pub fn temporary(&self) -> &Path {
        &self.temporary
    }

    fn failed(&self, source: McapError) -> BagError {
        BagError::Write { path: self.temporary.clone(), source }
    }

    /// Adds a topic.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn channel<M: RosMessage>(
        &mut self,
        topic: &str,
        qos: OfferedQos,
    ) -> Result<ChannelId, BagError> {
        self.raw_channel(topic, M::TYPE_NAME, &M::schema(), &qos.to_yaml())
    }

    /// Adds a topic whose type is given by its name and its ros2msg schema, which is empty if it is not known, with
    /// the YAML of its publishers' QoS (see [`OfferedQos::to_yaml`]).
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn raw_channel(
        &mut self,
        topic: &str,
        type_name: &str,
        ros2msg_schema: &str,
        offered_qos_profiles: &str,
    ) -> Result<ChannelId, BagError> {
        self.hashed_channel(topic, (type_name, ros2msg_schema), None, offered_qos_profiles)
    }

    /// The same, with the hash of the type's definition (REP-2011), by which a type without a schema is played on Zenoh.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn hashed_channel(
        &mut self,
        topic: &str,
        (type_name, ros2msg_schema): (&str, &str),
        type_hash: Option<&str>,
        offered_qos_profiles: &str,
    ) -> Result<ChannelId, BagError> {
        let entry = |key: &str, value: &str| (key.to_owned(), value.to_owned());
        let mut metadata = BTreeMap::from([entry(QOS_METADATA_KEY, offered_qos_profiles)]);
        metadata.extend(type_hash.map(|hash| entry(HASH_METADATA_KEY, hash)));
        // A schema without content has no encoding (MCAP's specification, "Schema").
        let encoding = if ros2msg_schema.is_empty() { "" } else { "ros2msg" };
        let id = self
            .writer
            .add_schema(type_name, encoding, ros2msg_schema.as_bytes())
            .and_then(|schema| self.writer.add_channel(schema, topic, CDR, &metadata))
            .map_err(|source| self.failed(source))?;
        self.channels.entry(id).or_insert_with(|| WrittenChannel {
            topic: topic.to_owned(),
            type_name: type_name.to_owned(),
            messages: 0,
        });
        Ok(ChannelId(id))
    }

    /// Writes a message; its publish time is its log time.
    ///
    /// # Errors
    /// When the message is not of the channel's type or the file cannot be written.
    pub fn write<M: RosMessage>(
        &mut self,
        channel: ChannelId,
        log_time: Stamp,
        message: &M,
    ) -> Result<(), BagError> {
        let known = self.known(channel)?;
        if known.type_name != M::TYPE_NAME {
            return Err(BagError::WrongChannelType {
                topic: known.topic.clone(),
                expected: known.type_name.clone(),
                given: M::TYPE_NAME,
            });
        }
        let data = cdr::encode(message)
            .map_err(|source| BagError::Encode { topic: known.topic.clone(), source })?;
        self.write_raw(channel, log_time, log_time, &data)
    }

    /// Writes an encoded message, in CDR with the 4 bytes of its encapsulation.
    ///
    /// # Errors
    /// When the channel is not of this bag, a time is before 1970, or the file cannot be written.
    pub fn write_raw(
        &mut self,
        channel: ChannelId,
        log_time: Stamp,
        publish_time: Stamp,
        data: &[u8],
    ) -> Result<(), BagError> {
        let known = self.known(channel)?;
        let nanos = |time: Stamp| {
            u64::try_from(time.as_nanos()).map_err(|_| BagError::TimeBeforeEpoch {
                topic: known.topic.clone(),
                log_time: time,
            })
        };
        let header = MessageHeader {
            channel_id: channel.0,
            sequence: known.messages,
            log_time: nanos(log_time)?,
            publish_time: nanos(publish_time)?,
        };
        let is_old = |start: &Stamp| log_time.seconds_since(*start).abs() > CHUNK_S;
        if self.chunk_start.is_some_and(|start| is_old(&start)) {
            self.writer.flush().map_err(|source| self.failed(source))?;
            self.chunk_start = None;
        }
        self.chunk_start.get_or_insert(log_time);
        self.writer.write_to_known_channel(&header, data).map_err(|source| self.failed(source))?;
        if let Some(known) = self.channels.get_mut(&channel.0) {
            known.messages = known.messages.saturating_add(1);
        }
        self.start = Some(self.start.map_or(log_time, |start| start.min(log_time)));
        self.end = Some(self.end.map_or(log_time, |end| end.max(log_time)));
        Ok(())
    }

    fn known(&self, channel: ChannelId) -> Result<&WrittenChannel, BagError> {
        self.channels
            .get(&channel.0)
            .ok_or(BagError::NoSuchChannel { id: channel.0, count: self.channels.len() })
    }

    /// Writes the index and renames the bag to its final name.
    ///
    /// # Errors
    /// When the file cannot be written or renamed; the temporary file is kept.
    pub fn finish(mut self) -> Result<BagSummary, BagError> {
        let metadata = Metadata {
            name: "rosbag2".to_owned(),
            metadata: BTreeMap::from([("serialized_metadata".to_owned(), self.metadata_yaml())]),
        };
        let finished =
            self.writer.write_metadata(&metadata).and_then(|()| self.writer.finish()).map(drop);
        finished.map_err(|source| self.failed(source))?;
        let message_count = self.message_count();
        let mut topic_counts = BTreeMap::new();
        for channel in self.channels.values() {
            *topic_counts.entry(channel.topic.clone()).or_insert(0) += u64::from(channel.messages);
        }
        let Self { path, temporary, writer, start, end, .. } = self;
        let written = |source| BagError::Create { path: temporary.clone(), source };
        let mut buffer = writer.into_inner();
        buffer.flush().map_err(written)?;
        let file = buffer.into_inner().map_err(|error| written(error.into_error()))?;
        // Synchronised before the renaming, so that a bag of that name is complete after a power failure too.
        file.sync_all().map_err(written)?;
        let size_bytes = file.metadata().map_err(written)?.len();
        drop(file);
        fs::rename(&temporary, &path)
            .map_err(|source| BagError::Create { path: path.clone(), source })?;
        Ok(BagSummary { path, size_bytes, message_count, topic_counts, start, end })
    }

    fn message_count(&self) -> u64 {
        self.channels.values().map(|channel| u64::from(channel.messages)).sum()
    }

    /// The metadata that rosbag2 writes into the file; it takes the topics from the
    /// statistics and lists none here.
    fn metadata_yaml(&self) -> String {
        let name = self.path.file_name().map_or_else(String::new, |name| {
            // Double-quoted strings have the same escapes in YAML as in JSON.
            serde_json::Value::from(name.to_string_lossy().as_ref()).to_string()
        });
        let start = self.start.unwrap_or_default();
        let start_nanos = start.as_nanos();
        let duration_nanos =
            self.end.map_or(0, |end| end.as_nanos().saturating_sub(start.as_nanos()));
        let count = self.message_count();
        format!(
            "version: {METADATA_VERSION}\nstorage_identifier: mcap\nduration:\n  nanoseconds: {duration_nanos}\n\
             starting_time:\n  nanoseconds_since_epoch: {start_nanos}\nmessage_count: {count}\n\
             topics_with_message_count:\n  []\ncompression_format: \"\"\ncompression_mode: \"\"\n\
             relative_file_paths:\n  - {name}\nfiles:\n  - path: {name}\n    starting_time:\n      \
             nanoseconds_since_epoch: {start_nanos}\n    duration:\n      nanoseconds: {duration_nanos}\n    \
             message_count: {count}\ncustom_data: ~\nros_distro: \"\""
        )
    }
}
