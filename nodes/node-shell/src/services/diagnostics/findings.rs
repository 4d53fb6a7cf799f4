//! The problems of a node, and their level.

use std::fmt;

use msgs::diagnostic_msgs::DiagnosticStatus;

use super::loss::Loss;
use crate::endpoints::counters::Snapshot;
use crate::graph::{Match, Role, Trouble};
use crate::node::life::LifecycleState;
use crate::wire::transport::NetworkChange;

/// The problems of a node.
pub(super) struct Findings<'a> {
    /// The state of a node that does not work.
    pub(super) idle: Option<LifecycleState>,
    /// The subscriptions without a publisher.
    pub(super) missing: Vec<&'a str>,
    /// Those that used to get messages, and get none.
    pub(super) silent: Vec<Silent<'a>>,
    /// Peers that do not fit.
    pub(super) troubles: Vec<Trouble>,
    /// The recent losses in the kernel.
    pub(super) loss: Option<Loss>,
    /// The total of dropped messages, where the kernel reports it.
    pub(super) datagrams_dropped: Option<u64>,
    /// The conditions of the node that are warnings.
    pub(super) warnings: Vec<String>,
    /// How the machine's networks differ from those that the node has joined.
    pub(super) network: NetworkChange,
}

impl Findings<'_> {
    /// The level and the message of the report, with the cycles that the node dropped since the last.
    pub(super) fn summary(&self, dropped: u64) -> (u8, String) {
        let mut level = DiagnosticStatus::OK;
        let mut parts = Vec::new();
        let mut add = |grave, text| {
            level = level.max(grave);
            parts.push(text);
        };
        if let Some(state) = self.idle {
            add(DiagnosticStatus::OK, format!("{}: does nothing", state.label()));
        }
        for trouble in &self.troubles {
            add(trouble.level(), format!("{}: {}", trouble.topic, trouble.short()));
        }
        if let Some(loss) = &self.loss {
            add(DiagnosticStatus::WARN, loss.to_string());
        }
        if !self.network.is_none() {
            add(DiagnosticStatus::WARN, self.network.to_string());
        }
        for warning in &self.warnings {
            add(DiagnosticStatus::WARN, warning.clone());
        }
        if !self.missing.is_empty() {
            add(DiagnosticStatus::WARN, format!("waiting for {}", self.missing.join(", ")));
        } else if dropped > 0 {
            add(DiagnosticStatus::WARN, format!("{dropped} dropped in the last report's time"));
        }
        for silent in &self.silent {
            add(DiagnosticStatus::WARN, silent.to_string());
        }
        if parts.is_empty() {
            parts.push("running".to_owned());
        }
        (level, parts.join("; "))
    }
}

/// A topic that used to come, and comes no more.
pub(super) struct Silent<'a> {
    pub(super) topic: &'a str,
    for_s: f64,
}

impl fmt::Display for Silent<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "nothing on {} for {:.1} s", self.topic, self.for_s)
    }
}

/// The topics with a publisher that have ceased to come. One without a publisher is missing.
pub(super) fn silent<'a>(matches: &[Match], snapshot: &'a Snapshot) -> Vec<Silent<'a>> {
    let is_published = |topic: &str| {
        matches
            .iter()
            .any(|one| one.role == Role::Subscription && one.topic == topic && one.peers > 0)
    };
    let silent = snapshot.silent.iter().filter(|(topic, _)| is_published(topic));
    silent.map(|(topic, silence)| Silent { topic, for_s: silence.as_secs_f64() }).collect()
}

/// The subscriptions without a publisher, except those that the node works without.
pub(super) fn missing<'a>(matches: &'a [Match], snapshot: &Snapshot) -> Vec<&'a str> {
    let mut topics: Vec<_> = matches
        .iter()
        .filter(|one| one.role == Role::Subscription && one.peers == 0)
        .filter(|one| !snapshot.optional.contains(&one.topic))
        .map(|one| one.topic.as_str())
        .collect();
    topics.dedup();
    topics
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::graph::TroubleKind;

    fn one(role: Role, topic: &str, peers: usize) -> Match {
        Match { role, topic: topic.to_owned(), peers }
    }

    #[test]
    fn only_subscriptions_can_be_missing_something() {
        let matches = [
            one(Role::Publisher, "/map", 0),
            one(Role::Subscription, "/points", 0),
            one(Role::Subscription, "/scan", 1),
        ];
        assert_eq!(missing(&matches, &Snapshot::default()), ["/points"]);
    }

    #[test]
    fn what_a_node_works_without_is_not_missing() {
        let counters = crate::endpoints::counters::Counters::default();
        counters.note_optional("/map_path");
        let matches =
            [one(Role::Subscription, "/map_path", 0), one(Role::Subscription, "/scan", 0)];
        assert_eq!(missing(&matches, &counters.snapshot()), ["/scan"]);
    }

    #[test]
    fn a_topic_is_silent_only_while_somebody_publishes_it() {
        let silent_topics =
            ["/points", "/scan"].map(|topic| (topic.to_owned(), Duration::from_secs(2)));
        let snapshot = Snapshot { silent: silent_topics.into(), ..Snapshot::default() };
        let matches = [one(Role::Subscription, "/points", 0), one(Role::Subscription, "/scan", 1)];
        let found: Vec<&str> =
            silent(&matches, &snapshot).into_iter().map(|silent| silent.topic).collect();
        assert_eq!(found, ["/scan"]);
    }

    #[test]
    fn the_gravest_finding_sets_the_level_and_each_is_reported() {
        let trouble = |kind| Trouble { topic: "/scan".to_owned(), kind, text: "text".to_owned() };
        let mut findings = Findings {
            idle: None,
            missing: Vec::new(),
            silent: Vec::new(),
            troubles: Vec::new(),
            loss: None,
            datagrams_dropped: None,
            warnings: Vec::new(),
            network: NetworkChange::default(),
        };
        assert_eq!(findings.summary(0), (DiagnosticStatus::OK, "running".to_owned()));
        findings.idle = Some(LifecycleState::Inactive);
        let idle = "inactive: does nothing".to_owned();
        assert_eq!(findings.summary(0), (DiagnosticStatus::OK, idle));
        findings.idle = None;
        findings.warnings.push("extrinsics: off".to_owned());
        assert_eq!(findings.summary(0), (DiagnosticStatus::WARN, "extrinsics: off".to_owned()));
        findings.warnings.clear();
        assert_eq!(findings.summary(2).0, DiagnosticStatus::WARN);
        findings.silent.push(Silent { topic: "/scan", for_s: 3.25 });
        let silent = "nothing on /scan for 3.2 s".to_owned();
        assert_eq!(findings.summary(0), (DiagnosticStatus::WARN, silent));
        findings.silent.clear();
        findings.missing.push("/scan");
        assert_eq!(findings.summary(2), (DiagnosticStatus::WARN, "waiting for /scan".to_owned()));
        findings.troubles.push(trouble(TroubleKind::Incompatible));
        assert_eq!(findings.summary(0).0, DiagnosticStatus::WARN);
        findings.troubles.push(trouble(TroubleKind::OtherType));
        let (level, message) = findings.summary(0);
        assert_eq!(level, DiagnosticStatus::ERROR);
        assert!(message.contains("/scan: ") && message.ends_with("waiting for /scan"), "{message}");
    }
}
