//! The peers at the other end: those that match the node's publishers and subscriptions, in the same process
//! and outside of it.
//!
//! This takes the place of the client library's own event loop, which keeps the incompatible offers to
//! itself, takes `/clock` for a topic of another type, and does not compare types at all: the DDS
//! library matches by the topic's name alone, so that a foreign message would be decoded as ours.

mod broken;
mod clients;
pub(crate) mod exchange;
mod follow;
#[cfg(feature = "zenoh")]
mod follow_tokens;
pub(crate) mod inbox;
mod names;
mod open_endpoint;
mod servers;
pub(crate) mod siblings;
pub(crate) mod survey;
mod trouble;
pub(crate) mod value;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use rustdds::{GUID, QosPolicies};
use tokio::sync::watch;

use crate::graph::exchange::{EndpointId, Exchange};
use crate::graph::siblings::Siblings;
use crate::settings::names::{dds_request_topic_name, dds_response_topic_name};
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::keys::{Token, UNKNOWN_HASH};
use broken::Broken;
pub(crate) use broken::{Prefix, Renew};
pub(crate) use clients::Client;
use clients::Clients;
use names::NodeNames;
pub(crate) use names::announced as announced_names;
pub(crate) use open_endpoint::OpenEndpoint;
use servers::Servers;
use trouble::End;
pub(crate) use trouble::{Trouble, TroubleKind};

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
struct Endpoint {
    role: Role,
    topic: String,
    dds_type: String,
    /// The hash of its type's definition.
    #[cfg(feature = "zenoh")]
    hash: String,
    /// Its name on the network; none where the host is on none.
    guid: Option<GUID>,
    /// Its peers on the network, those of this host among them.
    peers: BTreeSet<GUID>,
    /// Peers that do not fit.
    misfits: BTreeMap<GUID, Misfit>,
    /// Creates it again on the network.
    renewal: Option<Weak<dyn Renew>>,
}

/// Why a peer does not fit.
#[derive(Clone, Debug)]
enum Misfit {
    OtherType(String),
    /// On Zenoh, where types have the hashes of their definitions.
    #[cfg(feature = "zenoh")]
    OtherDefinition {
        /// Whether the peer says which.
        is_known: bool,
    },
    Incompatible {
        offered: Box<QosPolicies>,
        requested: Box<QosPolicies>,
    },
}

impl Endpoint {
    fn trouble(&self, who: &str, misfit: &Misfit) -> Trouble {
        let end = End { role: self.role, topic: &self.topic, dds_type: &self.dds_type };
        match misfit {
            Misfit::OtherType(other) => end.other_type(who, other),
            #[cfg(feature = "zenoh")]
            Misfit::OtherDefinition { is_known } => end.other_definition(who, *is_known),
            Misfit::Incompatible { offered, requested } => {
                end.incompatible(who, offered, requested)
            }
        }
    }
}

/// The node's endpoints and their peers.
#[derive(Clone)]
pub(crate) struct Graph {
    endpoints: Arc<Mutex<BTreeMap<EndpointId, Endpoint>>>,
    names: Arc<Mutex<NodeNames>>,
    clients: Arc<Mutex<Clients>>,
    servers: Arc<Mutex<Servers>>,
    broken: Arc<Mutex<Broken>>,
    /// What other processes have on Zenoh.
    #[cfg(feature = "zenoh")]
    tokens: Arc<Mutex<BTreeMap<String, Token>>>,
    exchange: Arc<Exchange>,
    siblings: Siblings,
}

impl Graph {
    pub(crate) fn new(exchange: Arc<Exchange>, siblings: Siblings) -> Self {
        Self {
            endpoints: Arc::default(),
            names: Arc::default(),
            clients: Arc::default(),
            servers: Arc::default(),
            broken: Arc::default(),
            #[cfg(feature = "zenoh")]
            tokens: Arc::default(),
            exchange,
            siblings,
        }
    }

    /// Creates what an endpoint has on the network and enters it, so that no match can be seen before it
    /// is known. `id` is its place in the exchange.
    pub(crate) fn enter<E, F>(
        &self,
        id: EndpointId,
        (role, topic, dds_type): (Role, &str, &str),
        create: impl FnOnce() -> Result<Option<(GUID, E)>, F>,
    ) -> Result<Option<E>, F> {
        let mut endpoints = self.lock();
        let (guid, endpoint) = create()?.unzip();
        let entry = Endpoint {
            role,
            topic: topic.to_owned(),
            dds_type: dds_type.to_owned(),
            #[cfg(feature = "zenoh")]
            hash: UNKNOWN_HASH.to_owned(),
            guid,
            peers: BTreeSet::new(),
            misfits: BTreeMap::new(),
            renewal: None,
        };
        endpoints.insert(id, entry);
        drop(endpoints);
        self.exchange.notify();
        Ok(endpoint)
    }

    /// Gives an endpoint another name on the network; its peers have to discover it again.
    pub(crate) fn renew<E, F>(
        &self,
        id: EndpointId,
        create: impl FnOnce() -> Result<(GUID, E), F>,
    ) -> Result<E, F> {
        let mut endpoints = self.lock();
        let (guid, created) = create()?;
        if let Some(endpoint) = endpoints.get_mut(&id) {
            endpoint.guid = Some(guid);
            endpoint.peers.clear();
            endpoint.misfits.clear();
        }
        drop(endpoints);
        self.exchange.notify();
        Ok(created)
    }

    /// States the hash of the definition of an endpoint's type, and matches it with what other processes have.
    #[cfg(feature = "zenoh")]
    pub(crate) fn enter_hash(&self, id: EndpointId, hash: &str) {
        if let Some(endpoint) = self.lock().get_mut(&id) {
            hash.clone_into(&mut endpoint.hash);
        }
        self.match_tokens(id);
    }

    /// From now on `renewal` is called to create the endpoint again where a link was down for too long.
    pub(crate) fn renew_with(&self, id: EndpointId, renewal: Weak<dyn Renew>) {
        if let Some(endpoint) = self.lock().get_mut(&id) {
            endpoint.renewal = Some(renewal);
        }
    }

    pub(crate) fn leave(&self, id: EndpointId) {
        self.lock().remove(&id);
        self.exchange.leave(id);
    }

    /// How many endpoints are open.
    pub(crate) fn open_endpoints(&self) -> usize {
        self.lock().len()
    }

    /// How many peers an endpoint has, in this host and outside.
    pub(crate) fn peers(&self, id: EndpointId) -> usize {
        self.exchange.counterparts(id) + self.outside_peers(id)
    }

    /// How many peers an endpoint has outside of this host.
    pub(crate) fn outside_peers(&self, id: EndpointId) -> usize {
        self.lock().get(&id).map_or(0, |endpoint| self.outside(endpoint))
    }

    /// Whether `peer` sends another type than the endpoint reads.
    pub(crate) fn is_foreign(&self, id: EndpointId, peer: GUID) -> bool {
        self.lock()
            .get(&id)
            .is_some_and(|one| matches!(one.misfits.get(&peer), Some(Misfit::OtherType(_))))
    }

    /// The peers that do not fit, as long as they are there; by topic.
    pub(crate) fn troubles(&self) -> Vec<Trouble> {
        let names = self.lock_names();
        let mut troubles: Vec<_> = self
            .lock()
            .values()
            .flat_map(|endpoint| {
                let trouble =
                    |(peer, misfit): (&GUID, _)| endpoint.trouble(&names.of(*peer), misfit);
                endpoint.misfits.iter().map(trouble).collect::<Vec<_>>()
            })
            .collect();
        troubles.sort_by(|a, b| (a.kind, &a.topic, &a.text).cmp(&(b.kind, &b.topic, &b.text)));
        troubles.dedup();
        troubles
    }

    /// Whether an endpoint's participant announced itself in the form of a ROS 2 before Iron.
    pub(crate) fn is_before_iron(&self, endpoint: GUID) -> bool {
        self.lock_names().announces_none(endpoint)
    }

    /// The node that an endpoint of a peer belongs to, where that is known.
    pub(crate) fn node_of(&self, endpoint: GUID) -> Option<String> {
        self.lock_names().node_of(endpoint)
    }

    /// Every endpoint with its number of peers, by role and topic.
    pub(crate) fn matches(&self) -> Vec<Match> {
        let mut matches: Vec<_> = self
            .lock()
            .iter()
            .map(|(id, endpoint)| Match {
                role: endpoint.role,
                topic: endpoint.topic.clone(),
                peers: self.exchange.counterparts(*id) + self.outside(endpoint),
            })
            .collect();
        matches.sort_by(|a, b| (a.role, &a.topic).cmp(&(b.role, &b.topic)));
        matches
    }

    /// Counts the changes; a receiver that waits for the next one misses none.
    pub(crate) fn changes(&self) -> watch::Receiver<u64> {
        self.exchange.changes()
    }

    /// Waits until the endpoint has at least `least` peers.
    pub(crate) async fn wait_for_peers(&self, id: EndpointId, least: usize) {
        let mut changes = self.changes();
        while self.peers(id) < least {
            // The exchange holds the sender, so the channel cannot close under the wait.
            let _ = changes.changed().await;
        }
    }

    /// Waits until a client that asks the service `name` can hear the response; returns its participant's readers of responses.
    pub(crate) async fn wait_for_client(&self, name: &str, client: Client) -> BTreeSet<GUID> {
        let mut changes = self.changes();
        loop {
            if let Some(readers) = self.readers_of_client(name, client) {
                return readers;
            }
            // The exchange holds the sender, so the channel cannot close under the wait.
            let _ = changes.changed().await;
        }
    }

    /// The readers by which the participant of a client that asks the service `name` hears the response; `None` while it does not.
    pub(crate) fn readers_of_client(&self, name: &str, client: Client) -> Option<BTreeSet<GUID>> {
        let topics = (dds_request_topic_name(name), dds_response_topic_name(name));
        self.lock_clients().readers_of((&topics.0, &topics.1), client)
    }

    /// Waits until the service `name` has a server that can hear and answer.
    pub(crate) async fn wait_for_server(&self, name: &str) {
        let topics = (dds_request_topic_name(name), dds_response_topic_name(name));
        let mut changes = self.changes();
        while !self.lock_servers().has((&topics.0, &topics.1)) {
            // The exchange holds the sender, so the channel cannot close under the wait.
            let _ = changes.changed().await;
        }
    }

    /// Leaves those that are readers of clients.
    pub(crate) fn retain_clients(&self, readers: &mut BTreeSet<GUID>) {
        let clients = self.lock_clients();
        readers.retain(|reader| clients.has_reader(*reader));
    }

    fn outside(&self, endpoint: &Endpoint) -> usize {
        endpoint.peers.iter().filter(|peer| !self.siblings.contain(**peer)).count()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<EndpointId, Endpoint>> {
        self.endpoints.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock_clients(&self) -> MutexGuard<'_, Clients> {
        self.clients.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock_servers(&self) -> MutexGuard<'_, Servers> {
        self.servers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock_broken(&self) -> MutexGuard<'_, Broken> {
        self.broken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    #[cfg(feature = "zenoh")]
    fn lock_tokens(&self) -> MutexGuard<'_, BTreeMap<String, Token>> {
        self.tokens.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock_names(&self) -> MutexGuard<'_, NodeNames> {
        self.names.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;
