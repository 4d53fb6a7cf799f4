use std::collections::BTreeSet;

use node_shell::InterfaceInUse;

use super::*;
use crate::doctor::finding::Severity;

fn interface(name: &str, address: [u8; 4], multicast: bool) -> InterfaceInUse {
    let addresses = vec![Ipv4Addr::from(address)];
    InterfaceInUse { name: name.to_owned(), addresses, multicast, mtu_bytes: Some(1500) }
}

fn machine() -> Machine {
    Machine {
        domain_id: 0,
        range: DiscoveryRange::Subnet,
        has_static_peers: false,
        transport: "domain 0, all networks".to_owned(),
        interfaces: vec![
            interface("lo", [127, 0, 0, 1], false),
            interface("eth0", [10, 0, 0, 2], true),
        ],
        own_addresses: BTreeSet::from([Ipv4Addr::LOCALHOST, Ipv4Addr::new(10, 0, 0, 2)]),
        limits: KernelLimits {
            rmem_max_bytes: Some(32 << 20),
            wmem_max_bytes: Some(8 << 20),
            ipfrag_high_thresh_bytes: Some(4 << 20),
            ipfrag_time_s: Some(30),
            ephemeral_ports: Some((32_768, 60_999)),
        },
    }
}

fn buffer(granted_bytes: usize, asked_bytes: usize) -> ReceiveBuffer {
    ReceiveBuffer { granted_bytes, asked_bytes, largest_safe_bytes: granted_bytes }
}

fn severities(findings: &[Finding]) -> Vec<Severity> {
    findings.iter().map(|finding| finding.severity).collect()
}

#[track_caller]
fn assert_finding(finding: &Finding, severity: Severity, parts: &[&str]) {
    assert_eq!(finding.severity, severity, "{finding:?}");
    let line = finding.line(false);
    for part in parts {
        assert!(line.contains(part), "'{part}' is not in: {line}");
    }
    assert!(severity == Severity::Ok || finding.fix.is_some());
}

#[test]
fn all_findings_of_a_healthy_machine_are_ok() {
    let findings = machine().findings(&buffer(32 << 20, 32 << 20));
    assert!(severities(&findings).iter().all(|one| *one == Severity::Ok), "{findings:?}");
    let interfaces = findings.iter().find(|one| one.check == Check::Interfaces).unwrap();
    assert_finding(
        interfaces,
        Severity::Ok,
        &["eth0 (10.0.0.2, MTU 1500, multicast)", "lo (127.0.0.1"],
    );
}

#[test]
fn a_receive_buffer_smaller_than_a_depth_image_is_an_error() {
    let limits = KernelLimits { rmem_max_bytes: Some(212_992), ..KernelLimits::default() };
    let findings = receive_buffer(&buffer(212_992, 32 << 20), &limits);
    assert_eq!(findings.len(), 1);
    let parts = [
        "208 KiB of 32768 KiB requested",
        "messages above 212 kB",
        "raw depth images of 640x480 (614 kB)",
        "(4915 kB)",
        "(9830 kB)",
        "sudo sysctl -w net.core.rmem_max=33554432",
        "config/sysctl/60-stillmap.conf",
        "compressed_depth",
    ];
    assert_finding(&findings[0], Severity::Error, &parts);
}

#[test]
fn a_receive_buffer_smaller_than_a_cloud_is_a_warning() {
    let finding = &receive_buffer(&buffer(4 << 20, 32 << 20), &KernelLimits::default())[0];
    assert_finding(finding, Severity::Warn, &["clouds of 640x480 points (4915 kB)"]);
    assert!(!finding.what.contains("depth images"));
}

#[test]
fn a_buffer_that_was_requested_small_is_fixed_by_the_variable() {
    let finding = &receive_buffer(&buffer(128 << 10, 128 << 10), &KernelLimits::default())[0];
    assert_finding(finding, Severity::Error, &["128 KiB:", "unset STILLMAP_RECEIVE_BUFFER_KIB"]);
    assert!(!finding.line(false).contains("sysctl"));
}

#[test]
fn a_buffer_above_the_limit_is_granted_to_this_user_alone() {
    let limits = KernelLimits { rmem_max_bytes: Some(212_992), ..KernelLimits::default() };
    let findings = receive_buffer(&buffer(32 << 20, 32 << 20), &limits);
    assert_eq!(severities(&findings), [Severity::Ok, Severity::Warn]);
    assert_finding(&findings[1], Severity::Warn, &["net.core.rmem_max=212992", "other users"]);
}

#[test]
fn domain_ports_in_the_ephemeral_range_are_reported() {
    let on_domain = |domain_id| ports(&Machine { domain_id, ..machine() });
    assert_eq!(on_domain(0), None);
    assert_eq!(on_domain(100), None);
    let finding = on_domain(102).unwrap();
    assert_finding(
        &finding,
        Severity::Warn,
        &["32900 to 33149", "32768 to 60999", "ROS_DOMAIN_ID=100"],
    );
    assert_eq!(on_domain(215), None);
}

#[test]
fn missing_multicast_or_network_is_reported_with_the_fix() {
    let with = |interfaces| interfaces_of(Machine { interfaces, ..machine() });
    fn interfaces_of(machine: Machine) -> Vec<Finding> {
        interfaces(&machine)
    }
    let lo = interface("lo", [127, 0, 0, 1], false);
    let no_multicast = interface("tun0", [10, 8, 0, 2], false);
    let findings = with(vec![]);
    assert_eq!(findings.len(), 1, "nothing is in use");
    assert_finding(
        &findings[0],
        Severity::Error,
        &["no interface has an IPv4 address", "set lo up"],
    );
    let findings = with(vec![lo.clone()]);
    assert_finding(&findings[1], Severity::Warn, &["no interface in use leads to another machine"]);
    let findings = with(vec![lo.clone(), no_multicast.clone()]);
    assert_finding(&findings[1], Severity::Warn, &["carries multicast", "ROS_STATIC_PEERS"]);
    let peers =
        Machine { interfaces: vec![lo.clone(), no_multicast], has_static_peers: true, ..machine() };
    assert_eq!(interfaces(&peers).len(), 1);
    let local = Machine { interfaces: vec![lo], range: DiscoveryRange::Localhost, ..machine() };
    assert_eq!(interfaces(&local).len(), 1);
    let off = Machine { range: DiscoveryRange::Off, interfaces: vec![], ..machine() };
    assert_finding(&interfaces(&off)[0], Severity::Warn, &["ROS_AUTOMATIC_DISCOVERY_RANGE=OFF"]);
}

#[test]
fn a_send_buffer_matters_where_large_messages_leave_the_machine() {
    let small = KernelLimits { wmem_max_bytes: Some(212_992), ..KernelLimits::default() };
    assert_eq!(send_buffer(&small, &[]), None);
    assert_eq!(send_buffer(&machine().limits, &["/points"]), None);
    let finding = send_buffer(&small, &["/points"]).unwrap();
    let parts = ["/points goes to", "208 KiB", "sysctl -w net.core.wmem_max=8388608"];
    assert_finding(&finding, Severity::Warn, &parts);
}

#[test]
fn fragments_matter_where_large_datagrams_come_from_elsewhere() {
    let limits = machine().limits;
    let sources = ["/points comes from 10.0.0.5 (Fast DDS)".to_owned()];
    assert_eq!(fragments(&limits, &[]), None);
    let finding = fragments(&limits, &sources).unwrap();
    let parts = ["10.0.0.5", "ipfrag_high_thresh=4194304", "ipfrag_time=30", "sysctl -w net.ipv4"];
    assert_finding(&finding, Severity::Warn, &parts);
    let fixed = KernelLimits {
        ipfrag_time_s: Some(3),
        ipfrag_high_thresh_bytes: Some(128 << 20),
        ..limits
    };
    assert_eq!(fragments(&fixed, &sources), None);
}

#[test]
fn dropped_datagrams_are_reported_with_numbers() {
    assert!(dropped_meanwhile(&KernelDrops::default(), 3.0, "raise it").is_empty());
    let dropped =
        KernelDrops { receive_buffer_full: 12, send_buffer_full: 5, reassembly_failures: 7 };
    let findings = dropped_meanwhile(&dropped, 3.0, "raise it");
    assert_finding(
        &findings[0],
        Severity::Warn,
        &["within 3.0 s", "dropped 12 datagrams", "raise it"],
    );
    assert_finding(&findings[1], Severity::Warn, &["refused 5 datagrams", "wmem_max"]);
    assert_finding(&findings[2], Severity::Warn, &["7 datagrams", "ipfrag_time"]);
}

#[test]
fn another_machine_is_recognised_by_its_addresses() {
    let at = |octets: &[[u8; 4]]| -> BTreeSet<Ipv4Addr> {
        octets.iter().map(|one| Ipv4Addr::from(*one)).collect()
    };
    let machine = machine();
    assert!(machine.is_elsewhere(&at(&[[10, 0, 0, 5]])));
    assert!(!machine.is_elsewhere(&at(&[[10, 0, 0, 2], [172, 17, 0, 1]])));
    assert!(!machine.is_elsewhere(&at(&[[127, 0, 0, 1]])));
    assert!(!machine.is_elsewhere(&at(&[])));
}
