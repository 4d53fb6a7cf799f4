//! The clients of the node's services: who asks, and whether its reader of responses is there.

use std::collections::{BTreeMap, BTreeSet};

use rustdds::GUID;

/// How many writers of responses a service has: each must have found a client's reader.
const RESPONSE_WRITERS: usize = 2;

/// What a request says of its client.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Client {
    /// One of its ends.
    pub(crate) guid: GUID,
    /// Whether that is its writer of requests for certain.
    pub(crate) is_writer: bool,
}

/// The ends of clients that the node's services have found. A client has two of them, in one participant: a writer of requests, and
/// a reader of responses.
#[derive(Default, Debug)]
pub(super) struct Clients {
    /// The readers of responses, each with its topic's name on the wire and those of our writers that have found it.
    readers: BTreeMap<GUID, (String, BTreeSet<GUID>)>,
    /// The writers of requests, each with its topic's name on the wire.
    writers: BTreeMap<GUID, String>,
}

impl Clients {
    /// Notes that one of our writers has found a reader of responses.
    pub(super) fn reader_found(&mut self, topic: &str, ours: GUID, reader: GUID) {
        let (_, found_by) =
            self.readers.entry(reader).or_insert_with(|| (topic.to_owned(), BTreeSet::new()));
        found_by.insert(ours);
    }

    /// Notes that our reader has found a writer of requests.
    pub(super) fn writer_found(&mut self, topic: &str, writer: GUID) {
        self.writers.insert(writer, topic.to_owned());
    }

    pub(super) fn has_reader(&self, reader: GUID) -> bool {
        self.readers.contains_key(&reader)
    }

    /// Forgets what has gone.
    pub(super) fn lost(&mut self, is_lost: impl Fn(&GUID) -> bool) {
        self.readers.retain(|reader, _| !is_lost(reader));
        self.writers.retain(|writer, _| !is_lost(writer));
    }

    /// The readers of a client's participant that a response would reach, by the topics of the service. `None` while the writer
    /// that the client asked by is not found, where the request names it, or while one of the clients has no reader: nothing in a
    /// request says which reader belongs to it, so each writer of requests is given one.
    pub(super) fn readers_of(
        &self,
        (requests, responses): (&str, &str),
        client: Client,
    ) -> Option<BTreeSet<GUID>> {
        if client.is_writer && !self.writers.contains_key(&client.guid) {
            return None;
        }
        let is_of_it = |guid: &GUID| guid.prefix == client.guid.prefix;
        let asking = self
            .writers
            .iter()
            .filter(|(writer, topic)| is_of_it(writer) && topic.as_str() == requests)
            .count();
        let listening: BTreeSet<_> = self
            .readers
            .iter()
            .filter(|(reader, (topic, found_by))| {
                is_of_it(reader) && topic == responses && found_by.len() >= RESPONSE_WRITERS
            })
            .map(|(reader, _)| *reader)
            .collect();
        (listening.len() >= asking.max(1)).then_some(listening)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOPICS: (&str, &str) = ("rq/switchRequest", "rr/switchReply");

    /// Something of the participant whose prefix is `participant` again and again.
    fn guid(participant: u8, entity: u8) -> GUID {
        let mut bytes = [participant; 16];
        bytes[12..].fill(entity);
        GUID::from_bytes(bytes)
    }

    /// How many readers the client has that asks by this end of this participant.
    fn readers_by(clients: &Clients, participant: u8, entity: u8) -> Option<usize> {
        let client = Client { guid: guid(participant, entity), is_writer: true };
        clients.readers_of(TOPICS, client).map(|readers| readers.len())
    }

    fn readers(clients: &Clients, participant: u8) -> Option<usize> {
        readers_by(clients, participant, 1)
    }

    #[test]
    fn a_client_listens_once_each_of_our_writers_has_found_its_reader() {
        let mut clients = Clients::default();
        clients.writer_found(TOPICS.0, guid(5, 1));
        assert_eq!(readers(&clients, 5), None);
        clients.reader_found(TOPICS.1, guid(1, 1), guid(5, 2));
        clients.reader_found(TOPICS.1, guid(1, 1), guid(5, 2));
        assert_eq!(readers(&clients, 5), None);
        clients.reader_found(TOPICS.1, guid(1, 2), guid(5, 2));
        assert_eq!(readers(&clients, 5), Some(1));
        assert_eq!(readers(&clients, 6), None, "another participant");
        clients.lost(|guid| *guid.prefix.as_ref() == [5; 12]);
        assert_eq!(readers(&clients, 5), None);
    }

    #[test]
    fn the_second_client_of_a_participant_needs_a_reader_of_its_own() {
        let mut clients = Clients::default();
        let found = |clients: &mut Clients, reader: u8| {
            for ours in [1, 2] {
                clients.reader_found(TOPICS.1, guid(1, ours), guid(5, reader));
            }
        };
        clients.writer_found(TOPICS.0, guid(5, 1));
        found(&mut clients, 2);
        clients.writer_found("rq/otherRequest", guid(5, 3));
        assert_eq!(readers(&clients, 5), Some(1), "it is a client of another service");
        let by_its_reader = Client { guid: guid(5, 2), is_writer: false };
        assert_eq!(clients.readers_of(TOPICS, by_its_reader).map(|readers| readers.len()), Some(1));
        // Its request was here before its writer was found; the response once went out to the first client's reader alone.
        assert_eq!(readers_by(&clients, 5, 4), None);
        clients.writer_found(TOPICS.0, guid(5, 4));
        assert_eq!(readers(&clients, 5), None);
        found(&mut clients, 6);
        assert_eq!(readers(&clients, 5), Some(2));
    }
}
