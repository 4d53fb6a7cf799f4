//! Synthetic graphs for tests.

use std::collections::BTreeSet;
use std::net::Ipv4Addr;

use node_shell::{DiscoveredQos, ParticipantId, Qos, RosArguments};

use super::*;
use crate::doctor::finding::Severity;

pub(super) const SCAN: &str = "sensor_msgs/msg/LaserScan";
pub(super) const IMAGE: &str = "sensor_msgs/msg/Image";
pub(super) const CAMERA_INFO: &str = "sensor_msgs/msg/CameraInfo";
pub(super) const POINTS: &str = "sensor_msgs/msg/PointCloud2";
pub(super) const POSE: &str = "geometry_msgs/msg/PoseStamped";

/// A node on Zenoh.
pub(super) const ZENOH: ParticipantId = ParticipantId([0xff, 0x5a, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
/// A participant of Cyclone DDS.
const CYCLONE: ParticipantId = ParticipantId([1, 0x10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]);

fn endpoint(role: Role, topic: &str, type_name: &str, node: &str, qos: &Qos) -> DiscoveredEndpoint {
    DiscoveredEndpoint {
        role,
        topic: topic.to_owned(),
        type_name: type_name.to_owned(),
        type_hash: None,
        qos: match role {
            Role::Publisher => DiscoveredQos::of_publisher(qos),
            Role::Subscription => DiscoveredQos::of_subscription(qos),
        },
        node: Some(node.to_owned()),
        is_before_iron: false,
        participant: CYCLONE,
        addresses: BTreeSet::from([Ipv4Addr::LOCALHOST]),
    }
}

pub(super) fn publisher(topic: &str, type_name: &str, node: &str) -> DiscoveredEndpoint {
    endpoint(Role::Publisher, topic, type_name, node, &Qos::reliable(5))
}

pub(super) fn subscription(topic: &str, type_name: &str, node: &str) -> DiscoveredEndpoint {
    endpoint(Role::Subscription, topic, type_name, node, &Qos::sensor(5))
}

pub(super) fn with_qos(one: DiscoveredEndpoint, qos: &Qos) -> DiscoveredEndpoint {
    let node = one.node.unwrap();
    endpoint(one.role, &one.topic, &one.type_name, &node, qos)
}

pub(super) fn at(one: DiscoveredEndpoint, address: [u8; 4]) -> DiscoveredEndpoint {
    DiscoveredEndpoint { addresses: BTreeSet::from([Ipv4Addr::from(address)]), ..one }
}

/// A view of these endpoints, in the root namespace.
pub(super) fn view(endpoints: Vec<DiscoveredEndpoint>) -> GraphView {
    let arguments = RosArguments::parse(Vec::<String>::new()).unwrap();
    GraphView {
        listened_s: 3.0,
        is_interrupted: false,
        endpoints,
        suite: SuiteTopics::resolve(&arguments).unwrap(),
        cameras: BTreeMap::new(),
        measured: BTreeMap::new(),
        received: BTreeMap::new(),
        transforms: TransformFacts::default(),
        reports: Vec::new(),
        dropped: None,
        links: None,
    }
}

/// The drivers that the suite needs, and detection.
pub(super) fn healthy() -> Vec<DiscoveredEndpoint> {
    let topics = [
        ("/scan", SCAN),
        ("/depth/image", IMAGE),
        ("/depth/camera_info", CAMERA_INFO),
        ("/pose", POSE),
    ];
    topics
        .into_iter()
        .flat_map(|(topic, type_name)| {
            [publisher(topic, type_name, "/driver"), subscription(topic, type_name, "/detection")]
        })
        .collect()
}

#[track_caller]
pub(super) fn assert_finding(finding: &Finding, severity: Severity, parts: &[&str]) {
    assert_eq!(finding.severity, severity, "{finding:?}");
    let line = finding.line(false);
    for part in parts {
        assert!(line.contains(part), "'{part}' is not in: {line}");
    }
    assert!(severity == Severity::Ok || finding.fix.is_some());
}
