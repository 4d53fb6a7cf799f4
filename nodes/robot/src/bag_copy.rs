//! Messages of a bag written to another one as they are.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use bag_player::{BagError, BagInfo, BagMessage, BagSummary, BagWriter, ChannelId};

use crate::unfinished::Unfinished;

/// A bag with the topics of another.
pub(crate) struct BagCopy {
    writer: BagWriter,
    _unfinished: Unfinished,
    /// By topic and type.
    channels: BTreeMap<(Arc<str>, Arc<str>), ChannelId>,
}

impl BagCopy {
    /// Begins a bag with the playable topics of another, also those without messages.
    pub(crate) fn begin(output: &Path, info: &BagInfo) -> Result<Self, BagError> {
        let writer = BagWriter::create(output)?;
        let _unfinished = Unfinished::at(writer.temporary().to_owned());
        let mut copy = Self { writer, _unfinished, channels: BTreeMap::new() };
        for topic in info.topics.iter().filter(|topic| topic.is_playable()) {
            let key = (topic.topic.as_str().into(), topic.type_name.as_str().into());
            let known = || msgs::schema_of(&topic.type_name);
            let definition = topic.definition.clone().or_else(known).unwrap_or_default();
            let qos = topic.qos.map(|qos| qos.to_yaml()).unwrap_or_default();
            let (described, hash) = ((&*topic.type_name, &*definition), topic.type_hash.as_deref());
            let id = copy.writer.hashed_channel(&topic.topic, described, hash, &qos)?;
            copy.channels.insert(key, id);
        }
        Ok(copy)
    }

    pub(crate) fn write(&mut self, message: &BagMessage) -> Result<(), BagError> {
        let key = (Arc::clone(&message.topic), Arc::clone(&message.type_name));
        let id = match self.channels.get(&key) {
            Some(id) => *id,
            None => {
                let definition = msgs::schema_of(&message.type_name).unwrap_or_default();
                let id =
                    self.writer.raw_channel(&message.topic, &message.type_name, &definition, "")?;
                self.channels.insert(key, id);
                id
            }
        };
        self.writer.write_raw(id, message.log_time, message.publish_time, &message.data)
    }

    /// Completes the bag; until then it has a temporary name.
    pub(crate) fn finish(self) -> Result<BagSummary, BagError> {
        self.writer.finish()
    }
}
