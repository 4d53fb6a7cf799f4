//! Publishers and subscriptions that share a name and yet exchange nothing.

use std::collections::{BTreeMap, BTreeSet};

use node_shell::{DiscoveredEndpoint, QosMismatch, Role};

use super::{Check, Finding, owners};

fn by_topic(endpoints: &[DiscoveredEndpoint]) -> BTreeMap<&str, Vec<&DiscoveredEndpoint>> {
    let mut topics: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for endpoint in endpoints {
        topics.entry(endpoint.topic.as_str()).or_default().push(endpoint);
    }
    topics
}

/// Topics with several types under one name.
pub(super) fn types(endpoints: &[DiscoveredEndpoint]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (topic, ends) in by_topic(endpoints) {
        let mut types: BTreeMap<(&str, Role), Vec<&DiscoveredEndpoint>> = BTreeMap::new();
        for end in ends {
            types.entry((&end.type_name, end.role)).or_default().push(end);
        }
        let names: BTreeSet<&str> = types.keys().map(|(name, _)| *name).collect();
        if names.len() < 2 {
            continue;
        }
        let ends: Vec<_> = types
            .iter()
            .map(|((name, role), ends)| {
                let plural = if ends.len() == 1 { "" } else { "s" };
                format!("{name} ({role}{plural} of {})", owners(ends.iter().copied()))
            })
            .collect();
        findings.push(Finding::error(
            Check::Types,
            format!(
                "{topic} has {} types, which exchange nothing: {}",
                names.len(),
                ends.join(", ")
            ),
            format!("start one of them with another name: --ros-args -r {topic}:={topic}_2"),
        ));
    }
    findings
}

/// Pairs of one type with incompatible QoS, which on Zenoh exchange messages all the same.
pub(super) fn qos(endpoints: &[DiscoveredEndpoint]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (topic, ends) in by_topic(endpoints) {
        let is_publisher = |end: &&DiscoveredEndpoint| {
            end.role == Role::Publisher && end.participant.compares_qos()
        };
        let publishers = || ends.iter().copied().filter(is_publisher);
        let mut mismatches: BTreeMap<QosMismatch, MismatchedPairs<'_>> = BTreeMap::new();
        for subscription in ends.iter().copied().filter(|end| end.role == Role::Subscription) {
            let of_its_type = || publishers().filter(|one| one.type_name == subscription.type_name);
            let has_compatible_publisher =
                of_its_type().any(|one| one.qos.mismatch(&subscription.qos).is_none());
            for publisher in of_its_type() {
                let Some(mismatch) = publisher.qos.mismatch(&subscription.qos) else { continue };
                let pairs = mismatches.entry(mismatch).or_default();
                pairs.publishers.push(publisher);
                pairs.subscriptions.push(subscription);
                pairs.is_grave |= !has_compatible_publisher;
            }
        }
        findings.extend(mismatches.iter().map(|(mismatch, pairs)| pairs.finding(topic, mismatch)));
    }
    findings
}

/// The pairs of a topic that are incompatible for one reason.
#[derive(Default)]
struct MismatchedPairs<'a> {
    publishers: Vec<&'a DiscoveredEndpoint>,
    subscriptions: Vec<&'a DiscoveredEndpoint>,
    /// Whether one of the subscriptions has no compatible publisher at all.
    is_grave: bool,
}

impl MismatchedPairs<'_> {
    fn finding(&self, topic: &str, mismatch: &QosMismatch) -> Finding {
        let QosMismatch { policy, offered, requested } = mismatch;
        let (publishers, subscriptions) =
            (owners(self.publishers.iter().copied()), owners(self.subscriptions.iter().copied()));
        Finding::grave_if(
            self.is_grave,
            Check::Qos,
            format!(
                "{topic}: the publisher of {publishers} offers {policy} {offered}, the subscription of \
                 {subscriptions} requests {requested}, so nothing is exchanged"
            ),
            format!(
                "set the {policy} of {subscriptions} to {offered}, or that of {publishers} to \
                 {requested}"
            ),
        )
    }
}

#[cfg(test)]
mod tests {
    use node_shell::Qos;

    use super::super::synthetic::*;
    use super::*;
    use crate::doctor::finding::Severity;

    #[test]
    fn healthy_graphs_have_no_mismatch() {
        assert!(types(&healthy()).is_empty());
        assert!(qos(&healthy()).is_empty());
    }

    #[test]
    fn two_types_under_one_name_are_named_with_their_owners() {
        let mut graph = healthy();
        graph.push(publisher("/scan", IMAGE, "/camera"));
        let findings = types(&graph);
        assert_eq!(findings.len(), 1);
        let parts = [
            "/scan has 2 types",
            "sensor_msgs/msg/Image (publisher of node /camera)",
            "sensor_msgs/msg/LaserScan (publisher of node /driver)",
            "(subscription of node /detection)",
            "--ros-args -r /scan:=/scan_2",
        ];
        assert_finding(&findings[0], Severity::Error, &parts);
        // QoS is compared among endpoints of one type: the camera's and the viewer's here.
        graph.push(with_qos(subscription("/scan", IMAGE, "/viewer"), &Qos::latched()));
        assert_eq!(qos(&graph).len(), 1);
    }

    /// The doctor took each pair of them for a fault.
    #[test]
    fn on_zenoh_quality_of_service_keeps_nobody_apart() {
        let on_zenoh = |one: DiscoveredEndpoint| DiscoveredEndpoint { participant: ZENOH, ..one };
        let graph = [
            on_zenoh(with_qos(publisher("/scan", SCAN, "/driver"), &Qos::sensor(5))),
            on_zenoh(with_qos(subscription("/scan", SCAN, "/viewer"), &Qos::latched())),
        ];
        assert!(qos(&graph).is_empty());
        assert_eq!(types(&[graph[0].clone(), publisher("/scan", IMAGE, "/camera")]).len(), 1);
    }

    #[test]
    fn a_subscription_without_a_compatible_publisher_is_an_error() {
        let graph = [
            with_qos(publisher("/scan", SCAN, "/driver"), &Qos::sensor(5)),
            with_qos(subscription("/scan", SCAN, "/viewer"), &Qos::reliable(5)),
        ];
        let findings = qos(&graph);
        assert_eq!(findings.len(), 1);
        let parts = [
            "/scan: the publisher of node /driver offers reliability best effort",
            "the subscription of node /viewer requests reliable",
            "set the reliability of node /viewer to best effort",
        ];
        assert_finding(&findings[0], Severity::Error, &parts);
    }

    #[test]
    fn a_subscription_with_another_compatible_publisher_is_a_warning() {
        let graph = [
            with_qos(publisher("/map", POINTS, "/old"), &Qos::reliable(1)),
            with_qos(publisher("/map", POINTS, "/mapper"), &Qos::latched()),
            with_qos(subscription("/map", POINTS, "/viewer"), &Qos::latched()),
        ];
        let findings = qos(&graph);
        assert_eq!(findings.len(), 1);
        assert_finding(
            &findings[0],
            Severity::Warn,
            &["durability volatile", "node /old", "transient local"],
        );
    }

    #[test]
    fn many_pairs_with_one_mismatch_are_one_finding() {
        let mut graph = vec![with_qos(publisher("/scan", SCAN, "/driver"), &Qos::sensor(5))];
        for node in ["/b", "/a", "/a"] {
            graph.push(with_qos(subscription("/scan", SCAN, node), &Qos::reliable(5)));
        }
        let findings = qos(&graph);
        assert_eq!(findings.len(), 1);
        assert_finding(&findings[0], Severity::Error, &["node /a, node /b requests"]);
    }
}
