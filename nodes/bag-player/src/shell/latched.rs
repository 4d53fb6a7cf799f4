//! What is latched when playback begins behind the start of the bag.
//!
//! A subscriber of a latched topic has its last messages whenever it comes. Those of before `--start` are as much a part of the
//! played span as what is in it: static transforms, maps, descriptions of robots.

use std::collections::{BTreeMap, VecDeque};

use crate::bag::Bag;
use crate::error::BagError;
use crate::message::{BagMessage, Selection};
use crate::messages::Messages;

/// The latched topics of a selection, with how many messages each keeps.
#[derive(Clone, Debug, Default)]
pub(super) struct Latched {
    kept: BTreeMap<String, usize>,
}

/// The messages that were logged before the selection begins.
pub(super) struct Earlier {
    messages: Messages,
    kept: BTreeMap<String, usize>,
}

impl Latched {
    /// These topics, by their name in the bag.
    pub(super) fn new(kept: BTreeMap<String, usize>) -> Self {
        Self { kept }
    }

    /// Their messages of before the selection; `None` where there are none of them, or nothing is before.
    ///
    /// # Errors
    /// When a time of the selection is invalid.
    pub(super) fn before(
        &self,
        bag: &Bag,
        selection: &Selection,
    ) -> Result<Option<Earlier>, BagError> {
        if self.kept.is_empty() || selection.start_s.is_none_or(|start_s| start_s <= 0.0) {
            return Ok(None);
        }
        let earlier = Selection {
            topics: Some(self.kept.keys().cloned().collect()),
            start_s: None,
            duration_s: selection.start_s,
            all_encodings: false,
        };
        Ok(Some(Earlier { messages: bag.messages(&earlier)?, kept: self.kept.clone() }))
    }
}

impl Earlier {
    /// The last ones of each topic, in the order of their log times.
    ///
    /// # Errors
    /// When the bag cannot be read.
    pub(super) fn last(self) -> Result<Vec<BagMessage>, BagError> {
        let mut last: BTreeMap<String, VecDeque<BagMessage>> = BTreeMap::new();
        for message in self.messages {
            let message = message?;
            let kept = self.kept.get(&*message.topic).copied().unwrap_or_default();
            let of_topic = last.entry(message.topic.to_string()).or_default();
            of_topic.push_back(message);
            if of_topic.len() > kept {
                of_topic.pop_front();
            }
        }
        let mut last: Vec<BagMessage> = last.into_values().flatten().collect();
        last.sort_by_key(|message| message.log_time);
        Ok(last)
    }
}

#[cfg(test)]
mod tests {
    use geometry::Stamp;
    use msgs::std_msgs::String as Text;

    use super::*;
    use crate::{BagWriter, OfferedQos};

    #[test]
    fn the_last_messages_of_before_the_start_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.mcap");
        let mut bag = BagWriter::create(&path).unwrap();
        let channels = ["/once", "/often", "/other"]
            .map(|topic| bag.channel::<Text>(topic, OfferedQos::latched()).unwrap());
        let at = |second: i32| Stamp::from_secs_nanos(1_700_000_000 + second, 0);
        for (second, channel) in [(0, 0), (1, 1), (2, 1), (3, 2), (4, 1), (5, 1), (6, 1)] {
            bag.write(channels[channel], at(second), &Text { data: second.to_string() }).unwrap();
        }
        bag.finish().unwrap();
        let bag = Bag::open(&path).unwrap();
        let latched = Latched::new([("/once".into(), 1), ("/often".into(), 2)].into());
        let from = |start_s| Selection { start_s, ..Selection::default() };
        let earlier = latched.before(&bag, &from(Some(5.0))).unwrap().unwrap().last().unwrap();
        let found: Vec<String> =
            earlier.iter().map(|message| message.decode::<Text>().unwrap().data).collect();
        // The message of second 5 is played.
        assert_eq!(found, ["0", "2", "4"]);
        assert!(latched.before(&bag, &from(None)).unwrap().is_none());
        assert!(latched.before(&bag, &from(Some(0.0))).unwrap().is_none());
    }
}
