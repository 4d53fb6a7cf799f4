//! The channels and schemas of one MCAP file, as far as they are known.

use std::collections::BTreeMap;
use std::sync::Arc;

use mcap::records::{Record, op};

use crate::qos::OfferedQos;

/// Key of a channel's metadata under which rosbag2 keeps the QoS of the recorded publishers.
pub(crate) const QOS_METADATA_KEY: &str = "offered_qos_profiles";

/// What a channel carries.
#[derive(PartialEq, Debug)]
pub(crate) struct Channel {
    pub(crate) topic: Arc<str>,
    /// Empty for a channel without a schema.
    pub(crate) type_name: Arc<str>,
    pub(crate) encoding: Arc<str>,
    pub(crate) qos: Option<OfferedQos>,
}

/// The channels and schemas that have been seen.
#[derive(Clone, Default, Debug)]
pub(crate) struct Catalogue {
    schema_names: BTreeMap<u16, Arc<str>>,
    channels: BTreeMap<u16, Arc<Channel>>,
    /// Channels whose schema has not been seen: parts of a file are not always read in its order.
    waiting: Vec<mcap::records::Channel>,
}

impl Catalogue {
    /// Takes in a schema or channel record; others are ignored. The first description of a channel
    /// counts, as the format allows no other.
    pub(crate) fn take(&mut self, opcode: u8, body: &[u8]) -> Result<(), mcap::McapError> {
        if opcode != op::SCHEMA && opcode != op::CHANNEL {
            return Ok(());
        }
        match mcap::parse_record(opcode, body)? {
            Record::Schema { header, .. } => {
                let known = self.schema_names.len();
                self.schema_names.entry(header.id).or_insert_with(|| header.name.into());
                if self.schema_names.len() > known {
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
        let type_name = match (channel.schema_id, self.schema_names.get(&channel.schema_id)) {
            (0, _) => Arc::from(""),
            (_, Some(name)) => Arc::clone(name),
            (_, None) => {
                if !self.waiting.contains(&channel) {
                    self.waiting.push(channel);
                }
                return;
            }
        };
        let qos =
            channel.metadata.get(QOS_METADATA_KEY).and_then(|text| OfferedQos::from_yaml(text));
        self.channels.entry(channel.id).or_insert_with(|| {
            Arc::new(Channel {
                topic: channel.topic.into(),
                type_name,
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
