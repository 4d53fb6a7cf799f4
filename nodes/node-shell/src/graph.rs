//! Who is at the other end: which peers match the node's publishers and subscriptions.
//!
//! This takes the place of the client library's own event loop, which keeps the incompatible offers to
//! itself, takes `/clock` for a topic of another type, and does not compare types at all: the DDS
//! library matches by the topic's name alone, so that a foreign message would be decoded as ours.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use futures::StreamExt;
use rustdds::{DomainParticipant, DomainParticipantStatusEvent, GUID, QosPolicies, StatusEvented};
use tokio::sync::watch;

use crate::names::ros_type_name;

/// Which end of a topic an endpoint is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Role {
    /// It sends.
    Publisher,
    /// It receives.
    Subscription,
}

impl Role {
    fn peers(self) -> &'static str {
        match self {
            Self::Publisher => "subscriber",
            Self::Subscription => "publisher",
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Publisher => "publisher",
            Self::Subscription => "subscription",
        })
    }
}

/// How many peers an endpoint of the node has.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Match {
    /// Which end of the topic the endpoint is.
    pub role: Role,
    /// The topic, by its absolute name.
    pub topic: String,
    /// How many peers it exchanges messages with.
    pub peers: usize,
}

/// One of the node's own endpoints.
#[derive(Debug)]
struct Endpoint {
    role: Role,
    topic: String,
    dds_type: String,
    peers: BTreeSet<GUID>,
    /// Peers that carry another type under the same name.
    foreign: BTreeSet<GUID>,
}

/// The node's endpoints and their peers.
#[derive(Clone, Debug)]
pub(crate) struct Graph {
    endpoints: Arc<Mutex<BTreeMap<GUID, Endpoint>>>,
    changes: Arc<watch::Sender<u64>>,
}

impl Graph {
    pub(crate) fn new() -> Self {
        Self { endpoints: Arc::default(), changes: Arc::new(watch::Sender::new(0)) }
    }

    /// Creates an endpoint and enters it, so that no match can be seen before it is known.
    pub(crate) fn enter<E, F>(
        &self,
        role: Role,
        topic: &str,
        dds_type: &str,
        create: impl FnOnce() -> Result<(GUID, E), F>,
    ) -> Result<(GUID, E), F> {
        let mut endpoints = self.lock();
        let (guid, endpoint) = create()?;
        let entry = Endpoint {
            role,
            topic: topic.to_owned(),
            dds_type: dds_type.to_owned(),
            peers: BTreeSet::new(),
            foreign: BTreeSet::new(),
        };
        endpoints.insert(guid, entry);
        drop(endpoints);
        self.tell();
        Ok((guid, endpoint))
    }

    pub(crate) fn leave(&self, guid: GUID) {
        self.lock().remove(&guid);
        self.tell();
    }

    /// How many endpoints are open.
    pub(crate) fn open_endpoints(&self) -> usize {
        self.lock().len()
    }

    pub(crate) fn peers(&self, guid: GUID) -> usize {
        self.lock().get(&guid).map_or(0, |endpoint| endpoint.peers.len())
    }

    /// Whether `peer` sends another type than the endpoint reads.
    pub(crate) fn is_foreign(&self, guid: GUID, peer: GUID) -> bool {
        self.lock().get(&guid).is_some_and(|endpoint| endpoint.foreign.contains(&peer))
    }

    /// Every endpoint with its number of peers, by role and topic.
    pub(crate) fn matches(&self) -> Vec<Match> {
        let mut matches: Vec<_> = self
            .lock()
            .values()
            .map(|endpoint| Match {
                role: endpoint.role,
                topic: endpoint.topic.clone(),
                peers: endpoint.peers.len(),
            })
            .collect();
        matches.sort_by(|a, b| (a.role, &a.topic).cmp(&(b.role, &b.topic)));
        matches
    }

    /// Counts the changes; a receiver that waits for the next one misses none.
    pub(crate) fn changes(&self) -> watch::Receiver<u64> {
        self.changes.subscribe()
    }

    /// Waits until the endpoint has at least `least` peers.
    pub(crate) async fn wait_for_peers(&self, guid: GUID, least: usize) {
        let mut changes = self.changes();
        while self.peers(guid) < least {
            // The sender lives in `self`, so the channel cannot close under the wait.
            let _ = changes.changed().await;
        }
    }

    /// Follows the participant's events until `stop` resolves.
    pub(crate) async fn follow(
        self,
        participant: DomainParticipant,
        stop: impl Future<Output = ()>,
    ) {
        let listener = participant.status_listener();
        let events = listener.as_async_status_stream();
        futures::pin_mut!(events);
        futures::pin_mut!(stop);
        loop {
            tokio::select! {
                () = &mut stop => return,
                event = events.next() => match event {
                    Some(event) => self.take(&event, &participant),
                    None => return,
                },
            }
        }
    }

    fn take(&self, event: &DomainParticipantStatusEvent, participant: &DomainParticipant) {
        use DomainParticipantStatusEvent as Event;
        match event {
            Event::RemoteReaderMatched { local_writer, remote_reader } => {
                let peer_type = participant
                    .discovered_readers()
                    .into_iter()
                    .find(|reader| reader.subscription_topic_data.key() == *remote_reader)
                    .map(|reader| reader.subscription_topic_data.type_name().clone());
                self.matched(*local_writer, *remote_reader, peer_type);
            }
            Event::RemoteWriterMatched { local_reader, remote_writer } => {
                let peer_type = participant
                    .discovered_writers()
                    .into_iter()
                    .find(|writer| writer.publication_topic_data.key == *remote_writer)
                    .map(|writer| writer.publication_topic_data.type_name);
                self.matched(*local_reader, *remote_writer, peer_type);
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                self.lost(|peer| peer == guid);
            }
            Event::ParticipantLost { id, .. } => self.lost(|peer| peer.prefix == *id),
            Event::RemoteReaderQosIncompatible {
                local_writer, requested_qos, offered_qos, ..
            } => {
                self.incompatible(*local_writer, offered_qos, requested_qos);
            }
            Event::RemoteWriterQosIncompatible {
                local_reader, requested_qos, offered_qos, ..
            } => {
                self.incompatible(*local_reader, offered_qos, requested_qos);
            }
            _ => {}
        }
    }

    fn matched(&self, own: GUID, peer: GUID, peer_type: Option<String>) {
        let mut endpoints = self.lock();
        let Some(endpoint) = endpoints.get_mut(&own) else { return };
        match peer_type {
            Some(other) if other != endpoint.dds_type => {
                endpoint.foreign.insert(peer);
                tracing::error!(
                    "{}: a {} there has the type {}, this node's {} has {}; they do not talk to each \
                     other, remap one of them",
                    endpoint.topic,
                    endpoint.role.peers(),
                    ros_type_name(&other),
                    endpoint.role,
                    ros_type_name(&endpoint.dds_type),
                );
            }
            _ => {
                endpoint.peers.insert(peer);
                tracing::debug!(
                    "{}: {} {}(s)",
                    endpoint.topic,
                    endpoint.peers.len(),
                    endpoint.role.peers()
                );
            }
        }
        drop(endpoints);
        self.tell();
    }

    fn lost(&self, is_lost: impl Fn(&GUID) -> bool) {
        for endpoint in self.lock().values_mut() {
            endpoint.peers.retain(|peer| !is_lost(peer));
            endpoint.foreign.retain(|peer| !is_lost(peer));
        }
        self.tell();
    }

    fn incompatible(&self, own: GUID, offered: &QosPolicies, requested: &QosPolicies) {
        let endpoints = self.lock();
        let Some(endpoint) = endpoints.get(&own) else { return };
        let policy = offered
            .compliance_failure_wrt(requested)
            .map_or_else(|| "one policy".to_owned(), |policy| format!("{policy:?}"));
        tracing::warn!(
            "{}: a {} there does not fit in its quality of service ({policy}: offered {}, requested \
             {}); make the publisher offer more or the subscriber ask for less",
            endpoint.topic,
            endpoint.role.peers(),
            in_words(offered),
            in_words(requested),
        );
    }

    fn tell(&self) {
        self.changes.send_modify(|count| *count += 1);
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<GUID, Endpoint>> {
        self.endpoints.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn in_words(qos: &QosPolicies) -> String {
    let reliability = if qos.is_reliable() { "reliable" } else { "best effort" };
    let durability = match qos.durability() {
        None | Some(rustdds::policy::Durability::Volatile) => "volatile",
        Some(_) => "transient local",
    };
    format!("{reliability} and {durability}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guid(number: u8) -> GUID {
        GUID::from_bytes([number; 16])
    }

    fn with_subscription() -> Graph {
        let graph = Graph::new();
        graph
            .enter(Role::Subscription, "/scan", "a::msg::dds_::Scan_", || {
                Ok::<_, std::convert::Infallible>((guid(1), ()))
            })
            .unwrap();
        graph
    }

    #[test]
    fn peers_come_and_go() {
        let graph = with_subscription();
        let type_name = Some("a::msg::dds_::Scan_".to_owned());
        graph.matched(guid(1), guid(2), type_name.clone());
        graph.matched(guid(1), guid(2), type_name.clone());
        graph.matched(guid(1), guid(3), None);
        graph.matched(guid(9), guid(3), type_name);
        assert_eq!(graph.peers(guid(1)), 2);
        graph.lost(|peer| *peer == guid(2));
        assert_eq!(graph.peers(guid(1)), 1);
        graph.leave(guid(1));
        assert_eq!(graph.peers(guid(1)), 0);
        assert_eq!(graph.open_endpoints(), 0);
    }

    #[test]
    fn a_peer_of_another_type_is_none() {
        let graph = with_subscription();
        graph.matched(guid(1), guid(2), Some("a::msg::dds_::Other_".to_owned()));
        assert_eq!(graph.peers(guid(1)), 0);
        assert!(graph.is_foreign(guid(1), guid(2)));
        assert!(!graph.is_foreign(guid(1), guid(3)));
    }

    #[tokio::test]
    async fn waiting_ends_with_the_match() {
        let graph = with_subscription();
        let waiting = graph.clone();
        let task = tokio::spawn(async move { waiting.wait_for_peers(guid(1), 2).await });
        graph.matched(guid(1), guid(2), None);
        graph.matched(guid(1), guid(3), None);
        task.await.unwrap();
        graph.wait_for_peers(guid(1), 1).await;
    }
}
