//! The node's report about itself on `/diagnostics`: once a second, and at once when a peer comes or
//! goes; with what is not as it should be, and its mend.

mod loss;
mod missing;

use std::sync::Arc;
use std::time::Duration;

use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use msgs::std_msgs::Header;
use tokio::time::Instant;

use loss::{Loss, LossWatch};
use missing::MissingWarning;

use crate::assembly::resident_bytes;
use crate::clock::NodeClock;
use crate::counters::{Counters, Snapshot};
use crate::graph::{Graph, Match, Role, Trouble};
use crate::lifecycle::{Life, LifecycleState};
use crate::publisher::Publisher;
use crate::transport::ReceiveHealth;

/// How often the node reports.
const PERIOD: Duration = Duration::from_secs(1);
/// How soon after a report another one may follow.
const SHORTEST_PERIOD: Duration = Duration::from_millis(200);

pub(crate) struct Diagnostics {
    pub(crate) node_name: String,
    pub(crate) publisher: Publisher<DiagnosticArray>,
    pub(crate) graph: Graph,
    pub(crate) counters: Counters,
    pub(crate) clock: NodeClock,
    pub(crate) life: Life,
    pub(crate) health: Arc<ReceiveHealth>,
}

impl Diagnostics {
    /// Reports until `stop` resolves.
    pub(crate) async fn run(self, stop: impl Future<Output = ()>) {
        futures::pin_mut!(stop);
        let mut changes = self.graph.changes();
        let mut last = (Instant::now(), Snapshot::default());
        let mut losses = LossWatch::new(Arc::clone(&self.health));
        let mut missing_warning = MissingWarning::default();
        let mut silent_warning = MissingWarning::default();
        loop {
            let reported = Instant::now();
            changes.mark_unchanged();
            let (matches, snapshot) = (self.graph.matches(), self.counters.snapshot());
            let (datagrams_dropped, loss) = losses.look(reported, &matches, &snapshot);
            let idle = self.life.state().filter(|state| *state != LifecycleState::Active);
            let findings = Findings {
                silent: if idle.is_none() { silent(&matches, &snapshot) } else { Vec::new() },
                idle,
                // Who does nothing waits for nobody.
                missing: if idle.is_none() { missing(&matches) } else { Vec::new() },
                troubles: self.graph.troubles(),
                loss: loss.cloned(),
                datagrams_dropped,
                warnings: snapshot.warnings.clone(),
            };
            let message = self.report(&matches, &findings, &snapshot, (&last.1, reported - last.0));
            if let Err(error) = self.publisher.publish(message) {
                tracing::debug!("diagnostics: {error}");
            }
            if missing_warning.is_due(&findings.missing, reported) {
                tracing::warn!(
                    "nothing publishes {}; check that the driver runs, its topic's name (remap with \
                     -r FROM:=TO), and ROS_DOMAIN_ID",
                    findings.missing.join(", ")
                );
            }

            let ceased: Vec<&str> = findings.silent.iter().map(|one| one.topic).collect();
            if silent_warning.is_due(&ceased, reported) {
                let told: Vec<String> = findings.silent.iter().map(Silent::to_string).collect();
                tracing::warn!(
                    "{}; what publishes it has paused, stopped or died",
                    told.join(", ")
                );
            }

            last = (reported, snapshot);

            tokio::select! {
                () = &mut stop => return,
                () = next_report(&mut changes, reported) => {}
            }
        }
    }

    fn report(
        &self,
        matches: &[Match],
        findings: &Findings<'_>,
        now: &Snapshot,
        (before, elapsed): (&Snapshot, Duration),
    ) -> DiagnosticArray {
        let dropped = now.drops.saturating_sub(before.drops);
        let (level, message) = findings.summary(dropped);
        let state = self.life.state().map(|state| pair("state", state.label().to_owned()));
        let mut values: Vec<_> = state.into_iter().collect();
        values.extend(now.values.iter().map(|(key, value)| pair(key, value.clone())));
        for one in matches {
            let peers = match one.role {
                Role::Publisher => "subscribers",
                Role::Subscription => "publishers",
            };
            values.push(pair(&format!("{peers} {}", one.topic), one.peers.to_string()));
        }
        for trouble in &findings.troubles {
            values.push(pair(&format!("trouble {}", trouble.topic), trouble.text.clone()));
        }
        values.extend(self.receiving(findings));
        let seconds = elapsed.as_secs_f64();
        if seconds > 0.0 {
            let rate = |count: u64, earlier: Option<&u64>| {
                let more = count.saturating_sub(earlier.copied().unwrap_or(0));
                format!("{:.2}", more as f64 / seconds)
            };
            for (topic, count) in &now.received {
                let rate = rate(*count, before.received.get(topic));
                values.push(pair(&format!("received per second {topic}"), rate));
            }
            for (topic, count) in &now.published {
                let rate = rate(*count, before.published.get(topic));
                values.push(pair(&format!("published per second {topic}"), rate));
            }
            values.push(pair("cycles per second", rate(now.cycles, Some(&before.cycles))));
        }
        DiagnosticArray {
            header: Header { stamp: self.clock.now(), frame_id: String::new() },
            status: vec![DiagnosticStatus {
                level,
                name: self.node_name.clone(),
                message,
                hardware_id: String::new(),
                values,
            }],
        }
    }

    /// What the process can receive, and what it lost.
    fn receiving(&self, findings: &Findings<'_>) -> Vec<KeyValue> {
        let granted = self.health.granted_buffer();
        let mut values = vec![
            pair("receive buffer KiB", (granted.bytes() / 1024).to_string()),
            pair("largest safe message kB", (granted.largest_safe_message() / 1000).to_string()),
        ];
        if let Some(bytes) = resident_bytes() {
            values.push(pair("resident memory MB", format!("{:.1}", bytes as f64 * 1e-6)));
        }
        if let Some(dropped) = findings.datagrams_dropped {
            values.push(pair("datagrams dropped by the kernel", dropped.to_string()));
        }
        if let Some(loss) = &findings.loss {
            values.push(pair("loss", loss.to_string()));
        }
        values
    }
}

/// What is not as it should be.
struct Findings<'a> {
    /// The state of a node that does not work.
    idle: Option<LifecycleState>,
    /// The subscriptions that nobody publishes to.
    missing: Vec<&'a str>,
    /// Those that used to get messages, and get none.
    silent: Vec<Silent<'a>>,
    /// Peers that do not fit.
    troubles: Vec<Trouble>,
    /// What the kernel dropped of late.
    loss: Option<Loss>,
    /// What it dropped in all, where it tells.
    datagrams_dropped: Option<u64>,
    /// What the node watches and is not as it should be.
    warnings: Vec<String>,
}

impl Findings<'_> {
    /// The level and the message of the report, with the cycles that the node dropped since the last.
    fn summary(&self, dropped: u64) -> (u8, String) {
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
struct Silent<'a> {
    topic: &'a str,
    for_s: f64,
}

impl std::fmt::Display for Silent<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "nothing on {} for {:.1} s", self.topic, self.for_s)
    }
}

/// The topics with a publisher that have ceased to come. One that nobody publishes is missing.
fn silent<'a>(matches: &[Match], snapshot: &'a Snapshot) -> Vec<Silent<'a>> {
    let is_published = |topic: &str| {
        matches
            .iter()
            .any(|one| one.role == Role::Subscription && one.topic == topic && one.peers > 0)
    };
    let silent = snapshot.silent.iter().filter(|(topic, _)| is_published(topic));
    silent.map(|(topic, silence)| Silent { topic, for_s: silence.as_secs_f64() }).collect()
}

/// Waits for the next report's time: a second, or a change of the graph when the last report is not
/// too near.
async fn next_report(changes: &mut tokio::sync::watch::Receiver<u64>, reported: Instant) {
    let changed = async {
        // The graph holds the sender as long as the node lives.
        let _ = changes.changed().await;
        tokio::time::sleep_until(reported + SHORTEST_PERIOD).await;
    };
    tokio::select! {
        () = changed => {}
        () = tokio::time::sleep_until(reported + PERIOD) => {}
    }
}

/// The subscriptions that nobody publishes to.
fn missing(matches: &[Match]) -> Vec<&str> {
    let mut topics: Vec<_> = matches
        .iter()
        .filter(|one| one.role == Role::Subscription && one.peers == 0)
        .map(|one| one.topic.as_str())
        .collect();
    topics.dedup();
    topics
}

fn pair(key: &str, value: String) -> KeyValue {
    KeyValue { key: key.to_owned(), value }
}

#[cfg(test)]
mod tests {
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
        assert_eq!(missing(&matches), ["/points"]);
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
    fn the_gravest_finding_sets_the_level_and_each_is_told() {
        let trouble = |kind| Trouble { topic: "/scan".to_owned(), kind, text: "text".to_owned() };
        let mut findings = Findings {
            idle: None,
            missing: Vec::new(),
            silent: Vec::new(),
            troubles: Vec::new(),
            loss: None,
            datagrams_dropped: None,
            warnings: Vec::new(),
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
