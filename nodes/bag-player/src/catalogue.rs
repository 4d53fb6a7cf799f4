//! The known channels and schemas of one file.

use std::collections::BTreeMap;
use std::sync::Arc;

use mcap::records::{Record, op};

use crate::qos::OfferedQos;
use crate::record;

/// Key of a channel's metadata under which rosbag2 keeps the QoS of the recorded publishers.
pub(crate) const QOS_METADATA_KEY: &str = "offered_qos_profiles";

/// The key of the hash of the type's description (REP-2011).
pub(crate) const HASH_METADATA_KEY: &str = "topic_type_hash";

/// The type and encoding of a channel.
#[derive(PartialEq, Debug)]
pub(crate) struct Channel {
    pub(crate) topic: Arc<str>,
    /// Empty for a channel without a schema.
    pub(crate) type_name: Arc<str>,
    pub(crate) encoding: Arc<str>,
    /// The definition of the type in the file; empty if it is not in the form of `.msg` files.
    pub(crate) definition: Arc<str>,
    /// The hash of the type's description; empty if there is none.
    pub(crate) type_hash: Arc<str>,
    pub(crate) qos: Option<OfferedQos>,
}

/// The name and definition of a type.
#[derive(Clone, Debug)]
struct Schema {
    name: Arc<str>,
    definition: Arc<str>,
}

/// The encoding of schemas that are the text of `.msg` files.
pub(crate) const MSG_FILES: &str = "ros2msg";

/// The channels and schemas that have been seen.
#[derive(Clone, Default, Debug)]
pub(crate) struct Catalogue {
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Arc<Channel>>,
    /// Channels whose schema has not been seen: parts of a file are not always read in its order.
    waiting: Vec<mcap::records::Channel>,
}

impl Catalogue {
    /// Adds a schema or channel record; others are ignored. The first description of a channel
    /// is used, as the format allows no other.
    pub(crate) fn take(&mut self, opcode: u8, body: &[u8]) -> Result<(), mcap::McapError> {
        if opcode != op::SCHEMA && opcode != op::CHANNEL {
            return Ok(());
        }
        match record::parse(opcode, body)? {
            Record::Schema { header, data } => {
                let known = self.schemas.len();
                self.schemas.entry(header.id).or_insert_with(|| {
                    let text =
                        (header.encoding == MSG_FILES).then(|| std::str::from_utf8(&data).ok());
                    let definition = text.flatten().unwrap_or_default().into();
                    Schema { name: header.name.into(), definition }
                });
                if self.schemas.len() > known {
                    for channel in std::mem::take(&mut self.waiting) {
                        self.add(channel);
                    }
                }
            }
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => {
                self.add(channel);
            }
            _ => {}
        }
        Ok(())
    }

    fn add(&mut self, channel: mcap::records::Channel) {
        let schema = match (channel.schema_id, self.schemas.get(&channel.schema_id)) {
            (0, _) => Schema { name: Arc::from(""), definition: Arc::from("") },
            (_, Some(schema)) => schema.clone(),
            (_, None) => {
                if !self.waiting.contains(&channel) {
                    self.waiting.push(channel);
                }
                return;
            }
        };
        let qos =
            channel.metadata.get(QOS_METADATA_KEY).and_then(|text| OfferedQos::from_yaml(text));
        let type_hash = channel.metadata.get(HASH_METADATA_KEY).cloned().unwrap_or_default();
        self.channels.entry(channel.id).or_insert_with(|| {
            Arc::new(Channel {
                topic: channel.topic.into(),
                type_name: schema.name,
                definition: schema.definition,
                type_hash: type_hash.into(),
                encoding: channel.message_encoding.into(),
                qos,
            })
        });
    }

    pub(crate) fn channel(&self, id: u16) -> Option<&Arc<Channel>> {
        self.channels.get(&id)
    }

    pub(crate) fn channels(&self) -> impl Iterator<Item = (u16, &Arc<Channel>)> {
        self.channels.iter().map(|(id, channel)| (*id, channel))
    }

    pub(crate) fn len(&self) -> usize {
        self.channels.len()
    }
}
