//! The networks that a participant uses, and how those of the machine have changed since it joined them.
//!
//! RustDDS 0.15.1 looks for addresses once: it announces them with each endpoint, and sends by multicast from sockets that are bound to
//! them. An address that comes later is announced to nobody.

use std::collections::BTreeSet;
use std::fmt;
use std::net::Ipv4Addr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::interfaces::{self, Interface};
use super::{DiscoveryRange, Transport};
use crate::process::shutdown::Shutdown;

/// How often the addresses are looked at. A look takes a millisecond.
const LOOK: Duration = Duration::from_secs(3);

/// An address by which other machines may be reached.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Address {
    interface: String,
    index: u32,
    address: Ipv4Addr,
}

impl fmt::Display for Address {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} ({})", self.interface, self.address)
    }
}

impl Transport {
    /// The addresses by which a node on it would reach other machines, of those that there are.
    fn addresses(&self, present: &[Interface]) -> BTreeSet<Address> {
        let is_meant = |one: &Interface, address: Ipv4Addr| {
            let mut names = self.interfaces.iter();
            names.len() == 0 || names.any(|name| one.is_meant(address, name))
        };
        let of_one = |one: &Interface| {
            let (interface, index) = (one.name.clone(), one.index);
            let meant = one.addresses.iter().copied().filter(|address| is_meant(one, *address));
            let leading_out = meant.filter(|address| !address.is_loopback());
            let place = |address| Address { interface: interface.clone(), index, address };
            leading_out.map(place).collect::<Vec<_>>()
        };
        present.iter().flat_map(of_one).collect()
    }

    /// Whether a node on it reaches other machines by addresses of this one: not on the loopback alone, nor on Zenoh, whose session
    /// connects anew.
    fn follows_addresses(&self, present: &[Interface]) -> bool {
        let may_look_out = match self.range {
            DiscoveryRange::Subnet => true,
            DiscoveryRange::Localhost => !self.static_peers.is_empty(),
            DiscoveryRange::Off => false,
        };
        let is_loopback_only = self.plan(present).is_ok_and(|plan| plan.is_loopback_only());
        !self.is_zenoh() && may_look_out && !is_loopback_only
    }

    /// Whether it looks for nodes of other machines, and no address leads to them.
    pub(super) fn looks_out_in_vain(&self, present: &[Interface]) -> bool {
        self.follows_addresses(present) && self.addresses(present).is_empty()
    }
}

/// How the machine's networks differ from those that the process has joined.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct NetworkChange {
    gone: Vec<Address>,
    new: Vec<Address>,
}

impl NetworkChange {
    fn between(joined: &BTreeSet<Address>, now: &BTreeSet<Address>) -> Self {
        let without = |some: &BTreeSet<Address>, others| some.difference(others).cloned().collect();
        Self { gone: without(joined, now), new: without(now, joined) }
    }

    /// Whether the networks are those of the start.
    pub(crate) fn is_none(&self) -> bool {
        self.gone.is_empty() && self.new.is_empty()
    }

    /// Whether there is an address that is not used.
    pub(crate) fn has_new(&self) -> bool {
        !self.new.is_empty()
    }

    /// Whether an address that is used has gone.
    pub(crate) fn has_gone(&self) -> bool {
        !self.gone.is_empty()
    }
}

#[cfg(test)]
impl NetworkChange {
    /// Of addresses of one interface.
    pub(crate) fn of(gone: &[&str], new: &[&str]) -> Self {
        let one = |text: &&str| {
            let interface = "wlan0".to_owned();
            Address { interface, index: 2, address: text.parse().unwrap() }
        };
        Self { gone: gone.iter().map(one).collect(), new: new.iter().map(one).collect() }
    }
}

impl fmt::Display for NetworkChange {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list =
            |some: &[Address]| some.iter().map(Address::to_string).collect::<Vec<_>>().join(", ");
        let gone = self.has_gone().then(|| format!("{} has gone", list(&self.gone)));
        let new = self.has_new().then(|| {
            format!("{} has come, and is used from the next start of the node on", list(&self.new))
        });
        let parts: Vec<String> = gone.into_iter().chain(new).collect();
        write!(formatter, "the network has changed: {}", parts.join("; "))
    }
}

/// Compares the machine's networks with those that the process has joined. Clones share what is found.
#[derive(Clone, Debug, Default)]
pub(crate) struct NetworkWatch(Arc<Mutex<NetworkChange>>);

impl NetworkWatch {
    /// Looks until the process ends, and says what has changed. To be started before the process joins.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(crate) fn start(transport: &Transport, shutdown: &Shutdown) -> std::io::Result<Self> {
        let watch = Self::default();
        let present = interfaces::of_this_machine();
        if !transport.follows_addresses(&present) {
            return Ok(watch);
        }
        let joined = transport.addresses(&present);
        let (transport, shutdown) = (transport.clone(), shutdown.downgrade());
        let found = watch.clone();
        let body = move || {
            loop {
                std::thread::sleep(LOOK);
                if shutdown.upgrade().is_none_or(|shutdown| shutdown.is_triggered()) {
                    return;
                }
                let now = transport.addresses(&interfaces::of_this_machine());
                found.note(NetworkChange::between(&joined, &now));
            }
        };
        std::thread::Builder::new().name("network watch".to_owned()).spawn(body)?;
        Ok(watch)
    }

    fn note(&self, change: NetworkChange) {
        let mut last = self.lock();
        if *last == change {
            return;
        }
        if change.is_none() {
            tracing::info!("the network is again as it was at the start");
        } else {
            tracing::warn!("{change}");
        }
        *last = change;
    }

    /// How the networks differ now.
    pub(crate) fn change(&self) -> NetworkChange {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, NetworkChange> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;
