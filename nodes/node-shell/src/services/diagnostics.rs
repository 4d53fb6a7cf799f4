//! The node's report about itself on `/diagnostics`: once a second, and at once when a peer comes or
//! goes; with the problems, and the fix of each.

mod deafness;
mod findings;
mod loss;
mod missing;

use std::sync::Arc;
use std::time::Duration;

use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use msgs::std_msgs::Header;
use tokio::sync::watch;
use tokio::time::Instant;

use deafness::Deafness;
use findings::{Findings, Silent, missing, silent};
use loss::LossWatch;
use missing::MissingWarning;

use crate::endpoints::counters::{Counters, Snapshot};
use crate::endpoints::publisher::Publisher;
use crate::graph::{Graph, Match, Role};
use crate::node::clock::NodeClock;
use crate::node::life::{Life, LifecycleState};
use crate::process::memory::resident_bytes;
use crate::process::shutdown::Shutdown;
use crate::wire::transport::{NetworkWatch, ReceiveHealth};

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
    /// None where there are no datagrams.
    pub(crate) health: Option<Arc<ReceiveHealth>>,
    pub(crate) networks: NetworkWatch,
    /// To end a process that hears nothing since its network has changed; `None` where nobody starts it again.
    pub(crate) started_again: Option<Shutdown>,
    /// Gets each report, too.
    pub(crate) last: watch::Sender<Option<Arc<DiagnosticStatus>>>,
}

impl Diagnostics {
    /// Reports until `stop` resolves.
    pub(crate) async fn run(self, stop: impl Future<Output = ()>) {
        futures::pin_mut!(stop);
        let mut changes = self.graph.changes();
        let mut last = (Instant::now(), Snapshot::default());
        let mut losses = self.health.clone().map(LossWatch::new);
        let mut missing_warning = MissingWarning::default();
        let mut silent_warning = MissingWarning::default();
        let mut deafness = Deafness::default();
        loop {
            let reported = Instant::now();
            changes.mark_unchanged();
            let (matches, snapshot) = (self.graph.matches(), self.counters.snapshot());
            let (datagrams_dropped, loss) = match &mut losses {
                Some(losses) => losses.look(reported, &matches, &snapshot),
                None => (None, None),
            };
            let idle = self.life.state().filter(|state| *state != LifecycleState::Active);
            let findings = Findings {
                silent: if idle.is_none() { silent(&matches, &snapshot) } else { Vec::new() },
                idle,
                // An idle node waits for nothing.
                missing: if idle.is_none() { missing(&matches, &snapshot) } else { Vec::new() },
                troubles: self.graph.troubles(),
                loss: loss.cloned(),
                datagrams_dropped,
                warnings: snapshot.warnings.clone(),
                network: self.networks.change(),
            };
            let status = self.report(&matches, &findings, &snapshot, (&last.1, reported - last.0));
            self.last.send_replace(Some(Arc::new(status.clone())));
            let message = DiagnosticArray {
                header: Header { stamp: self.clock.now(), frame_id: String::new() },
                status: vec![status],
            };
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
                let texts: Vec<String> = findings.silent.iter().map(Silent::to_string).collect();
                tracing::warn!("{}; its publisher has paused, stopped or died", texts.join(", "));
            }

            if let Some(shutdown) = &self.started_again
                && let Some(reason) = deafness.is_lasting(&findings, snapshot.cycles, reported)
            {
                tracing::error!("{reason}");
                shutdown.fail(reason);
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
    ) -> DiagnosticStatus {
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
        DiagnosticStatus {
            level,
            name: self.node_name.clone(),
            message,
            hardware_id: String::new(),
            values,
        }
    }

    /// The receive limits of the process, and its losses.
    fn receiving(&self, findings: &Findings<'_>) -> Vec<KeyValue> {
        let mut values = Vec::new();
        if let Some(health) = &self.health {
            let granted = health.granted_buffer();
            let safe = granted.largest_safe_message();
            values.push(pair("receive buffer KiB", (granted.bytes() / 1024).to_string()));
            values.push(pair("largest safe message kB", (safe / 1000).to_string()));
            values.push(pair("datagram filter", health.filter().to_string()));
        }
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

fn pair(key: &str, value: String) -> KeyValue {
    KeyValue { key: key.to_owned(), value }
}
