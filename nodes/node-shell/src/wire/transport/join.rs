//! Joining the network: the participant with its sockets, its announcer and its health.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::{Arc, Mutex, PoisonError};

use rustdds::{DomainParticipant, DomainParticipantBuilder, RTPSEntity};

use super::announcement::Participant;
use super::announcer::{Announcer, Audience};
use super::backlog::BacklogWatch;
use super::buffer::GrantedBuffer;
use super::health::ReceiveHealth;
use super::interfaces::{self, Interface};
use super::library_threads::LibraryThreads;
use super::multicast_bar::MulticastBar;
use super::receiving::Receiving;
use super::{DiscoveryRange, MULTICAST_GROUP, Transport, TransportError, ports, sockets};
use crate::wire::error::ShellError;

/// How often a participant is opened when the multicast ports are taken.
const MULTICAST_ATTEMPTS: usize = 3;

/// Held while a participant is opened.
static JOINING: Mutex<()> = Mutex::new(());

/// One participant on the network.
pub struct Joined {
    // The announcer says farewell, so it goes first.
    /// Makes the participant known beyond what the DDS library does; `None` where no other participant is to
    /// know of it.
    pub announcer: Option<Announcer>,
    /// The participant.
    pub participant: DomainParticipant,
    /// The receive buffer that the kernel grants.
    pub granted: GrantedBuffer,
    /// How well the participant receives.
    pub health: Arc<ReceiveHealth>,
    /// Keeps the participant from reading for ever; `None` where its sockets are not available.
    pub backlog: Option<BacklogWatch>,
    /// The threads by which the library serves the participant.
    pub(crate) threads: LibraryThreads,
}

/// The settings as applied to this machine.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Plan {
    /// The addresses to use; `None` means all.
    networks: Option<Vec<Ipv4Addr>>,
    /// Whether to announce by multicast.
    multicast: bool,
    /// Whether to offer peers to send by multicast. Such a peer is sent to by multicast alone, so this is
    /// not for networks that may not carry it, as those are for which somebody lists static peers.
    offers_multicast: bool,
    this_machine: bool,
    static_peers: bool,
}

impl Plan {
    pub(super) fn is_loopback_only(&self) -> bool {
        self.networks.as_ref().is_some_and(|all| all.iter().all(Ipv4Addr::is_loopback))
    }

    /// Whether the participant can hear multicast.
    fn multicast_possible(&self, present: &[Interface]) -> bool {
        present.iter().any(|one| one.multicast && one.addresses.iter().any(|a| self.uses(*a)))
    }

    /// The addresses from which to announce by multicast.
    fn multicast_from(&self, present: &[Interface]) -> Vec<Ipv4Addr> {
        present
            .iter()
            .filter(|one| self.multicast && one.multicast)
            .flat_map(|one| one.addresses.iter().copied())
            .filter(|address| self.uses(*address))
            .collect()
    }

    /// The announcement of the participant; `None` when it is not announced.
    fn announced(
        &self,
        participant: &DomainParticipant,
        present: &[Interface],
        multicast_offered: bool,
    ) -> Option<Participant> {
        if !self.this_machine && !self.static_peers {
            return None;
        }
        let (domain, number) = (participant.domain_id(), participant.participant_id());
        let (discovery, data) =
            (ports::discovery_unicast(domain, number)?, ports::data_unicast(domain, number)?);
        let addresses: Vec<_> = present
            .iter()
            .flat_map(|one| one.addresses.iter().copied())
            .filter(|address| self.uses(*address))
            .collect();
        let at = |port| addresses.iter().map(|one| SocketAddrV4::new(*one, port)).collect();
        let group = |port| {
            let address = SocketAddrV4::new(MULTICAST_GROUP, port);
            if multicast_offered { vec![address] } else { Vec::new() }
        };
        Some(Participant {
            guid: participant.guid().to_bytes(),
            discovery_unicast: at(discovery),
            discovery_multicast: group(ports::discovery_multicast(domain)),
            data_unicast: at(data),
            data_multicast: group(ports::data_multicast(domain)),
        })
    }

    pub(super) fn uses(&self, address: Ipv4Addr) -> bool {
        self.networks.as_ref().is_none_or(|networks| networks.contains(&address))
    }
}

impl Transport {
    /// Joins the network.
    ///
    /// # Errors
    /// When an interface is not there, or the library refuses.
    pub fn join(&self) -> Result<Joined, ShellError> {
        Ok(self.join_announcing()?.0)
    }

    /// Joins the network; returns what is announced, too.
    pub(super) fn join_announcing(&self) -> Result<(Joined, Option<Participant>), ShellError> {
        let present = interfaces::of_this_machine();
        let plan = self.plan(&present)?;
        // One after the other, so that each participant's sockets and threads are known for its own.
        let joining = JOINING.lock().unwrap_or_else(PoisonError::into_inner);
        // Participants of one process share the multicast ports, though not their sockets.
        let before = sockets::own().unwrap_or_default();
        let threads_before = LibraryThreads::present();
        let (participant, multicast_offered) = self.participant(&plan, &present, &before)?;
        let number = participant.participant_id();
        let loopback = present.iter().find(|one| one.is_loopback() && plan.is_loopback_only());
        let Receiving { granted, inodes, numbers, backlog, filter } =
            self.receiving(number, &before, loopback);
        let threads = LibraryThreads::since(&threads_before, &numbers);
        drop(joining);
        let announced = plan.announced(&participant, &present, multicast_offered);
        let announcer = announced.as_ref().and_then(|announced| {
            let multicast_from = plan.multicast_from(&present);
            self.announcer(announced, (number, multicast_from), &plan)
        });
        let health = Arc::new(ReceiveHealth::new(granted, inodes, filter));
        Ok((Joined { announcer, participant, granted, health, backlog, threads }, announced))
    }

    /// The participant, and whether it offers multicast.
    fn participant(
        &self,
        plan: &Plan,
        present: &[Interface],
        before: &BTreeMap<u64, i32>,
    ) -> Result<(DomainParticipant, bool), ShellError> {
        let possible = plan.multicast_possible(present);
        let bar = if plan.offers_multicast || !possible { None } else { self.bar_multicast() };
        let offered = possible && bar.is_none();
        let mut participant = self.build(plan)?;
        for _ in 1..MULTICAST_ATTEMPTS {
            if !offered || self.receives_multicast(before) {
                break;
            }
            // Another process has just barred the ports for itself.
            drop(participant);
            participant = self.build(plan)?;
        }
        drop(bar);
        let offered = offered && self.receives_multicast(before);
        Ok((participant, offered))
    }

    fn build(&self, plan: &Plan) -> Result<DomainParticipant, ShellError> {
        let mut builder = DomainParticipantBuilder::new(self.domain_id)
            .socket_receive_buffer_size(self.receive_buffer)
            .same_host_loopback(plan.this_machine);
        if let Some(networks) = &plan.networks {
            builder = builder.with_only_networks(networks.iter().copied());
        }
        builder.build().map_err(|error| ShellError::Join {
            transport: self.to_string(),
            reason: error.to_string(),
        })
    }

    /// Whether this process has opened a socket for multicast since `before`; taken for granted where the
    /// kernel does not list sockets.
    fn receives_multicast(&self, before: &BTreeMap<u64, i32>) -> bool {
        let port = [ports::discovery_multicast(self.domain_id)];
        sockets::own_at(&port, before).is_ok_and(|found| !found.is_empty())
            || sockets::list().is_err()
    }

    pub(super) fn plan(&self, present: &[Interface]) -> Result<Plan, TransportError> {
        let chosen = interfaces::choose(&self.interfaces, present)?;
        let with_loopback = || {
            // Processes of one machine talk over the loopback, whatever else they use.
            let mut networks = chosen.clone();
            if !networks.contains(&Ipv4Addr::LOCALHOST) {
                networks.insert(0, Ipv4Addr::LOCALHOST);
            }
            networks
        };
        let chosen_networks = (!chosen.is_empty()).then(with_loopback);
        let static_peers = !self.static_peers.is_empty();
        Ok(match self.range {
            DiscoveryRange::Subnet => Plan {
                networks: chosen_networks,
                multicast: true,
                offers_multicast: !static_peers,
                this_machine: true,
                static_peers,
            },
            DiscoveryRange::Localhost => Plan {
                networks: if static_peers {
                    chosen_networks
                } else {
                    Some(vec![Ipv4Addr::LOCALHOST])
                },
                multicast: false,
                offers_multicast: false,
                this_machine: true,
                static_peers,
            },
            DiscoveryRange::Off => Plan {
                networks: Some(Vec::new()),
                multicast: false,
                offers_multicast: false,
                this_machine: false,
                static_peers: false,
            },
        })
    }

    fn bar_multicast(&self) -> Option<MulticastBar> {
        MulticastBar::raise(self.domain_id)
            .inspect_err(|error| {
                tracing::warn!(
                    "multicast could not be switched off ({error}): peers that the network's \
                     multicast does not reach will hear nothing from this node"
                );
            })
            .ok()
    }

    fn announcer(
        &self,
        announced: &Participant,
        (number, multicast_from): (u16, Vec<Ipv4Addr>),
        plan: &Plan,
    ) -> Option<Announcer> {
        let audience = Audience {
            domain: self.domain_id,
            own_number: number,
            this_machine: plan.this_machine,
            listens: plan.multicast && !plan.offers_multicast && !multicast_from.is_empty(),
            multicast_from,
            peers: if plan.static_peers { self.static_peers.clone() } else { Vec::new() },
        };
        Announcer::start(announced.clone(), audience)
            .inspect_err(|error| {
                tracing::warn!(
                    "the node announces itself by multicast alone ({error}): static peers, and more \
                     than 12 nodes on this machine, may not be found"
                );
            })
            .ok()
    }
}

#[cfg(test)]
mod tests;
