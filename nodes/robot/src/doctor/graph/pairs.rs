//! Publishers and subscriptions that share a name and yet do not talk.

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
        let who: Vec<_> = types
            .iter()
            .map(|((name, role), ends)| {
                let plural = if ends.len() == 1 { "" } else { "s" };
                format!("{name} ({role}{plural} of {})", owners(ends.iter().copied()))
            })
            .collect();
        findings.push(Finding::error(
            Check::Types,
            format!("{topic} has {} types, which do not talk: {}", names.len(), who.join(", ")),
            format!("start one of them with another name: --ros-args -r {topic}:={topic}_2"),
        ));
    }
    findings
}

/// Pairs of one type whose qualities of service do not fit.
pub(super) fn qualities(endpoints: &[DiscoveredEndpoint]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (topic, ends) in by_topic(endpoints) {
        let publishers = || ends.iter().copied().filter(|end| end.role == Role::Publisher);
        let mut misfits: BTreeMap<QosMismatch, Misfit<'_>> = BTreeMap::new();
        for subscription in ends.iter().copied().filter(|end| end.role == Role::Subscription) {
            let of_its_type = || publishers().filter(|one| one.type_name == subscription.type_name);
            let hears_somebody =
                of_its_type().any(|one| one.qos.mismatch(&subscription.qos).is_none());
            for publisher in of_its_type() {
                let Some(mismatch) = publisher.qos.mismatch(&subscription.qos) else { continue };
                let misfit = misfits.entry(mismatch).or_default();
                misfit.publishers.push(publisher);
                misfit.subscriptions.push(subscription);
                misfit.is_grave |= !hears_somebody;
            }
        }
        findings.extend(misfits.iter().map(|(mismatch, misfit)| misfit.finding(topic, mismatch)));
    }
    findings
}

/// The pairs of a topic that do not fit for one reason.
#[derive(Default)]
struct Misfit<'a> {
    publishers: Vec<&'a DiscoveredEndpoint>,
    subscriptions: Vec<&'a DiscoveredEndpoint>,
    /// Whether one of the subscriptions hears nobody at all.
    is_grave: bool,
}

impl Misfit<'_> {
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
    fn healthy_graphs_have_no_misfit() {
        assert!(types(&healthy()).is_empty());
        assert!(qualities(&healthy()).is_empty());
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
        tells(&findings[0], Severity::Error, &parts);
        // Qualities are compared among ends of one type: the camera's and the viewer's here.
        graph.push(with_qos(subscription("/scan", IMAGE, "/viewer"), &Qos::latched()));
        assert_eq!(qualities(&graph).len(), 1);
    }

    #[test]
    fn a_subscription_that_hears_nobody_is_an_error() {
        let graph = [
            with_qos(publisher("/scan", SCAN, "/driver"), &Qos::sensor(5)),
            with_qos(subscription("/scan", SCAN, "/viewer"), &Qos::reliable(5)),
        ];
        let findings = qualities(&graph);
        assert_eq!(findings.len(), 1);
        let parts = [
            "/scan: the publisher of node /driver offers reliability best effort",
            "the subscription of node /viewer requests reliable",
            "set the reliability of node /viewer to best effort",
        ];
        tells(&findings[0], Severity::Error, &parts);
    }

    #[test]
    fn a_subscription_that_hears_another_publisher_is_a_warning() {
        let graph = [
            with_qos(publisher("/map", POINTS, "/old"), &Qos::reliable(1)),
            with_qos(publisher("/map", POINTS, "/mapper"), &Qos::latched()),
            with_qos(subscription("/map", POINTS, "/viewer"), &Qos::latched()),
        ];
        let findings = qualities(&graph);
        assert_eq!(findings.len(), 1);
        tells(
            &findings[0],
            Severity::Warn,
            &["durability volatile", "node /old", "transient local"],
        );
    }

    #[test]
    fn many_pairs_of_one_misfit_are_one_finding() {
        let mut graph = vec![with_qos(publisher("/scan", SCAN, "/driver"), &Qos::sensor(5))];
        for node in ["/b", "/a", "/a"] {
            graph.push(with_qos(subscription("/scan", SCAN, node), &Qos::reliable(5)));
        }
        let findings = qualities(&graph);
        assert_eq!(findings.len(), 1);
        tells(&findings[0], Severity::Error, &["node /a, node /b requests"]);
    }
}
