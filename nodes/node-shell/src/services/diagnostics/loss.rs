//! Names losses in the kernel: how much, which topics suffer, what will be lost meanwhile, and the
//! fix.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use tokio::time::Instant;

use crate::endpoints::counters::Snapshot;
use crate::graph::{Match, Role};
use crate::wire::transport::{GrantedBuffer, ReceiveHealth};

/// How often the kernel's counters are read at most. A report that comes earlier, since a peer came or went, is too early to
/// name silent topics; and where many nodes start together, peers come and go all the time.
const PERIOD: Duration = Duration::from_millis(900);

/// How long a loss is reported after the last datagram was dropped: long enough to be seen.
const MEMORY: Duration = Duration::from_secs(5);

/// A topic that has been silent for longer has not fallen silent by the loss at hand.
const SILENCE: Duration = Duration::from_secs(10);

/// Watches the losses of one node.
#[derive(Debug)]
pub(super) struct LossWatch {
    health: Arc<ReceiveHealth>,
    /// When the counters were read last, and what they said.
    read: Option<(Instant, Counts)>,
    /// When each topic was last heard.
    heard: BTreeMap<String, Instant>,
    loss: Option<(Instant, Loss)>,
}

#[derive(Clone, Debug, Default)]
struct Counts {
    dropped: u64,
    lost: BTreeMap<String, u64>,
    received: BTreeMap<String, u64>,
}

/// The recent losses.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Loss {
    datagrams: u64,
    seconds: u64,
    granted: GrantedBuffer,
    /// Topics with the number of messages that are known to be lost.
    lossy: Vec<(String, u64)>,
    /// Topics that have publishers but were silent.
    silent: Vec<String>,
}

impl LossWatch {
    pub(super) fn new(health: Arc<ReceiveHealth>) -> Self {
        Self { health, read: None, heard: BTreeMap::new(), loss: None }
    }

    /// Looks at the kernel's counters, once a second at most, and warns of a new loss. Returns how many
    /// datagrams were dropped in all, where the kernel reports it, and the last loss.
    pub(super) fn look(
        &mut self,
        now: Instant,
        matches: &[Match],
        snapshot: &Snapshot,
    ) -> (Option<u64>, Option<&Loss>) {
        let dropped = match &self.read {
            Some((_, counts)) if !self.is_due(now) => Some(counts.dropped),
            _ => self.health.dropped_datagrams(),
        };
        if let Some(dropped) = dropped
            && let Some(loss) = self.take(now, dropped, matches, snapshot)
            && let Some(held_back) = self.health.warnings(loss.names_topics()).pass()
        {
            tracing::warn!("{loss} ({held_back} more such warnings held back)");
        }
        (dropped, self.loss.as_ref().map(|(_, loss)| loss))
    }

    fn is_due(&self, now: Instant) -> bool {
        self.read.as_ref().is_none_or(|(read, _)| now.duration_since(*read) >= PERIOD)
    }

    /// Takes a reading, if one is due; returns the loss since the last one, if there is any.
    fn take(
        &mut self,
        now: Instant,
        dropped: u64,
        matches: &[Match],
        snapshot: &Snapshot,
    ) -> Option<Loss> {
        if self.loss.as_ref().is_some_and(|(since, _)| now.duration_since(*since) > MEMORY) {
            self.loss = None;
        }
        if !self.is_due(now) {
            return None;
        }
        let counts =
            Counts { dropped, lost: snapshot.lost.clone(), received: snapshot.received.clone() };
        let Some((read, before)) = &self.read else {
            self.read = Some((now, counts));
            return None;
        };
        let elapsed = now.duration_since(*read);
        let more = |counts: &BTreeMap<String, u64>, before: &BTreeMap<String, u64>, topic: &str| {
            let of = |counts: &BTreeMap<String, u64>| counts.get(topic).copied().unwrap_or(0);
            of(counts).saturating_sub(of(before))
        };
        let mut lossy = Vec::new();
        let mut silent = Vec::new();
        for topic in subscribed(matches) {
            let lost = more(&counts.lost, &before.lost, topic);
            if more(&counts.received, &before.received, topic) > 0 {
                self.heard.insert(topic.to_owned(), now);
            } else if self.heard.get(topic).is_none_or(|last| now.duration_since(*last) < SILENCE) {
                silent.push(topic.to_owned());
            }
            if lost > 0 {
                lossy.push((topic.to_owned(), lost));
            }
        }
        let datagrams = counts.dropped.saturating_sub(before.dropped);
        self.read = Some((now, counts));
        if datagrams == 0 {
            return None;
        }
        let granted = self.health.granted_buffer();
        let seconds = elapsed.as_secs_f64().round() as u64;
        let loss = Loss { datagrams, seconds, granted, lossy, silent };
        self.loss = Some((now, loss.clone()));
        Some(loss)
    }
}

impl Loss {
    fn names_topics(&self) -> bool {
        !(self.lossy.is_empty() && self.silent.is_empty())
    }
}

/// The topics with a subscription that has publishers.
fn subscribed(matches: &[Match]) -> impl Iterator<Item = &str> {
    matches
        .iter()
        .filter(|one| one.role == Role::Subscription && one.peers > 0)
        .map(|one| one.topic.as_str())
}

impl fmt::Display for Loss {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "the kernel dropped {} datagrams within {} s, because the receive buffer of {} KiB was \
             full",
            self.datagrams,
            self.seconds.max(1),
            self.granted.bytes() / 1024,
        )?;
        let lossy = self.lossy.iter().map(|(topic, lost)| format!("{topic} lost {lost} messages"));
        let silent = self.silent.iter().map(|topic| format!("{topic} is silent"));
        let topics: Vec<_> = lossy.chain(silent).collect();
        if !topics.is_empty() {
            write!(formatter, ": {}", topics.join(", "))?;
        }
        match self.granted.fix() {
            Some(fix) => write!(
                formatter,
                "; most messages above {} kB will be lost meanwhile, while smaller ones and \
                 compressed topics still arrive; {fix}, then restart",
                self.granted.largest_safe_message() / 1000,
            ),
            None => formatter.write_str(
                "; the buffer has the requested size, so this process lacks the CPU time \
                 to empty it: reduce the load of this machine, or subscribe to compressed topics",
            ),
        }
    }
}

#[cfg(test)]
mod tests;
