//! Conversion of bags of ROS 1 (format 2.0) to bags of ROS 2.
//!
//! Every message is encoded again in CDR, by the definition in the bag. Types with the same name but another
//! layout in ROS 2 (markers) are left out, and reported.

mod definition;
#[cfg(test)]
mod tests;
mod transcode;

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use geometry::Stamp;
use rosbag::record_types::Connection;
use rosbag::{ChunkRecord, MessageRecord, RosBag};

pub use self::definition::DefinitionError;
use self::definition::{Definitions, Member, as_ros2, layout};
pub use self::transcode::TranscodeError;
use self::transcode::transcode;
use crate::error::{Loss, LossKind};
use crate::foreign::{FileKind, kind_of};
use crate::qos::OfferedQos;
use crate::temporary::Temporary;
use crate::{BagError, BagSummary, BagWriter, ChannelId};

/// The history depth with which topics of ROS 1 are played.
const DEPTH: u32 = 10;
/// The first record of a bag is padded to this length (format 2.0), after the line with the version.
const HEADER_BYTES: u64 = 4096 + 13;

/// A bag of ROS 1 cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum Ros1Error {
    /// The file cannot be opened, or is not a bag.
    #[error("cannot read {} as a bag of ROS 1: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The bag was not closed, or was cut.
    #[error(
        "{} was not closed when it was recorded, or was cut: its index at byte {index_at} is not there; \
         `rosbag reindex` fixes that",
        path.display()
    )]
    NoIndex {
        /// The file.
        path: PathBuf,
        /// The offset of the index; 0 where the recorder did not write it.
        index_at: u64,
    },
    /// The output bag cannot be written.
    #[error(transparent)]
    Write(#[from] BagError),
}

/// The result of a conversion.
#[derive(Clone, PartialEq, Debug)]
pub struct Ros1Conversion {
    /// The bag that was written.
    pub summary: BagSummary,
    /// Topics that were left out, each with the reason and the number of its messages.
    pub left_out: BTreeMap<String, LeftOut>,
    /// Why reading ended before the end of the bag, if it did.
    pub broken_off: Option<String>,
}

/// A topic that was left out, in whole or in part.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LeftOut {
    /// Its type in the bag.
    pub type_name: String,
    /// The first reason.
    pub reason: String,
    /// The number of its messages that were left out.
    pub messages: u64,
}

/// Converts a bag of ROS 1 to a bag of ROS 2, with the messages of each chunk in the order of recording. Ends
/// before a chunk for which `goes_on` returns false, with the messages so far.
///
/// # Errors
/// When the bag cannot be read at all, or the output cannot be written. Errors of single topics or
/// messages are in the result.
pub fn convert_ros1(
    path: &Path,
    output: &Path,
    goes_on: impl Fn() -> bool,
) -> Result<Ros1Conversion, Ros1Error> {
    let open = |source| Ros1Error::Open { path: path.to_owned(), source };
    let index_at = index_position(path).map_err(open)?;
    let length = std::fs::metadata(path).map_err(open)?.len();
    if index_at < HEADER_BYTES || index_at > length {
        return Err(Ros1Error::NoIndex { path: path.to_owned(), index_at });
    }
    let bag = RosBag::new(path).map_err(open)?;
    let mut conversion = Converter {
        writer: BagWriter::create(output)?,
        topics: BTreeMap::new(),
        left_out: BTreeMap::new(),
    };
    let mut broken_off = None;
    for record in bag.chunk_records() {
        if !goes_on() {
            break;
        }
        let taken = match record {
            Ok(ChunkRecord::Chunk(chunk)) => conversion.take_all(chunk.messages())?,
            Ok(ChunkRecord::IndexData(_)) => Ok(()),
            Err(error) => Err(error),
        };
        if let Err(error) = taken {
            broken_off = Some(error.to_string());
            break;
        }
    }
    let Converter { writer, left_out, .. } = conversion;
    Ok(Ros1Conversion { summary: writer.finish()?, left_out, broken_off })
}

/// Whether a file begins like a bag of ROS 1.
#[must_use]
pub fn is_ros1(path: &Path) -> bool {
    matches!(kind_of(path), Ok(FileKind::Ros1))
}

/// Converts a bag of ROS 1 to a temporary file; returns it with the losses.
pub(crate) fn converted(
    path: &Path,
    goes_on: &dyn Fn() -> bool,
) -> Result<(Temporary, Vec<Loss>), BagError> {
    let temporary = Temporary::place_for(path)?;
    let conversion =
        convert_ros1(path, temporary.path(), goes_on).map_err(|error| match error {
            Ros1Error::Write(error) => error,
            error => BagError::Ros1(Box::new(error)),
        })?;
    if !goes_on() {
        return Err(BagError::Interrupted { path: path.to_owned() });
    }
    let loss = |messages, kind| Loss {
        file: path.to_owned(),
        offset_bytes: 0,
        size_bytes: 0,
        messages,
        kind,
    };
    let mut losses: Vec<Loss> = conversion
        .left_out
        .into_iter()
        .map(|(topic, LeftOut { type_name, reason, messages })| {
            let topic = format!("{topic} ({type_name})");
            loss(Some(messages), LossKind::LeftOut { topic, reason })
        })
        .collect();
    let broken_off = conversion.broken_off.map(|reason| LossKind::BrokenOff { reason });
    losses.extend(broken_off.map(|kind| loss(None, kind)));
    Ok((temporary, losses))
}

/// The offset of the index by the header. The reader of the crate does not check it.
fn index_position(path: &Path) -> std::io::Result<u64> {
    const FIELD: &[u8] = b"index_pos=";
    let mut header = Vec::new();
    std::fs::File::open(path)?.take(HEADER_BYTES).read_to_end(&mut header)?;
    let found = header.windows(FIELD.len()).position(|window| window == FIELD);
    let value = found.and_then(|at| header.get(at + FIELD.len()..at + FIELD.len() + 8));
    let value = value.and_then(|value| <[u8; 8]>::try_from(value).ok());
    value.map(u64::from_le_bytes).ok_or_else(|| {
        std::io::Error::new(std::io::ErrorKind::InvalidData, "it does not begin as a bag does")
    })
}

struct Converter {
    writer: BagWriter,
    /// By the connection's number.
    topics: BTreeMap<u32, Topic>,
    left_out: BTreeMap<String, LeftOut>,
}

/// The conversion of the messages of a connection.
#[derive(Clone)]
struct Topic {
    name: String,
    type_name: String,
    /// How they are written, or why they are not.
    plan: Result<(ChannelId, Vec<Member>), String>,
}

impl Converter {
    /// Takes the records of a chunk, up to the first that cannot be read.
    fn take_all<'a>(
        &mut self,
        records: impl Iterator<Item = rosbag::Result<MessageRecord<'a>>>,
    ) -> Result<rosbag::Result<()>, BagError> {
        for record in records {
            match record {
                Ok(MessageRecord::Connection(connection)) => self.connect(&connection)?,
                Ok(MessageRecord::MessageData(message)) => {
                    let at = Stamp::from_nanos(i64::try_from(message.time).unwrap_or(i64::MAX));
                    self.message(message.conn_id, at, message.data)?;
                }
                Err(error) => return Ok(Err(error)),
            }
        }
        Ok(Ok(()))
    }

    fn connect(&mut self, connection: &Connection<'_>) -> Result<(), BagError> {
        if self.topics.contains_key(&connection.id) {
            return Ok(());
        }
        let name = format!("/{}", connection.topic.trim_start_matches('/'));
        let plan = match Plan::of(connection) {
            Ok(Plan { type_name, schema, members }) => {
                let qos = if connection.latching {
                    OfferedQos::latched()
                } else {
                    OfferedQos::reliable(DEPTH)
                };
                let id = self.writer.raw_channel(&name, &type_name, &schema, &qos.to_yaml())?;
                Ok((id, members))
            }
            Err(reason) => Err(reason),
        };
        let topic = Topic { name, type_name: connection.tp.to_owned(), plan };
        self.topics.insert(connection.id, topic);
        Ok(())
    }

    fn message(&mut self, connection: u32, at: Stamp, data: &[u8]) -> Result<(), BagError> {
        let Some(topic) = self.topics.get(&connection) else {
            let reason = "its connection is not in the bag".to_owned();
            self.leave_out(&format!("connection {connection}"), "", reason);
            return Ok(());
        };
        let written = match &topic.plan {
            Ok((channel, members)) => {
                transcode(members, data).map(|cdr| (*channel, cdr)).map_err(|e| e.to_string())
            }
            Err(reason) => Err(reason.clone()),
        };
        match written {
            Ok((channel, cdr)) => self.writer.write_raw(channel, at, at, &cdr),
            Err(reason) => {
                let Topic { name, type_name, .. } = topic.clone();
                self.leave_out(&name, &type_name, reason);
                Ok(())
            }
        }
    }

    fn leave_out(&mut self, topic: &str, type_name: &str, reason: String) {
        let left_out = self.left_out.entry(topic.to_owned()).or_insert_with(|| LeftOut {
            type_name: type_name.to_owned(),
            reason,
            messages: 0,
        });
        left_out.messages += 1;
    }
}

/// How the messages of a type are written.
struct Plan {
    type_name: String,
    schema: String,
    members: Vec<Member>,
}

impl Plan {
    /// The conversion of a connection, or why there is none.
    fn of(connection: &Connection<'_>) -> Result<Self, String> {
        let in_ros1 = connection.tp;
        let wrong = |error: DefinitionError| error.to_string();
        let definition = connection.message_definition;
        let members = Definitions::read(in_ros1, definition)
            .and_then(|definitions| definitions.members(in_ros1))
            .map_err(wrong)?;
        // The type of transforms before tf2.
        let in_ros2 = if in_ros1 == "tf/tfMessage" { "tf2_msgs/TFMessage" } else { in_ros1 };
        let (package, name) = in_ros2
            .split_once('/')
            .ok_or_else(|| format!("{in_ros1} is not the name of a message type"))?;
        let type_name = format!("{package}/msg/{name}");
        let Some(schema) = msgs::schema_of(&type_name) else {
            let schema = as_ros2(in_ros1, definition);
            return Ok(Self { type_name, schema, members });
        };
        let known = Definitions::read(in_ros2, &schema)
            .and_then(|definitions| definitions.members(in_ros2))
            .map_err(wrong)?;
        if layout(&known) != layout(&members) {
            return Err(format!("{type_name} has another layout in ROS 2"));
        }
        Ok(Self { type_name, schema, members })
    }
}
