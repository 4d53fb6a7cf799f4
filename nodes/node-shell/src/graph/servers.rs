//! The servers of the services that the node asks: whether one is there, and can hear and answer.

use std::collections::{BTreeMap, BTreeSet};

use rustdds::GUID;

/// The ends of servers that the node's clients have found, by the names that their topics have on the wire. A server has a reader of
/// requests and a writer of responses.
#[derive(Default, Debug)]
pub(super) struct Servers {
    ends: BTreeMap<String, BTreeSet<GUID>>,
}

impl Servers {
    /// Notes an end of a server that matches one of a client.
    pub(super) fn found(&mut self, topic: &str, end: GUID) {
        self.ends.entry(topic.to_owned()).or_default().insert(end);
    }

    /// Forgets what has gone.
    pub(super) fn lost(&mut self, is_lost: impl Fn(&GUID) -> bool) {
        self.ends.retain(|_, ends| {
            ends.retain(|end| !is_lost(end));
            !ends.is_empty()
        });
    }

    /// Whether one participant takes the requests of a service and sends its responses.
    pub(super) fn has(&self, (requests, responses): (&str, &str)) -> bool {
        let (Some(readers), Some(writers)) = (self.ends.get(requests), self.ends.get(responses))
        else {
            return false;
        };
        readers.iter().any(|reader| writers.iter().any(|writer| writer.prefix == reader.prefix))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOPICS: (&str, &str) = ("rq/switchRequest", "rr/switchReply");

    fn guid(participant: u8, entity: u8) -> GUID {
        let mut bytes = [participant; 16];
        bytes[12..].fill(entity);
        GUID::from_bytes(bytes)
    }

    #[test]
    fn a_server_is_there_once_both_of_its_ends_are() {
        let mut servers = Servers::default();
        servers.found(TOPICS.0, guid(5, 1));
        servers.found(TOPICS.1, guid(6, 2));
        assert!(!servers.has(TOPICS), "two halves of different servers");
        servers.found(TOPICS.1, guid(5, 2));
        assert!(servers.has(TOPICS));
        assert!(!servers.has(("rq/otherRequest", TOPICS.1)));
        servers.lost(|end| *end == guid(5, 1));
        assert!(!servers.has(TOPICS));
    }
}
