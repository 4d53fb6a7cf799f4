//! The endpoints of others on the network: every publisher and subscription that was discovered, whose it is,
//! and which pairs of them cannot talk.

use std::collections::BTreeSet;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use rustdds::policy::{Durability, Liveliness, Ownership, Reliability};
use rustdds::qos::QosPolicyId;
use rustdds::{DomainParticipant, Duration, GUID, QosPolicies, RTPSEntity};

use crate::graph::{Graph, Role};
use crate::settings::names::ros_type_name;
use crate::settings::qos::Qos;
use crate::wire::rmw_zenoh::PARTICIPANT_MARK;
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::keys::{self, Kind, Token};

/// The prefix that ROS 2 puts in front of the name of a topic on the wire; services and actions have others.
const TOPIC_PREFIX: &str = "rt/";

/// One publisher or subscription of another process.
#[derive(Clone, PartialEq, Debug)]
pub struct DiscoveredEndpoint {
    /// Which end of the topic it is.
    pub role: Role,
    /// The topic, by its absolute name.
    pub topic: String,
    /// The type of its messages, as `sensor_msgs/msg/LaserScan`; another form where it is of no ROS 2.
    pub type_name: String,
    /// The hash of that type's definition (REP-2011), which is known on Zenoh.
    pub type_hash: Option<String>,
    /// How it delivers, or wants to be delivered to.
    pub qos: DiscoveredQos,
    /// The node that it belongs to, by its full name; known once the peer has announced it.
    pub node: Option<String>,
    /// Whether its participant announced its nodes in the form of a ROS 2 before Iron, which is not read here.
    pub is_before_iron: bool,
    /// The participant that it belongs to.
    pub participant: ParticipantId,
    /// Where it can be reached.
    pub addresses: BTreeSet<Ipv4Addr>,
}

impl DiscoveredEndpoint {
    /// Whose it is: a node, or else a participant.
    #[must_use]
    pub fn owner(&self) -> String {
        match &self.node {
            Some(node) => format!("node {node}"),
            None => format!("participant {}", self.participant),
        }
    }
}

/// The first twelve bytes of every name that a DDS participant gives to something of its own.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct ParticipantId(pub [u8; 12]);

impl ParticipantId {
    fn of(guid: GUID) -> Self {
        let mut prefix = [0; 12];
        prefix.copy_from_slice(&guid.to_bytes()[..12]);
        Self(prefix)
    }

    /// The vendor of its DDS library, which is in its first two bytes (RTPS 2.5, 8.2.4.2; the numbers are
    /// the OMG's).
    #[must_use]
    pub fn vendor(&self) -> &'static str {
        let [first, second, ..] = self.0;
        match [first, second] {
            [0x01, 0x01 | 0x0a] => "RTI Connext",
            [0x01, 0x02] => "OpenSplice",
            [0x01, 0x03] => "OpenDDS",
            [0x01, 0x0f] => "Fast DDS",
            [0x01, 0x10] => "Cyclone DDS",
            [0x01, 0x11] => "GurumDDS",
            [0x01, 0x12] => "RustDDS",
            [0x01, 0x14] => "Dust DDS",
            PARTICIPANT_MARK => "Zenoh",
            _ => "unknown DDS",
        }
    }

    /// Whether publishers and subscriptions whose quality of service does not fit are kept apart: not on Zenoh.
    #[must_use]
    pub fn compares_qos(&self) -> bool {
        !self.0.starts_with(&PARTICIPANT_MARK)
    }
}

impl fmt::Display for ParticipantId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(formatter, "{byte:02x}"))
    }
}

/// How a discovered endpoint delivers, or wants to be delivered to.
#[derive(Clone, PartialEq, Debug)]
pub struct DiscoveredQos {
    role: Role,
    policies: QosPolicies,
}

/// Why a publisher and a subscription exchange nothing.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct QosMismatch {
    /// The policy that does not fit, as ROS 2 calls it.
    pub policy: &'static str,
    /// The policy that the publisher offers.
    pub offered: String,
    /// The policy that the subscription requests.
    pub requested: String,
}

impl DiscoveredQos {
    /// That of a publisher of this suite.
    #[must_use]
    pub fn of_publisher(qos: &Qos) -> Self {
        // The limits, in which a writer's policies differ from a reader's, are not announced.
        Self { role: Role::Publisher, policies: qos.reader_policies() }
    }

    /// That of a subscription of this suite.
    #[must_use]
    pub fn of_subscription(qos: &Qos) -> Self {
        Self { role: Role::Subscription, policies: qos.reader_policies() }
    }

    /// What a publisher offers.
    pub(super) fn offered(policies: &QosPolicies) -> Self {
        Self { role: Role::Publisher, policies: policies.clone() }
    }

    /// What a subscription requests.
    pub(super) fn requested(policies: &QosPolicies) -> Self {
        Self { role: Role::Subscription, policies: policies.clone() }
    }

    /// Whether lost messages are sent again, or are to be.
    #[must_use]
    pub fn is_reliable(&self) -> bool {
        // A policy that an endpoint does not announce has its default, which depends on which end it is.
        match self.policies.reliability() {
            Some(Reliability::Reliable { .. }) => true,
            Some(Reliability::BestEffort) => false,
            None => self.role == Role::Publisher,
        }
    }

    /// Whether late subscribers get the last messages, or want them.
    #[must_use]
    pub fn is_transient_local(&self) -> bool {
        !matches!(self.policies.durability(), None | Some(Durability::Volatile))
    }

    /// The policies of this publisher that do not fit a subscription; `None` when they fit.
    #[must_use]
    pub fn mismatch(&self, requested: &Self) -> Option<QosMismatch> {
        let (policy, of): (_, fn(&Self) -> String) =
            match self.policies.compliance_failure_wrt(&requested.policies)? {
                QosPolicyId::Reliability => ("reliability", Self::reliability),
                QosPolicyId::Durability => ("durability", Self::durability),
                QosPolicyId::Deadline => ("deadline", Self::deadline),
                QosPolicyId::Liveliness => ("liveliness", Self::liveliness),
                QosPolicyId::Ownership => ("ownership", Self::ownership),
                QosPolicyId::Representation => ("data representation", |_| "another".to_owned()),
                _ => ("a rare policy", |_| "another".to_owned()),
            };
        Some(QosMismatch { policy, offered: of(self), requested: of(requested) })
    }

    fn reliability(&self) -> String {
        if self.is_reliable() { "reliable" } else { "best effort" }.to_owned()
    }

    fn durability(&self) -> String {
        match self.policies.durability() {
            None | Some(Durability::Volatile) => "volatile",
            Some(Durability::TransientLocal) => "transient local",
            Some(Durability::Transient) => "transient",
            Some(Durability::Persistent) => "persistent",
        }
        .to_owned()
    }

    fn deadline(&self) -> String {
        self.policies.deadline().map_or_else(|| "none".to_owned(), |deadline| seconds(deadline.0))
    }

    fn ownership(&self) -> String {
        match self.policies.ownership() {
            None | Some(Ownership::Shared) => "shared",
            Some(Ownership::Exclusive { .. }) => "exclusive",
        }
        .to_owned()
    }

    fn liveliness(&self) -> String {
        let (kind, lease) = match self.policies.liveliness() {
            None => ("automatic", Duration::INFINITE),
            Some(Liveliness::Automatic { lease_duration }) => ("automatic", lease_duration),
            Some(Liveliness::ManualByParticipant { lease_duration }) => {
                ("manual by participant", lease_duration)
            }
            Some(Liveliness::ManualByTopic { lease_duration }) => {
                ("manual by topic", lease_duration)
            }
        };
        if lease == Duration::INFINITE {
            return format!("{kind} without a lease");
        }
        format!("{kind} with a lease of {}", seconds(lease))
    }
}

impl fmt::Display for DiscoveredQos {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}, {}", self.reliability(), self.durability())?;
        match self.policies.deadline() {
            Some(deadline) if deadline.0 != Duration::INFINITE => {
                write!(formatter, ", deadline {}", seconds(deadline.0))
            }
            _ => Ok(()),
        }
    }
}

fn seconds(duration: Duration) -> String {
    if duration == Duration::INFINITE {
        "none".to_owned()
    } else {
        format!("{:.3} s", duration.to_std().as_secs_f64())
    }
}

/// The endpoints discovered so far, by topic. The participant's own endpoints are not among it.
pub(crate) fn of(participant: &DomainParticipant, graph: &Graph) -> Vec<DiscoveredEndpoint> {
    let own = ParticipantId::of(participant.guid());
    let endpoint = |role, guid: GUID, (topic, dds_type): (&str, &str), policies, addresses| {
        let id = ParticipantId::of(guid);
        let topic = ros_topic_name(topic).filter(|_| id != own)?;
        Some(DiscoveredEndpoint {
            role,
            topic,
            type_name: ros_type_name(dds_type),
            type_hash: None,
            qos: DiscoveredQos { role, policies },
            node: graph.node_of(guid),
            is_before_iron: graph.is_before_iron(guid),
            participant: id,
            addresses,
        })
    };
    let readers = participant.discovered_readers();
    let readers = readers.iter().filter_map(|reader| {
        let data = &reader.subscription_topic_data;
        let at = reader.reader_proxy.unicast_locator_list.iter().cloned().map(SocketAddr::from);
        let name = (data.topic_name().as_str(), data.type_name().as_str());
        endpoint(Role::Subscription, data.key(), name, data.qos(), ipv4(at))
    });
    let writers = participant.discovered_writers();
    let writers = writers.iter().filter_map(|writer| {
        let data = &writer.publication_topic_data;
        let at = writer.writer_proxy.unicast_locator_list.iter().cloned().map(SocketAddr::from);
        let name = (data.topic_name.as_str(), data.type_name.as_str());
        endpoint(Role::Publisher, data.key, name, data.qos(), ipv4(at))
    });
    let mut all: Vec<_> = readers.chain(writers).collect();
    sort(&mut all);
    all
}

/// The endpoints of other processes on Zenoh.
#[cfg(feature = "zenoh")]
pub(crate) fn of_tokens(graph: &Graph) -> Vec<DiscoveredEndpoint> {
    let endpoint = |token: Token| {
        let role = match token.kind {
            Kind::Publisher => Role::Publisher,
            Kind::Subscription => Role::Subscription,
            _ => return None,
        };
        let guid = GUID::from_bytes(token.guid_bytes());
        let end = token.end?;
        Some(DiscoveredEndpoint {
            role,
            topic: end.name,
            type_name: ros_type_name(&end.dds_type),
            type_hash: Some(end.hash).filter(|hash| keys::is_hash(hash)),
            qos: DiscoveredQos { role, policies: end.qos.reader_policies() },
            node: graph.node_of(guid),
            is_before_iron: false,
            participant: ParticipantId::of(guid),
            addresses: BTreeSet::new(),
        })
    };
    let mut all: Vec<_> = graph.tokens().into_iter().filter_map(endpoint).collect();
    sort(&mut all);
    all
}

fn sort(all: &mut [DiscoveredEndpoint]) {
    all.sort_by(|a, b| {
        let key = |one: &DiscoveredEndpoint| (one.role, one.node.clone(), one.participant);
        (&a.topic, key(a)).cmp(&(&b.topic, key(b)))
    });
}

/// `/scan` for `rt/scan`; `None` for what is no topic of ROS 2.
fn ros_topic_name(dds_name: &str) -> Option<String> {
    dds_name.strip_prefix(TOPIC_PREFIX).map(|name| format!("/{name}"))
}

fn ipv4(addresses: impl Iterator<Item = SocketAddr>) -> BTreeSet<Ipv4Addr> {
    addresses
        .filter_map(|one| match one.ip() {
            IpAddr::V4(address) => Some(address),
            IpAddr::V6(_) => None,
        })
        .collect()
}

#[cfg(test)]
mod tests;
