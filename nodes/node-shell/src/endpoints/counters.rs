//! The counters of a node, for `/diagnostics`.

mod arrivals;
mod steps;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use arrivals::Arrivals;
use steps::StepTimes;

/// Messages received on one topic.
#[derive(Debug, Default)]
pub(crate) struct TopicCounters {
    received: AtomicU64,
    lost: AtomicU64,
    left_out: AtomicU64,
    malformed: AtomicU64,
    arrivals: Mutex<Arrivals>,
}

impl TopicCounters {
    pub(crate) fn count_received(&self, lost_before: u64) {
        self.received.fetch_add(1, Ordering::Relaxed);
        self.lost.fetch_add(lost_before, Ordering::Relaxed);
        self.lock_arrivals().note(Instant::now());
    }

    /// Counts messages that gave way to newer ones while they waited to be taken.
    pub(crate) fn count_left_out(&self, messages: u64) {
        self.left_out.fetch_add(messages, Ordering::Relaxed);
    }

    pub(crate) fn left_out(&self) -> u64 {
        self.left_out.load(Ordering::Relaxed)
    }

    fn lock_arrivals(&self) -> MutexGuard<'_, Arrivals> {
        self.arrivals.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn count_malformed(&self) {
        self.malformed.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn received(&self) -> u64 {
        self.received.load(Ordering::Relaxed)
    }

    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

/// The counters of a node. Clones share the counts.
#[derive(Clone, Debug, Default)]
pub struct Counters {
    counts: Arc<Mutex<Counts>>,
}

#[derive(Debug, Default)]
struct Counts {
    received: BTreeMap<String, Arc<TopicCounters>>,
    published: BTreeMap<String, Arc<AtomicU64>>,
    cycles: u64,
    drops: BTreeMap<String, u64>,
    steps: BTreeMap<String, StepTimes>,
    conditions: BTreeMap<String, Condition>,
    /// The counts of the last cycle.
    counted: BTreeMap<String, u64>,
    fills: BTreeMap<String, Fill>,
    /// How old the data of the last cycle were when it was done.
    age_s: Option<f64>,
    /// The topics that need no publisher, and that may pause.
    optional: BTreeSet<String>,
}

/// How much there is of something that is bounded.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Fill {
    used: u64,
    bound: u64,
}

/// How something is that the node watches.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Condition {
    text: String,
    is_warning: bool,
    /// When it is over, unless it is noted again before, and what it says then.
    ends: Option<(Instant, &'static str)>,
}

impl Condition {
    /// What it says at a moment, and whether that is a warning.
    fn at(&self, moment: Instant) -> (&str, bool) {
        match self.ends {
            Some((end, after)) if end <= moment => (after, false),
            _ => (&self.text, self.is_warning),
        }
    }
}

/// The counts of one moment, as names with values.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Snapshot {
    /// Names with values, in a fixed order.
    pub(crate) values: Vec<(String, String)>,
    /// Cycles so far.
    pub(crate) cycles: u64,
    /// Drops so far, whatever the cause.
    pub(crate) drops: u64,
    /// Messages received, by topic.
    pub(crate) received: BTreeMap<String, u64>,
    /// Messages missing between those received, by topic.
    pub(crate) lost: BTreeMap<String, u64>,
    /// The topics that need no publisher.
    pub(crate) optional: BTreeSet<String>,
    /// The topics that have ceased to come, and for how long.
    pub(crate) silent: BTreeMap<String, Duration>,
    /// Messages published, by topic.
    pub(crate) published: BTreeMap<String, u64>,
    /// The conditions of the node that are warnings.
    pub(crate) warnings: Vec<String>,
}

impl Counters {
    /// Counts one cycle that was processed.
    pub fn count_cycle(&self) {
        self.lock().cycles += 1;
    }

    /// Counts something that was dropped, by its cause.
    pub fn count_drop(&self, cause: &str) {
        *self.lock().drops.entry(cause.to_owned()).or_default() += 1;
    }

    /// The drops so far, by cause.
    #[must_use]
    pub fn drops(&self) -> BTreeMap<String, u64> {
        self.lock().drops.clone()
    }

    /// Notes the state of a condition that the node watches, under its name; it is kept until the next note. A
    /// warning is reported beside missing and lost topics.
    pub fn note_condition(&self, name: &str, text: &str, is_warning: bool) {
        let condition = Condition { text: text.to_owned(), is_warning, ends: None };
        self.lock().conditions.insert(name.to_owned(), condition);
    }

    /// Notes a warning that is over at `end`, unless it is noted again before; the condition says `after` then.
    pub(crate) fn note_warning_until(
        &self,
        name: &str,
        text: &str,
        (end, after): (Instant, &'static str),
    ) {
        let condition =
            Condition { text: text.to_owned(), is_warning: true, ends: Some((end, after)) };
        self.lock().conditions.insert(name.to_owned(), condition);
    }

    /// The conditions that are warnings, each with its name before it.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.snapshot().warnings
    }

    /// Notes that the node works without this topic of its subscriptions, by its absolute name: that it has no publisher, or
    /// that it has fallen silent, causes no warning.
    pub fn note_optional(&self, topic: &str) {
        self.lock().optional.insert(topic.to_owned());
    }

    /// Notes how long a step took.
    pub fn note_step(&self, step: &str, duration: Duration) {
        self.lock().steps.entry(step.to_owned()).or_default().note(duration);
    }

    /// Notes what the last cycle counted, as zones or tracks; each stays until the next note.
    pub fn note_counts(&self, counts: &[(&str, u64)]) {
        let mut noted = self.lock();
        for (name, count) in counts {
            noted.counted.insert((*name).to_owned(), *count);
        }
    }

    /// Notes how much there is of something that takes memory, and how much there may be at most.
    pub fn note_fill(&self, name: &str, used: usize, bound: usize) {
        let fill = Fill { used: used as u64, bound: bound as u64 };
        self.lock().fills.insert(name.to_owned(), fill);
    }

    /// Notes how old the data of the last cycle were when it was done.
    pub(crate) fn note_age(&self, age_s: f64) {
        self.lock().age_s = Some(age_s);
    }

    pub(crate) fn of_subscription(&self, topic: &str) -> Arc<TopicCounters> {
        Arc::clone(self.lock().received.entry(topic.to_owned()).or_default())
    }

    pub(crate) fn of_publisher(&self, topic: &str) -> Arc<AtomicU64> {
        Arc::clone(self.lock().published.entry(topic.to_owned()).or_default())
    }

    /// Reads everything.
    pub(crate) fn snapshot(&self) -> Snapshot {
        self.snapshot_at(Instant::now())
    }

    fn snapshot_at(&self, moment: Instant) -> Snapshot {
        let counts = self.lock();
        let mut snapshot = Snapshot {
            cycles: counts.cycles,
            drops: counts.drops.values().sum(),
            ..Snapshot::default()
        };
        let mut put = |name: String, value: String| snapshot.values.push((name, value));
        put("cycles".to_owned(), counts.cycles.to_string());
        for (name, condition) in &counts.conditions {
            put(name.clone(), condition.at(moment).0.to_owned());
        }
        for (name, count) in &counts.counted {
            put(name.clone(), count.to_string());
        }
        for (name, Fill { used, bound }) in &counts.fills {
            put(format!("fill {name}"), format!("{used} of {bound}"));
        }
        if let Some(age_s) = counts.age_s {
            put("age of the last cycle s".to_owned(), format!("{age_s:.3}"));
        }
        for (cause, count) in &counts.drops {
            put(format!("dropped: {cause}"), count.to_string());
        }
        for (topic, one) in &counts.received {
            put(format!("received {topic}"), one.received().to_string());
            put(format!("lost {topic}"), one.lost().to_string());
            let malformed = one.malformed.load(Ordering::Relaxed);
            if malformed > 0 {
                put(format!("malformed {topic}"), malformed.to_string());
            }
            if let Some(age) = one.lock_arrivals().age(moment) {
                put(format!("seconds since {topic}"), format!("{:.3}", age.as_secs_f64()));
            }
        }
        for (topic, published) in &counts.published {
            put(format!("published {topic}"), published.load(Ordering::Relaxed).to_string());
        }
        for (step, times) in &counts.steps {
            let Some(times) = times.percentiles() else { continue };
            put(format!("{step} median ms"), format!("{:.3}", times.median_ms));
            put(format!("{step} p99 ms"), format!("{:.3}", times.p99_ms));
            put(format!("{step} max ms"), format!("{:.3}", times.max_ms));
        }
        let conditions = counts.conditions.iter().map(|(name, one)| (name, one.at(moment)));
        let warnings = conditions.filter(|(_, (_, is_warning))| *is_warning);
        snapshot.warnings = warnings.map(|(name, (text, _))| format!("{name}: {text}")).collect();
        snapshot.received =
            counts.received.iter().map(|(topic, one)| (topic.clone(), one.received())).collect();
        let lost = |one: &TopicCounters| one.lost.load(Ordering::Relaxed);
        snapshot.lost =
            counts.received.iter().map(|(topic, one)| (topic.clone(), lost(one))).collect();
        snapshot.optional.clone_from(&counts.optional);
        let silence = |(topic, one): (&String, &Arc<TopicCounters>)| {
            if counts.optional.contains(topic) {
                return None;
            }
            Some((topic.clone(), one.lock_arrivals().silence(moment)?))
        };
        snapshot.silent = counts.received.iter().filter_map(silence).collect();
        snapshot.published = counts
            .published
            .iter()
            .map(|(topic, one)| (topic.clone(), one.load(Ordering::Relaxed)))
            .collect();
        snapshot
    }

    fn lock(&self) -> MutexGuard<'_, Counts> {
        self.counts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value<'a>(snapshot: &'a Snapshot, name: &str) -> Option<&'a str> {
        snapshot.values.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    #[test]
    fn counts_add_up_and_times_stay() {
        let counters = Counters::default();
        counters.count_cycle();
        counters.count_drop("no pose");
        counters.count_drop("no pose");
        counters.note_step("reduce", Duration::from_millis(2));
        counters.note_step("reduce", Duration::from_millis(6));
        let scan = counters.of_subscription("/scan");
        scan.count_received(0);
        scan.count_received(3);
        let snapshot = counters.snapshot();
        assert_eq!((snapshot.cycles, snapshot.drops), (1, 2));
        assert_eq!(value(&snapshot, "dropped: no pose"), Some("2"));
        assert_eq!(value(&snapshot, "received /scan"), Some("2"));
        assert_eq!(value(&snapshot, "lost /scan"), Some("3"));
        assert_eq!(value(&snapshot, "malformed /scan"), None);
        assert_eq!(value(&snapshot, "reduce median ms"), Some("2.000"));
        assert_eq!(value(&snapshot, "reduce p99 ms"), Some("6.000"));
        assert_eq!(value(&snapshot, "reduce max ms"), Some("6.000"));
        assert_eq!(value(&counters.snapshot(), "reduce median ms"), Some("2.000"));
        assert!(value(&snapshot, "seconds since /scan").is_some());
        assert!(snapshot.silent.is_empty());
    }

    #[test]
    fn the_last_note_is_reported() {
        let counters = Counters::default();
        counters.note_counts(&[("zones", 2), ("tracks", 1)]);
        counters.note_counts(&[("zones", 0)]);
        counters.note_fill("voxels", 10, 1000);
        counters.note_age(0.0625);
        let snapshot = counters.snapshot();
        assert_eq!(value(&snapshot, "zones"), Some("0"));
        assert_eq!(value(&snapshot, "tracks"), Some("1"));
        assert_eq!(value(&snapshot, "fill voxels"), Some("10 of 1000"));
        assert_eq!(value(&snapshot, "age of the last cycle s"), Some("0.062"));
    }

    #[test]
    fn a_condition_stays_until_the_next_note() {
        let counters = Counters::default();
        counters.note_condition("extrinsics", "off by 0.06 m", true);
        for _ in 0..2 {
            let snapshot = counters.snapshot();
            assert_eq!(value(&snapshot, "extrinsics"), Some("off by 0.06 m"));
            assert_eq!(snapshot.warnings, ["extrinsics: off by 0.06 m"]);
        }
        counters.note_condition("extrinsics", "ok", false);
        let snapshot = counters.snapshot();
        assert_eq!(value(&snapshot, "extrinsics"), Some("ok"));
        assert!(snapshot.warnings.is_empty());
    }

    /// Regression: `pace` warned for ever when the input had ended, or the node was paused: no cycle came that said otherwise.
    #[test]
    fn a_warning_with_an_end_is_over_without_another_note() {
        let counters = Counters::default();
        let end = Instant::now() + Duration::from_secs(7);
        counters.note_warning_until("pace", "too slow", (end, "keeps up"));
        let before = counters.snapshot_at(end - Duration::from_millis(1));
        assert_eq!((value(&before, "pace"), before.warnings.len()), (Some("too slow"), 1));
        let after = counters.snapshot_at(end);
        assert_eq!((value(&after, "pace"), after.warnings.len()), (Some("keeps up"), 0));
    }
}
