//! The rules about the machine.

use std::net::Ipv4Addr;

use node_shell::DiscoveryRange;

use super::{KEEP_RECEIVE_BUFFER, KernelDrops, KernelLimits, Machine, ReceiveBuffer};
use crate::doctor::checks::Check;
use crate::doctor::finding::Finding;
use crate::doctor::sizes::{CLOUD_BYTES, DEPTH_IMAGE_BYTES, PADDED_CLOUD_BYTES, kb, kib};
use node_shell::RAISE_RECEIVE_BUFFER;

/// The first port of domain 0, and how many ports a domain has (RTPS 2.5, 9.6.2.3).
const FIRST_PORT: u32 = 7400;
const PORTS_PER_DOMAIN: u32 = 250;
/// The send buffer that RustDDS requests for a socket.
const WANTED_SEND_BUFFER: u64 = 8 << 20;
/// What DDS vendors recommend for networks that carry large datagrams in fragments: memory for some
/// seconds of clouds, and a short wait for fragments that were lost.
const WANTED_FRAGMENT_MEMORY: u64 = 128 << 20;
const LONGEST_FRAGMENT_WAIT_S: u64 = 3;

/// The transport that the environment selects.
pub(super) fn transport(machine: &Machine) -> Finding {
    Finding::ok(Check::Transport, format!("the environment selects {}", machine.transport))
}

/// A domain cannot always be joined if its ports are in the kernel's ephemeral range.
pub(super) fn ports(machine: &Machine) -> Option<Finding> {
    let (lowest, highest) = machine.limits.ephemeral_ports?;
    let first = FIRST_PORT + PORTS_PER_DOMAIN * u32::from(machine.domain_id);
    let last = first + PORTS_PER_DOMAIN - 1;
    if last < u32::from(lowest) || first > u32::from(highest) {
        return None;
    }
    let safe = (u32::from(lowest).saturating_sub(FIRST_PORT) / PORTS_PER_DOMAIN).saturating_sub(1);
    Some(Finding::warn(
        Check::Ports,
        format!(
            "the ports of domain {}, {first} to {last}, overlap the ephemeral ports of the kernel, \
             {lowest} to {highest}",
            machine.domain_id
        ),
        format!("use a domain from 0 to {safe}: export ROS_DOMAIN_ID={safe}"),
    ))
}

/// The network interfaces on which nodes are discovered.
pub(super) fn interfaces(machine: &Machine) -> Vec<Finding> {
    const CHECK: Check = Check::Interfaces;
    if machine.range == DiscoveryRange::Off {
        return vec![Finding::warn(
            CHECK,
            "nodes discover no other process: ROS_AUTOMATIC_DISCOVERY_RANGE=OFF",
            "export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET",
        )];
    }
    if machine.interfaces.is_empty() {
        return vec![Finding::error(
            CHECK,
            "no interface has an IPv4 address, so nodes find none, not even those of this machine",
            "sudo ip link set lo up, and bring the network up",
        )];
    }
    let described: Vec<_> = machine
        .interfaces
        .iter()
        .map(|one| {
            let addresses: Vec<_> = one.addresses.iter().map(Ipv4Addr::to_string).collect();
            let mtu = one.mtu_bytes.map_or(String::new(), |mtu| format!(", MTU {mtu}"));
            let multicast = if one.multicast { "multicast" } else { "no multicast" };
            format!("{} ({}{mtu}, {multicast})", one.name, addresses.join(", "))
        })
        .collect();
    let mut findings = vec![Finding::ok(CHECK, format!("in use: {}", described.join("; ")))];
    let mut leading_out = machine.interfaces.iter().filter(|one| !one.is_loopback()).peekable();
    let looks_out = machine.range == DiscoveryRange::Subnet && !machine.has_static_peers;
    if looks_out && leading_out.peek().is_none() {
        findings.push(Finding::warn(
            CHECK,
            "no interface in use leads to another machine, so only nodes of this one are found",
            "bring the network up: ip link set IFACE up; or, if that is intended, export \
             ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST",
        ));
    } else if looks_out && !leading_out.any(|one| one.multicast) {
        findings.push(Finding::warn(
            CHECK,
            "no interface that leads to other machines carries multicast, so their nodes are not found",
            "sudo ip link set IFACE multicast on, or name the machines: export ROS_STATIC_PEERS=10.0.0.2",
        ));
    }
    findings
}

/// Whether large messages arrive complete.
pub(super) fn receive_buffer(buffer: &ReceiveBuffer, limits: &KernelLimits) -> Vec<Finding> {
    const CHECK: Check = Check::ReceiveBuffer;
    let safe = buffer.largest_safe_bytes;
    let mut size = kib(buffer.granted_bytes as u64);
    if buffer.granted_bytes < buffer.asked_bytes {
        size = format!("{size} of {} requested", kib(buffer.asked_bytes as u64));
    }
    let lost: Vec<_> = [
        ("raw depth images of 640x480", DEPTH_IMAGE_BYTES),
        ("clouds of 640x480 points", CLOUD_BYTES),
        ("clouds of 640x480 points of 32 bytes", PADDED_CLOUD_BYTES),
    ]
    .into_iter()
    .filter(|(_, bytes)| *bytes > safe)
    .map(|(name, bytes)| format!("{name} ({})", kb(bytes)))
    .collect();
    let mut findings = vec![if lost.is_empty() {
        Finding::ok(
            CHECK,
            format!("the receive buffer is {size}: messages up to {} arrive complete", kb(safe)),
        )
    } else {
        let what = format!(
            "the receive buffer is {size}: most messages above {} are lost between processes, for example {}",
            kb(safe),
            lost.join(", ")
        );
        let mut fix = buffer.fix();
        if safe < DEPTH_IMAGE_BYTES {
            fix += "; meanwhile compressed depth still arrives: -p input:=compressed_depth";
        }
        Finding::grave_if(safe < DEPTH_IMAGE_BYTES, CHECK, what, fix)
    }];
    // A process with CAP_NET_ADMIN gets more than the limit; others do not.
    if let Some(limit) = limits.rmem_max_bytes
        && limit < buffer.granted_bytes as u64
    {
        findings.push(Finding::warn(
            CHECK,
            format!(
                "{} is more than the limit of {} (net.core.rmem_max={limit}), since this user may \
                 administrate the network; nodes of other users get no more than the limit",
                kib(buffer.granted_bytes as u64),
                kib(limit)
            ),
            format!("{RAISE_RECEIVE_BUFFER}; to keep it: {KEEP_RECEIVE_BUFFER}"),
        ));
    }
    findings
}

/// Whether the send buffer delays large messages to other machines. `topics` are those with large messages that go from
/// here to another machine.
pub(crate) fn send_buffer(limits: &KernelLimits, topics: &[&str]) -> Option<Finding> {
    let limit = limits.wmem_max_bytes?;
    if topics.is_empty() || limit >= DEPTH_IMAGE_BYTES as u64 {
        return None;
    }
    Some(Finding::warn(
        Check::SendBuffer,
        format!(
            "{} goes to another machine, and a socket here sends at most {} at once \
             (net.core.wmem_max={limit}), less than one depth image ({})",
            topics.join(", "),
            kib(limit),
            kb(DEPTH_IMAGE_BYTES)
        ),
        format!("sudo sysctl -w net.core.wmem_max={WANTED_SEND_BUFFER}, then restart the nodes"),
    ))
}

/// Whether the memory for incomplete datagrams suffices after a fragment is lost. `sources` are topics of other machines.
pub(crate) fn fragments(limits: &KernelLimits, sources: &[String]) -> Option<Finding> {
    let (memory, wait_s) = (limits.ipfrag_high_thresh_bytes?, limits.ipfrag_time_s?);
    if sources.is_empty() || memory >= WANTED_FRAGMENT_MEMORY || wait_s <= LONGEST_FRAGMENT_WAIT_S {
        return None;
    }
    Some(Finding::warn(
        Check::Fragments,
        format!(
            "{} in datagrams that the network carries in fragments; the kernel keeps {} of incomplete \
             ones for {wait_s} s (net.ipv4.ipfrag_high_thresh={memory}, ipfrag_time={wait_s}), and \
             drops all once that is full",
            sources.join(", "),
            kib(memory)
        ),
        format!(
            "sudo sysctl -w net.ipv4.ipfrag_time={LONGEST_FRAGMENT_WAIT_S} \
             net.ipv4.ipfrag_high_thresh={WANTED_FRAGMENT_MEMORY}"
        ),
    ))
}

/// What the kernel dropped while the doctor listened, of all processes.
pub(crate) fn dropped_meanwhile(dropped: &KernelDrops, seconds: f64, fix: &str) -> Vec<Finding> {
    const CHECK: Check = Check::Dropped;
    let mut findings = Vec::new();
    if dropped.receive_buffer_full > 0 {
        findings.push(Finding::warn(
            CHECK,
            format!(
                "within {seconds:.1} s the kernel dropped {} datagrams for processes of this machine, \
                 because their receive buffers were full",
                dropped.receive_buffer_full
            ),
            fix,
        ));
    }
    if dropped.send_buffer_full > 0 {
        findings.push(Finding::warn(
            CHECK,
            format!(
                "within {seconds:.1} s the kernel refused {} datagrams of this machine, because send \
                 buffers were full",
                dropped.send_buffer_full
            ),
            format!("sudo sysctl -w net.core.wmem_max={WANTED_SEND_BUFFER}"),
        ));
    }
    if dropped.reassembly_failures > 0 {
        findings.push(Finding::warn(
            CHECK,
            format!(
                "within {seconds:.1} s the kernel gave up {} datagrams whose fragments did not all arrive",
                dropped.reassembly_failures
            ),
            format!(
                "sudo sysctl -w net.ipv4.ipfrag_time={LONGEST_FRAGMENT_WAIT_S} \
                 net.ipv4.ipfrag_high_thresh={WANTED_FRAGMENT_MEMORY}; over Wi-Fi send less, as \
                 compressed topics"
            ),
        ));
    }
    findings
}

#[cfg(test)]
mod tests;
