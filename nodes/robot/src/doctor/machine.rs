//! What this machine grants to nodes: buffers, interfaces, ports.

mod kernel;
mod rules;

use std::collections::BTreeSet;
use std::net::Ipv4Addr;

use node_shell::{
    DiscoveryRange, GrantedBuffer, InterfaceInUse, RAISE_RECEIVE_BUFFER, Transport, TransportError,
};

use super::finding::Finding;
pub(crate) use kernel::{KernelDrops, KernelLimits};

/// The command that keeps the raised limit after a restart of the machine.
const KEEP_RECEIVE_BUFFER: &str =
    "sudo cp config/sysctl/60-stillmap.conf /etc/sysctl.d/ && sudo sysctl --system";

/// What a node on this machine is granted.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    pub(crate) domain_id: u16,
    pub(crate) range: DiscoveryRange,
    pub(crate) has_static_peers: bool,
    /// The settings of the environment, in words.
    pub(crate) transport: String,
    pub(crate) interfaces: Vec<InterfaceInUse>,
    /// The addresses of this machine, whether they are used or not.
    pub(crate) own_addresses: BTreeSet<Ipv4Addr>,
    pub(crate) limits: KernelLimits,
}

/// The receive buffer of a node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct ReceiveBuffer {
    pub(crate) granted_bytes: usize,
    pub(crate) asked_bytes: usize,
    /// The size up to which messages arrive complete.
    pub(crate) largest_safe_bytes: usize,
}

impl From<GrantedBuffer> for ReceiveBuffer {
    fn from(granted: GrantedBuffer) -> Self {
        Self {
            granted_bytes: granted.bytes(),
            asked_bytes: granted.asked(),
            largest_safe_bytes: granted.largest_safe_message(),
        }
    }
}

impl ReceiveBuffer {
    /// Of a stream, which carries messages of any size.
    pub(crate) const OF_A_STREAM: Self =
        Self { granted_bytes: usize::MAX, asked_bytes: usize::MAX, largest_safe_bytes: usize::MAX };

    /// The command that makes it larger.
    pub(crate) fn fix(&self) -> String {
        if self.granted_bytes < self.asked_bytes {
            format!(
                "{RAISE_RECEIVE_BUFFER}, then restart the nodes; to keep it: {KEEP_RECEIVE_BUFFER}"
            )
        } else {
            format!(
                "unset STILLMAP_RECEIVE_BUFFER_KIB, which asks for no more than {} KiB",
                self.asked_bytes / 1024
            )
        }
    }
}

impl Machine {
    /// Reads the state of this machine, with the transport that a node would use.
    pub(crate) fn read(transport: &Transport) -> Result<Self, TransportError> {
        let everywhere = Transport::on_domain(transport.domain_id()).unwrap_or(transport.clone());
        let own_addresses = everywhere
            .interfaces_in_use()?
            .into_iter()
            .flat_map(|interface| interface.addresses)
            .collect();
        Ok(Self {
            domain_id: transport.domain_id(),
            range: transport.range(),
            has_static_peers: transport.has_static_peers(),
            transport: transport.to_string(),
            interfaces: transport.interfaces_in_use()?,
            own_addresses,
            limits: KernelLimits::read(),
        })
    }

    /// Whether something at these addresses is on another machine.
    pub(crate) fn is_elsewhere(&self, addresses: &BTreeSet<Ipv4Addr>) -> bool {
        !addresses.is_empty()
            && addresses.iter().all(|one| !one.is_loopback() && !self.own_addresses.contains(one))
    }

    /// The findings about the machine alone.
    pub(crate) fn findings(&self, buffer: &ReceiveBuffer) -> Vec<Finding> {
        let mut findings = vec![rules::transport(self)];
        findings.extend(rules::ports(self));
        findings.extend(rules::interfaces(self));
        findings.extend(rules::receive_buffer(buffer, &self.limits));
        findings
    }
}

pub(crate) use rules::{dropped_meanwhile, fragments, send_buffer};
