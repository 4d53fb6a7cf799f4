//! The names that topics, services and endpoints have on Zenoh.

#[cfg(test)]
mod tests;

use std::fmt;

use xxhash_rust::xxh3::xxh3_128;

#[cfg(feature = "zenoh")]
use super::PARTICIPANT_MARK;
use crate::settings::qos::Qos;

/// Under it the tokens of the graph stand.
const TOKENS: &str = "@ros2_lv";
/// The hash of a type whose definition is not known.
#[cfg_attr(not(feature = "zenoh"), expect(dead_code, reason = "the names alone are tested then"))]
pub(crate) const UNKNOWN_HASH: &str = "TypeHashNotSupported";
/// What a hash of the first, and only, version of REP-2011 begins with, and how many hexadecimal digits follow.
#[cfg(feature = "zenoh")]
const HASH_FORM: (&str, usize) = ("RIHS01_", 64);
/// What stands for a name that is empty, and for a slash within a name: a part of a key must not be empty.
const SLASH: &str = "%";
/// The depth that an endpoint has which does not name it.
const DEFAULT_DEPTH: usize = 42;

/// The key of a topic's messages, or of a service: `0/robot/scan/sensor_msgs::msg::dds_::LaserScan_/RIHS01_...`. `hash` may be `*`
/// for a receiver.
pub(crate) fn data_key(domain_id: u16, absolute: &str, dds_type: &str, hash: &str) -> String {
    format!("{domain_id}/{}/{dds_type}/{hash}", absolute.trim_matches('/'))
}

/// Whether it is the hash of a definition: anything else in a bag must not become part of a key.
#[cfg(feature = "zenoh")]
pub(crate) fn is_hash(text: &str) -> bool {
    let digits = text.strip_prefix(HASH_FORM.0).unwrap_or_default();
    digits.len() == HASH_FORM.1 && digits.bytes().all(|digit| digit.is_ascii_hexdigit())
}

/// All tokens of a domain.
pub(crate) fn all_tokens(domain_id: u16) -> String {
    format!("{TOKENS}/{domain_id}/**")
}

/// The identity of the endpoint that has this token.
pub(crate) fn identity(token: &str) -> [u8; 16] {
    xxh3_128(token.as_bytes()).to_le_bytes()
}

/// What a token announces.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    Node,
    Publisher,
    Subscription,
    Server,
    Client,
}

impl Kind {
    const ALL: [(Self, &'static str); 5] = [
        (Self::Node, "NN"),
        (Self::Publisher, "MP"),
        (Self::Subscription, "MS"),
        (Self::Server, "SS"),
        (Self::Client, "SC"),
    ];

    fn code(self) -> &'static str {
        Self::ALL.iter().find(|(kind, _)| *kind == self).map_or("", |(_, code)| code)
    }
}

/// A node's place on the network.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct NodePlace {
    pub(crate) domain_id: u16,
    /// The session's identity, in hexadecimal digits.
    pub(crate) session: String,
    /// The node's number in its session.
    pub(crate) node_id: u64,
    pub(crate) namespace: String,
    pub(crate) name: String,
}

impl NodePlace {
    /// The node's number for this process: as DDS has participants, by twelve bytes.
    #[cfg(feature = "zenoh")]
    pub(crate) fn participant(&self) -> [u8; 12] {
        let hash = xxh3_128(format!("{}/{}", self.session, self.node_id).as_bytes()).to_le_bytes();
        let mut number = [0; 12];
        let (mark, rest) = number.split_at_mut(PARTICIPANT_MARK.len());
        mark.copy_from_slice(&PARTICIPANT_MARK);
        rest.iter_mut().zip(hash).for_each(|(to, from)| *to = from);
        number
    }
}

/// A topic or a service as an endpoint announces it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct End {
    /// Absolute.
    pub(crate) name: String,
    pub(crate) dds_type: String,
    pub(crate) hash: String,
    pub(crate) qos: Qos,
}

/// What announces a node or one of its endpoints.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Token {
    pub(crate) node: NodePlace,
    /// The endpoint's number in its session; a node's own is that of the node.
    pub(crate) entity_id: u64,
    pub(crate) kind: Kind,
    /// None for a node.
    pub(crate) end: Option<End>,
}

impl Token {
    /// The endpoint's number for this process: as DDS has names of endpoints, by sixteen bytes.
    #[cfg(feature = "zenoh")]
    pub(crate) fn guid_bytes(&self) -> [u8; 16] {
        let mut bytes = [0; 16];
        let (participant, entity) = bytes.split_at_mut(12);
        participant.copy_from_slice(&self.node.participant());
        entity.iter_mut().zip(self.entity_id.to_le_bytes()).for_each(|(to, from)| *to = from);
        bytes
    }

    /// `None` for a key that is no token of a ROS 2.
    pub(crate) fn parse(key: &str) -> Option<Self> {
        let mut parts = key.split('/');
        let mut next = || parts.next();
        if next()? != TOKENS {
            return None;
        }
        let domain_id = next()?.parse().ok()?;
        let session = next()?.to_owned();
        let node_id = next()?.parse().ok()?;
        let entity_id = next()?.parse().ok()?;
        let code = next()?;
        let (kind, _) = Kind::ALL.into_iter().find(|(_, one)| *one == code)?;
        let _enclave = next()?;
        let namespace = plain(next()?);
        let node = NodePlace { domain_id, session, node_id, namespace, name: plain(next()?) };
        let end = match kind {
            Kind::Node => None,
            _ => Some(End {
                name: plain(next()?),
                dds_type: next()?.to_owned(),
                hash: next()?.to_owned(),
                qos: parse_qos(next()?)?,
            }),
        };
        Some(Self { node, entity_id, kind, end })
    }
}

impl fmt::Display for Token {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let NodePlace { domain_id, session, node_id, namespace, name } = &self.node;
        let (entity_id, code) = (self.entity_id, self.kind.code());
        let (namespace, name) = (escaped(namespace), escaped(name));
        // There are no enclaves here.
        write!(
            formatter,
            "{TOKENS}/{domain_id}/{session}/{node_id}/{entity_id}/{code}/{SLASH}/{namespace}/{name}"
        )?;
        match &self.end {
            None => Ok(()),
            Some(End { name, dds_type, hash, qos }) => {
                write!(formatter, "/{}/{dds_type}/{hash}/{}", escaped(name), qos_text(qos))
            }
        }
    }
}

fn escaped(name: &str) -> String {
    if name.is_empty() { SLASH.to_owned() } else { name.replace('/', SLASH) }
}

fn plain(escaped: &str) -> String {
    escaped.replace(SLASH, "/")
}

/// Reliability, durability, history with depth, deadline, lifespan and liveliness; what has the default of ROS 2 is left out.
fn qos_text(qos: &Qos) -> String {
    let reliability = if qos.is_reliable() { "" } else { "2" };
    let durability = if qos.is_transient_local() { "1" } else { "" };
    format!("{reliability}:{durability}:,{}:,:,:,,", qos.depth())
}

fn parse_qos(text: &str) -> Option<Qos> {
    let mut parts = text.split(':');
    let (reliability, durability) = (parts.next()?, parts.next()?);
    let (_, depth) = parts.next()?.split_once(',')?;
    let depth = if depth.is_empty() { DEFAULT_DEPTH } else { depth.parse().ok()? };
    Some(Qos::new(reliability != "2", durability == "1", depth))
}
