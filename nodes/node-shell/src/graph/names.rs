//! The names of the nodes behind the peers, which ROS 2 publishes on a topic of its own.

use std::collections::BTreeMap;
use std::fmt::Write;

use futures::{Stream, StreamExt};
use rustdds::{DomainParticipant, GUID, TopicKind};
use serde::Deserialize;

use crate::settings::qos::Qos;

const TOPIC: &str = "ros_discovery_info";
const TYPE: &str = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";

/// How many participants' announcements are held until they are read.
const DEPTH: usize = 64;

/// How many participants are remembered; those beyond are named by their numbers.
const MOST_PARTICIPANTS: usize = 1024;

/// `rmw_dds_common/msg/ParticipantEntitiesInfo`, as since ROS 2 Iron.
#[derive(Clone, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct ParticipantNodes {
    participant: [u8; 16],
    nodes: Vec<NodeEndpoints>,
}

#[cfg(feature = "zenoh")]
impl ParticipantNodes {
    /// A participant that is one node.
    pub(super) fn of_node(prefix: [u8; 12], namespace: &str, name: &str) -> Self {
        let mut participant = [0; 16];
        participant.iter_mut().zip(prefix).for_each(|(to, from)| *to = from);
        let (namespace, name) = (namespace.to_owned(), name.to_owned());
        let node = NodeEndpoints { namespace, name, readers: Vec::new(), writers: Vec::new() };
        Self { participant, nodes: vec![node] }
    }
}

/// `rmw_dds_common/msg/NodeEntitiesInfo`.
#[derive(Clone, PartialEq, Eq, Debug, Deserialize)]
struct NodeEndpoints {
    namespace: String,
    name: String,
    readers: Vec<[u8; 16]>,
    writers: Vec<[u8; 16]>,
}

/// The names of participants, as announced.
#[derive(Debug, Default)]
pub(super) struct NodeNames {
    participants: BTreeMap<[u8; 12], Vec<NodeEndpoints>>,
}

impl NodeNames {
    pub(super) fn take(&mut self, announced: ParticipantNodes) {
        let prefix = prefix(&announced.participant);
        if self.participants.len() < MOST_PARTICIPANTS || self.participants.contains_key(&prefix) {
            self.participants.insert(prefix, announced.nodes);
        }
    }

    pub(super) fn forget(&mut self, participant: &[u8; 12]) {
        self.participants.remove(participant);
    }

    /// The owner of an endpoint: a node when it is known, or else a participant.
    pub(super) fn of(&self, endpoint: GUID) -> String {
        let prefix = prefix(&endpoint.to_bytes());
        let nodes = self.nodes_of(&prefix);
        let number = in_hex(&prefix);
        match self.node_of(endpoint) {
            Some(node) => format!("node {node}"),
            None if nodes.is_empty() => format!("of participant {number}"),
            None => format!("of one of the {} nodes of participant {number}", nodes.len()),
        }
    }

    /// The name of a participant: its nodes when they are known.
    pub(super) fn of_participant(&self, prefix: [u8; 12]) -> String {
        match self.nodes_of(&prefix) {
            [] => format!("participant {}", in_hex(&prefix)),
            [only] => format!("node {}", full_name(only)),
            several => {
                let names: Vec<_> = several.iter().map(full_name).collect();
                format!("nodes {}", names.join(", "))
            }
        }
    }

    /// The full name of the node that an endpoint belongs to, where that is known.
    pub(super) fn node_of(&self, endpoint: GUID) -> Option<String> {
        let bytes = endpoint.to_bytes();
        let nodes = self.nodes_of(&prefix(&bytes));
        let owns =
            |node: &&NodeEndpoints| node.readers.contains(&bytes) || node.writers.contains(&bytes);
        let owner = nodes.iter().find(owns).or(match nodes {
            [only] => Some(only),
            _ => None,
        })?;
        Some(full_name(owner))
    }

    /// Whether the participant of an endpoint announced itself without any node. That of a ROS 2 before Iron seems to: names
    /// of endpoints had 24 bytes then, the last eight of them zero, which are read as a list of nodes without nodes.
    pub(super) fn announces_none(&self, endpoint: GUID) -> bool {
        let nodes = self.participants.get(&prefix(&endpoint.to_bytes()));
        nodes.is_some_and(Vec::is_empty)
    }

    fn nodes_of(&self, prefix: &[u8; 12]) -> &[NodeEndpoints] {
        self.participants.get(prefix).map_or(&[], Vec::as_slice)
    }
}

fn full_name(node: &NodeEndpoints) -> String {
    format!("{}/{}", node.namespace.trim_end_matches('/'), node.name)
}

fn in_hex(prefix: &[u8; 12]) -> String {
    prefix.iter().fold(String::new(), |mut number, byte| {
        let _ = write!(number, "{byte:02x}");
        number
    })
}

fn prefix(guid: &[u8; 16]) -> [u8; 12] {
    let mut prefix = [0; 12];
    prefix.copy_from_slice(&guid[..12]);
    prefix
}

/// The announcements of participants, as they arrive; `None` when the library refuses.
pub(crate) fn announced(
    participant: &DomainParticipant,
) -> Option<impl Stream<Item = ParticipantNodes> + Send + use<>> {
    let qos = Qos::new(true, true, DEPTH).reader_policies();
    let reader = participant
        .create_topic(TOPIC.to_owned(), TYPE.to_owned(), &qos, TopicKind::NoKey)
        .and_then(|topic| {
            participant
                .create_subscriber(&qos)?
                .create_datareader_no_key_cdr::<ParticipantNodes>(&topic, None)
        })
        .inspect_err(|error| tracing::debug!("peers stay without names: {error}"))
        .ok()?;
    // An older ROS 2 announces in another form: its nodes stay without names.
    Some(reader.async_bare_sample_stream().filter_map(async |announced| announced.ok()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guid(participant: u8, endpoint: u8) -> [u8; 16] {
        let mut guid = [participant; 16];
        guid[12..].fill(endpoint);
        guid
    }

    fn node(name: &str, writer: [u8; 16]) -> NodeEndpoints {
        NodeEndpoints {
            namespace: "/".to_owned(),
            name: name.to_owned(),
            readers: Vec::new(),
            writers: vec![writer],
        }
    }

    #[test]
    fn a_peer_is_named_by_its_node_or_else_by_its_participant() {
        let mut names = NodeNames::default();
        let of = |names: &NodeNames, participant, endpoint| {
            names.of(GUID::from_bytes(guid(participant, endpoint)))
        };
        assert_eq!(of(&names, 0xab, 1), format!("of participant {}", "ab".repeat(12)));
        names.take(ParticipantNodes {
            participant: guid(0xab, 0),
            nodes: vec![node("driver", guid(0xab, 1)), node("filter", guid(0xab, 2))],
        });
        assert_eq!(of(&names, 0xab, 1), "node /driver");
        assert_eq!(of(&names, 0xab, 2), "node /filter");
        assert!(of(&names, 0xab, 3).starts_with("of one of the 2 nodes of participant abab"));
        names.take(ParticipantNodes {
            participant: guid(0xab, 0),
            nodes: vec![node("driver", guid(0xab, 1))],
        });
        assert_eq!(of(&names, 0xab, 9), "node /driver");
        assert_eq!(names.of_participant([0xab; 12]), "node /driver");
        names.forget(&[0xab; 12]);
        assert!(names.of_participant([0xab; 12]).starts_with("participant abab"));
        assert!(of(&names, 0xab, 1).starts_with("of participant"));
    }

    #[test]
    fn names_of_so_many_participants_are_kept_and_no_more() {
        let mut names = NodeNames::default();
        for number in 0..2 * MOST_PARTICIPANTS as u32 {
            let mut participant = [0; 16];
            participant[..4].copy_from_slice(&number.to_le_bytes());
            names.take(ParticipantNodes { participant, nodes: Vec::new() });
        }
        assert_eq!(names.participants.len(), MOST_PARTICIPANTS);
        // Those that are known may change.
        let nodes = vec![node("driver", guid(0, 1))];
        names.take(ParticipantNodes { participant: [0; 16], nodes });
        assert_eq!(names.of_participant([0; 12]), "node /driver");
    }
}
