use std::collections::BTreeSet;
use std::net::Ipv4Addr;

use node_shell::DiscoveryRange;

use super::synthetic::*;
use super::*;
use crate::doctor::finding::Severity;
use crate::doctor::machine::KernelLimits;

const BUFFER: ReceiveBuffer =
    ReceiveBuffer { granted_bytes: 32 << 20, asked_bytes: 32 << 20, largest_safe_bytes: 32 << 20 };

fn machine() -> Machine {
    Machine {
        domain_id: 7,
        range: DiscoveryRange::Subnet,
        has_static_peers: false,
        transport: "domain 7, all networks".to_owned(),
        interfaces: Vec::new(),
        own_addresses: BTreeSet::from([Ipv4Addr::LOCALHOST]),
        limits: KernelLimits::default(),
    }
}

#[test]
fn all_findings_of_a_healthy_graph_are_ok() {
    let findings = view(healthy()).findings(&machine(), &BUFFER);
    assert!(findings.iter().all(|one| one.severity == Severity::Ok), "{findings:?}");
    assert_finding(&findings[0], Severity::Ok, &["4 topics", "1 of Cyclone DDS", "3.0 s"]);
}

#[test]
fn an_empty_graph_is_one_warning() {
    let findings = view(Vec::new()).findings(&machine(), &BUFFER);
    assert_eq!(findings.len(), 1);
    assert_finding(&findings[0], Severity::Warn, &["discovered on domain 7 within 3.0 s"]);
}

#[test]
fn datagrams_that_the_kernel_dropped_are_reported_with_the_fix_of_the_buffer() {
    let mut graph = view(healthy());
    graph.dropped = Some(KernelDrops { receive_buffer_full: 9, ..KernelDrops::default() });
    let small = ReceiveBuffer { granted_bytes: 212_992, ..BUFFER };
    let findings = graph.findings(&machine(), &small);
    let dropped = findings.iter().find(|one| one.check == Check::Dropped).unwrap();
    assert_finding(dropped, Severity::Warn, &["9 datagrams", "net.core.rmem_max"]);
}

/// The doctor named multicast and static peers where a router was missing.
#[test]
fn without_a_router_of_zenoh_the_doctor_says_how_to_start_one() {
    let with = |routers, peers| GraphView {
        links: Some(ZenohLinks { routers, peers }),
        ..view(Vec::new())
    };
    let finding = with(0, 0).router().unwrap();
    assert_finding(&finding, Severity::Error, &["no Zenoh router", "zenohd", "tcp/ADDRESS:7447"]);
    let finding = with(1, 3).router().unwrap();
    assert_finding(&finding, Severity::Ok, &["connected to 1 Zenoh router and 3 other nodes"]);
    // Scouting by multicast needs no router.
    assert_eq!(with(0, 1).router().unwrap().severity, Severity::Ok);
    assert!(view(Vec::new()).router().is_none());
    let findings = with(1, 0).findings(&machine(), &BUFFER);
    assert_finding(&findings[0], Severity::Warn, &["RMW_IMPLEMENTATION=rmw_zenoh_cpp"]);
    assert!(!findings[0].line(false).contains("multicast"), "{findings:?}");
}

/// Regression: with the drivers down the suite was to be fed with what it publishes itself, and its own outputs were found to be empty.
#[test]
fn what_the_suite_publishes_is_no_input_of_it() {
    const REPORT: &str = "stillmap_msgs/msg/StageReport";
    let suite = vec![
        subscription("/scan", SCAN, "/detection"),
        publisher("/segmentation/report", REPORT, "/segmentation"),
        publisher("/dynamic_scan", SCAN, "/segmentation"),
        publisher("/static_depth/image", IMAGE, "/segmentation"),
        publisher("/static_cloud", POINTS, "/segmentation"),
    ];
    assert_eq!(
        results::of_suite(&suite),
        BTreeSet::from(["/dynamic_scan", "/static_depth/image", "/static_cloud"])
    );
    let said: Vec<String> =
        inputs::missing(&view(suite.clone())).iter().map(|one| format!("{one:?}")).collect();
    assert!(said.iter().any(|one| one.contains("start the driver of scan")), "{said:?}");
    assert!(said.iter().all(|one| !one.contains("dynamic_scan")), "{said:?}");
    // A player of a recording of the suite publishes inputs, and so does a driver of the same topic.
    let mut played = suite;
    played[1] = publisher("/segmentation/report", REPORT, "/bag_player");
    assert!(results::of_suite(&played).is_empty());
    played[1] = publisher("/segmentation/report", REPORT, "/segmentation");
    played.push(publisher("/dynamic_scan", SCAN, "/driver"));
    assert!(!results::of_suite(&played).contains("/dynamic_scan"));
}
