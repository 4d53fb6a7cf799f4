//! The participants of the graph: nodes of one name, several publishers of one input, DDS vendors and ROS 2 releases that
//! do not mix, static transforms that nobody publishes.

use std::collections::{BTreeMap, BTreeSet};

use node_shell::{DiscoveredEndpoint, DiscoveredQos, ParticipantId, Qos, Role};

use super::{Check, Finding, GraphView, owners, received};
use crate::doctor::content::latching;
use crate::run::inputs::TF_STATIC;

/// DDS vendors that nodes of ROS 2 use by default or by choice, whose services are not compatible with each other.
const VENDORS: [&str; 4] = ["Cyclone DDS", "Fast DDS", "RTI Connext", "GurumDDS"];

/// Nodes of one name in several processes.
pub(super) fn same_names(endpoints: &[DiscoveredEndpoint]) -> Vec<Finding> {
    let mut nodes: BTreeMap<&str, BTreeSet<ParticipantId>> = BTreeMap::new();
    for endpoint in endpoints {
        if let Some(node) = &endpoint.node {
            nodes.entry(node).or_default().insert(endpoint.participant);
        }
    }
    nodes
        .into_iter()
        .filter(|(_, participants)| participants.len() > 1)
        .map(|(node, participants)| {
            let ids: Vec<String> = participants.iter().map(ParticipantId::to_string).collect();
            Finding::warn(
                Check::Nodes,
                format!("{} nodes have the name {node} (participants {})", ids.len(), ids.join(", ")),
                format!(
                    "end one of them, or start it with another name: --ros-args -r __node:={}_2, or in a namespace (-r \
                     __ns:=/robot); one that was killed is forgotten within half a minute",
                    node.rsplit('/').next().unwrap_or(node)
                ),
            )
        })
        .collect()
}

/// Inputs of the suite with several publishers.
pub(super) fn several_publishers(view: &GraphView) -> Vec<Finding> {
    view.suite
        .all()
        .into_iter()
        .filter_map(|(topic, type_name)| {
            let publishers: Vec<_> =
                view.at(Role::Publisher, topic).filter(|one| one.type_name == type_name).collect();
            (publishers.len() > 1).then(|| {
                Finding::warn(
                    Check::Publishers,
                    format!("{topic} has {} publishers: {}", publishers.len(), owners(publishers)),
                    format!("end all but one, or give each a topic of its own: --ros-args -r {topic}:={topic}_2"),
                )
            })
        })
        .collect()
}

/// Several DDS vendors in one graph.
pub(super) fn vendors(endpoints: &[DiscoveredEndpoint]) -> Option<Finding> {
    let vendors: BTreeSet<&str> = endpoints
        .iter()
        .map(|endpoint| endpoint.participant.vendor())
        .filter(|vendor| VENDORS.contains(vendor))
        .collect();
    let named: Vec<&str> = vendors.into_iter().collect();
    (named.len() > 1).then(|| {
        Finding::warn(
            Check::Versions,
            format!("nodes use {}, whose services are not compatible with each other", named.join(" and ")),
            "start all of them with the same one: export RMW_IMPLEMENTATION=rmw_cyclonedds_cpp, or rmw_fastrtps_cpp",
        )
    })
}

/// Participants of a ROS 2 release before Iron, beside newer ones.
pub(super) fn releases(endpoints: &[DiscoveredEndpoint]) -> Option<Finding> {
    let mut older: Vec<_> =
        endpoints.iter().filter(|one| one.is_before_iron).map(|one| one.participant).collect();
    older.sort_unstable();
    older.dedup();
    let first = older.first()?;
    let topics: BTreeSet<&str> =
        endpoints.iter().filter(|one| one.is_before_iron).map(|one| one.topic.as_str()).collect();
    let topics: Vec<&str> = topics.into_iter().take(MOST_TOPICS).collect();
    Some(Finding::warn(
        Check::Versions,
        format!(
            "{} participants announce their nodes as ROS 2 did before Iron, the first {first} (on {})",
            older.len(),
            topics.join(", ")
        ),
        "run one release of ROS 2 on all machines (echo $ROS_DISTRO in each shell); topics are exchanged, but not the \
         names of nodes and some types",
    ))
}

/// Topics that are named at most.
const MOST_TOPICS: usize = 3;

/// Transforms: whether they form a tree, and whether `/tf_static` is published.
pub(super) fn transforms(view: &GraphView) -> Vec<Finding> {
    let mut findings = Vec::new();
    let latched = DiscoveredQos::of_subscription(&Qos::latched());
    let volatile: Vec<_> = view
        .at(Role::Publisher, TF_STATIC)
        .filter(|one| one.qos.mismatch(&latched).is_some())
        .collect();
    if !volatile.is_empty() {
        findings.push(latching(&format!("{TF_STATIC} of {}", owners(volatile))));
    }
    let waiting: Vec<_> = view.at(Role::Subscription, TF_STATIC).collect();
    if !waiting.is_empty() && view.at(Role::Publisher, TF_STATIC).next().is_none() {
        findings.push(Finding::warn(
            Check::Transforms,
            format!("nobody publishes {TF_STATIC}, and {} waits for it", owners(waiting)),
            "start the robot's description (robot_state_publisher), or publish each mount: ros2 run tf2_ros \
             static_transform_publisher --frame-id base_link --child-frame-id laser",
        ));
    }
    findings.extend(view.transforms.findings(&received::sensors(view)));
    findings
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::*;
    use super::*;
    use crate::doctor::finding::Severity;

    fn of_another_process(mut one: DiscoveredEndpoint, vendor: [u8; 2]) -> DiscoveredEndpoint {
        one.participant = ParticipantId([vendor[0], vendor[1], 0, 0, 0, 0, 0, 0, 0, 0, 0, 2]);
        one
    }

    #[test]
    fn a_healthy_graph_has_no_finding() {
        let graph = view(healthy());
        assert!(same_names(&graph.endpoints).is_empty());
        assert!(several_publishers(&graph).is_empty());
        assert!(vendors(&graph.endpoints).is_none());
        assert!(transforms(&graph).is_empty());
    }

    #[test]
    fn two_nodes_of_one_name_are_reported_with_the_fix() {
        let mut graph = healthy();
        graph.push(of_another_process(publisher("/else", SCAN, "/driver"), [1, 0x10]));
        let findings = same_names(&graph);
        assert_eq!(findings.len(), 1);
        assert_finding(
            &findings[0],
            Severity::Warn,
            &["2 nodes have the name /driver", "__node:=driver_2"],
        );
    }

    #[test]
    fn two_publishers_of_an_input_are_reported() {
        let mut graph = healthy();
        graph.push(publisher("/scan", SCAN, "/other_driver"));
        let findings = several_publishers(&view(graph));
        assert_eq!(findings.len(), 1);
        assert_finding(&findings[0], Severity::Warn, &["/scan has 2 publishers", "/other_driver"]);
    }

    #[test]
    fn two_dds_vendors_are_reported() {
        let mut graph = healthy();
        graph.push(of_another_process(publisher("/else", SCAN, "/fast"), [1, 0x0f]));
        assert_finding(&vendors(&graph).unwrap(), Severity::Warn, &["Cyclone DDS and Fast DDS"]);
    }

    #[test]
    fn an_older_release_is_reported() {
        let mut graph = healthy();
        assert!(releases(&graph).is_none());
        graph[0].is_before_iron = true;
        assert_finding(
            &releases(&graph).unwrap(),
            Severity::Warn,
            &["1 participants", "before Iron", "/scan"],
        );
    }

    #[test]
    fn static_transforms_that_nobody_publishes_are_reported() {
        const TF: &str = "tf2_msgs/msg/TFMessage";
        let mut graph = healthy();
        graph.push(subscription("/tf_static", TF, "/detection"));
        assert_finding(
            &transforms(&view(graph.clone()))[0],
            Severity::Warn,
            &["nobody publishes /tf_static"],
        );
        graph.push(with_qos(publisher("/tf_static", TF, "/mounts"), &Qos::reliable(1)));
        let findings = transforms(&view(graph));
        assert_eq!(findings.len(), 1);
        assert_finding(&findings[0], Severity::Warn, &["/mounts", "transient local"]);
    }
}
