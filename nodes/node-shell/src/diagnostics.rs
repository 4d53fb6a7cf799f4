//! The node's report about itself on `/diagnostics`: once a second, and at once when a peer comes or
//! goes; and the warning when a topic has no publisher.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use msgs::builtin_interfaces::Time;
use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use msgs::std_msgs::Header;
use tokio::time::Instant;

use crate::counters::{Counters, Snapshot};
use crate::graph::{Graph, Match, Role};
use crate::publisher::Publisher;
use crate::throttle::WARNING_PERIOD;

/// How often the node reports.
const PERIOD: Duration = Duration::from_secs(1);
/// How soon after a report another one may follow.
const SHORTEST_PERIOD: Duration = Duration::from_millis(200);

pub(crate) struct Diagnostics {
    pub(crate) node_name: String,
    pub(crate) publisher: Publisher<DiagnosticArray>,
    pub(crate) graph: Graph,
    pub(crate) counters: Counters,
}

impl Diagnostics {
    /// Reports until `stop` resolves.
    pub(crate) async fn run(self, stop: impl Future<Output = ()>) {
        futures::pin_mut!(stop);
        let mut changes = self.graph.changes();
        let mut last = (Instant::now(), Snapshot::default());
        let mut waiting_since = Instant::now();
        loop {
            let reported = Instant::now();
            changes.mark_unchanged();
            let (matches, snapshot) = (self.graph.matches(), self.counters.snapshot());
            let message = self.report(&matches, &snapshot, (&last.1, reported - last.0));
            if let Err(error) = self.publisher.publish(&message) {
                tracing::debug!("diagnostics: {error}");
            }
            last = (reported, snapshot);
            waiting_since = warn_of_the_missing(&matches, waiting_since, reported);

            tokio::select! {
                () = &mut stop => return,
                () = next_report(&mut changes, reported) => {}
            }
        }
    }

    fn report(
        &self,
        matches: &[Match],
        now: &Snapshot,
        (before, elapsed): (&Snapshot, Duration),
    ) -> DiagnosticArray {
        let missing = missing(matches);
        let dropped = now.drops.saturating_sub(before.drops);
        let (level, message) = if !missing.is_empty() {
            (DiagnosticStatus::WARN, format!("waiting for {}", missing.join(", ")))
        } else if dropped > 0 {
            (DiagnosticStatus::WARN, format!("{dropped} dropped in the last report's time"))
        } else {
            (DiagnosticStatus::OK, "running".to_owned())
        };
        let mut values: Vec<_> =
            now.values.iter().map(|(key, value)| pair(key, value.clone())).collect();
        for one in matches {
            let peers = match one.role {
                Role::Publisher => "subscribers",
                Role::Subscription => "publishers",
            };
            values.push(pair(&format!("{peers} {}", one.topic), one.peers.to_string()));
        }
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
            header: Header { stamp: wall_clock(), frame_id: String::new() },
            status: vec![DiagnosticStatus {
                level,
                name: self.node_name.clone(),
                message,
                hardware_id: String::new(),
                values,
            }],
        }
    }
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

/// Warns once in a while of subscriptions without a publisher; returns since when there are such, or
/// since when they were last warned of.
fn warn_of_the_missing(matches: &[Match], waiting_since: Instant, now: Instant) -> Instant {
    let missing = missing(matches);
    if missing.is_empty() {
        now
    } else if now - waiting_since >= WARNING_PERIOD {
        tracing::warn!(
            "nothing publishes {}; check that the driver runs, its topic's name (remap with -r \
             FROM:=TO), and ROS_DOMAIN_ID",
            missing.join(", ")
        );
        now
    } else {
        waiting_since
    }
}

fn pair(key: &str, value: String) -> KeyValue {
    KeyValue { key: key.to_owned(), value }
}

/// The time for stamps of what the node says about itself; data keep the stamps that they came with.
fn wall_clock() -> Time {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Time {
        sec: i32::try_from(since_epoch.as_secs()).unwrap_or(i32::MAX),
        nanosec: since_epoch.subsec_nanos(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn the_warning_comes_after_its_period_and_not_sooner() {
        let matches = [one(Role::Subscription, "/scan", 0)];
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        assert_eq!(warn_of_the_missing(&matches, at(0), at(4)), at(0));
        assert_eq!(warn_of_the_missing(&matches, at(0), at(5)), at(5));
        assert_eq!(warn_of_the_missing(&[], at(0), at(3)), at(3));
    }
}
