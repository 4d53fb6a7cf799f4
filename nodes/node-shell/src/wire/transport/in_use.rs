//! Which network interfaces a transport uses, for diagnostics.

use std::fmt;
use std::net::Ipv4Addr;

use super::interfaces::Interface;
use super::{DiscoveryRange, GrantedBuffer, Transport, TransportError, interfaces};
use crate::wire::error::ShellError;

/// A network interface that a transport uses.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct InterfaceInUse {
    /// Its name, as `eth0`.
    pub name: String,
    /// Those of its addresses that are used.
    pub addresses: Vec<Ipv4Addr>,
    /// Whether it carries multicast.
    pub multicast: bool,
    /// The largest datagram that it carries in one piece, where the system reports it.
    pub mtu_bytes: Option<u32>,
}

impl InterfaceInUse {
    /// Whether it leads to this machine alone.
    #[must_use]
    pub fn is_loopback(&self) -> bool {
        self.addresses.iter().all(Ipv4Addr::is_loopback)
    }
}

impl Transport {
    /// The network interfaces that a node on this transport uses.
    ///
    /// # Errors
    /// When an interface that was requested is not there.
    pub fn interfaces_in_use(&self) -> Result<Vec<InterfaceInUse>, TransportError> {
        let present = interfaces::of_this_machine();
        let plan = self.plan(&present)?;
        let mtus: Vec<_> =
            netdev::get_interfaces().into_iter().map(|one| (one.name, one.mtu)).collect();
        let in_use = present.into_iter().filter_map(|one| {
            let addresses: Vec<_> =
                one.addresses.into_iter().filter(|address| plan.uses(*address)).collect();
            let mtu_bytes =
                mtus.iter().find(|(name, _)| *name == one.name).and_then(|(_, mtu)| *mtu);
            (!addresses.is_empty()).then_some(InterfaceInUse {
                name: one.name,
                addresses,
                multicast: one.multicast,
                mtu_bytes,
            })
        });
        Ok(in_use.collect())
    }

    /// It in words, with what there is of the networks that it means.
    pub(crate) fn with_networks(&self) -> TransportNow<'_> {
        TransportNow { transport: self, present: interfaces::of_this_machine() }
    }

    /// Whether other machines are looked for by their names or addresses.
    #[must_use]
    pub fn has_static_peers(&self) -> bool {
        !self.static_peers.is_empty()
    }

    /// The buffer that the kernel would grant a node on this transport; found out without sending anything.
    ///
    /// # Errors
    /// When there are no sockets available.
    pub fn probe_receive_buffer(&self) -> Result<GrantedBuffer, ShellError> {
        let loopback_only = self.plan(&interfaces::of_this_machine())?.is_loopback_only();
        let alone = self.clone().with_range(super::DiscoveryRange::Off);
        let granted = alone.join()?.granted;
        Ok(GrantedBuffer::new(granted.bytes(), granted.asked(), loopback_only))
    }
}

/// A transport, and the interfaces of the machine.
pub(crate) struct TransportNow<'a> {
    transport: &'a Transport,
    present: Vec<Interface>,
}

impl TransportNow<'_> {
    /// Whether a node on it is alone because no interface has an address.
    pub(crate) fn is_cut_off(&self) -> bool {
        self.transport.range() != DiscoveryRange::Off && self.present.is_empty()
    }
}

impl fmt::Display for TransportNow<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.transport.fmt(formatter)?;
        if self.is_cut_off() {
            return formatter
                .write_str(", of which there is none: no interface has an IPv4 address");
        }
        if self.transport.looks_out_in_vain(&self.present) {
            return formatter.write_str(", of which there is this machine's own alone");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use free_domain::FreeDomain;

    use super::*;

    #[test]
    fn a_transport_for_this_machine_uses_the_loopback_alone() {
        let all = Transport::on_domain(3).unwrap();
        let local = all.clone().with_range(DiscoveryRange::Localhost);
        let names = |transport: &Transport| -> Vec<_> {
            transport.interfaces_in_use().unwrap().into_iter().map(|one| one.name).collect()
        };
        let loopback = local.interfaces_in_use().unwrap();
        assert!(loopback.len() == 1 && loopback[0].is_loopback(), "{loopback:?}");
        assert_eq!(loopback[0].addresses, [Ipv4Addr::LOCALHOST]);
        assert!(names(&all).starts_with(&names(&local)) || names(&all).len() > 1);
        assert!(names(&all.with_range(DiscoveryRange::Off)).is_empty());
    }

    /// Regression: nodes that hear nobody said "all networks".
    #[test]
    fn a_machine_without_networks_is_said_to_have_none() {
        let words = |transport: &Transport, present: Vec<Interface>| {
            TransportNow { transport, present }.to_string()
        };
        let interface = |name: &str, address: [u8; 4]| Interface {
            name: name.to_owned(),
            index: 1,
            addresses: vec![address.into()],
            multicast: true,
        };
        let (lo, eth) = (interface("lo", [127, 0, 0, 1]), interface("eth0", [10, 0, 0, 2]));
        let all = Transport::on_domain(3).unwrap();
        assert_eq!(words(&all, vec![lo.clone(), eth]), "domain 3, all networks");
        assert_eq!(
            words(&all, vec![lo.clone()]),
            "domain 3, all networks, of which there is this machine's own alone"
        );
        let none = words(&all, vec![]);
        assert!(
            none.ends_with("of which there is none: no interface has an IPv4 address"),
            "{none}"
        );
        let local = all.loopback_only();
        assert_eq!(words(&local, vec![lo]), "domain 3, this machine only");
        assert!(words(&local, vec![]).contains("no interface has an IPv4 address"));
        let off = local.with_range(DiscoveryRange::Off);
        assert_eq!(words(&off, vec![]), "domain 3, no other process");
    }

    #[test]
    fn an_interface_that_is_not_there_is_an_error() {
        let transport = Transport::on_domain(3).unwrap().with_interfaces(["nowhere0"]);
        assert!(transport.interfaces_in_use().unwrap_err().to_string().contains("nowhere0"));
    }

    #[test]
    fn the_buffer_of_a_probe_is_that_of_a_node() {
        let domain = FreeDomain::new();
        let transport =
            Transport::on_domain(domain.number()).unwrap().with_receive_buffer(128 << 10);
        let probed = transport.probe_receive_buffer().unwrap();
        assert_eq!((probed.bytes(), probed.asked()), (128 << 10, 128 << 10));
        assert_eq!(probed.largest_safe_message(), 128 << 10);
    }
}
