//! When the messages of a topic came, and whether they have ceased to.
//!
//! A publisher whose process was killed stays matched until its lease ends, 50 s at the most: missing messages
//! show it sooner.

use std::time::{Duration, Instant};

/// From this many messages on it is known how a topic comes.
const LEAST_MESSAGES: u64 = 5;
/// A topic has ceased when nothing has come for this many times its usual pause, ...
const USUAL_PAUSES: f64 = 10.0;
/// ... and for this long at least: a busy machine may be late by a second.
const LEAST_SILENCE: Duration = Duration::from_millis(1500);
/// How much of the usual pause the last one is: the mean of some twenty, ...
const SHARE_OF_THE_LAST: f64 = 0.1;
/// ... but a shorter one shows at once that the source is faster than expected.
const SHARE_OF_A_SHORTER: f64 = 0.5;

/// When the messages of one topic came.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Arrivals {
    count: u64,
    last: Option<Instant>,
    usual_pause_s: f64,
    /// Whether the last message came after a silence.
    was_silent: bool,
}

impl Arrivals {
    pub(super) fn note(&mut self, now: Instant) {
        let is_silent = self.silence(now).is_some();
        if let Some(last) = self.last {
            let pause_s = now.saturating_duration_since(last).as_secs_f64();
            let share = match (is_silent, self.was_silent) {
                // One silence says nothing of the pace; a second one that the pace is another.
                (true, false) => 0.0,
                (true, true) => 1.0,
                (false, _) if self.count < 2 => 1.0,
                (false, _) if pause_s < self.usual_pause_s => SHARE_OF_A_SHORTER,
                (false, _) => SHARE_OF_THE_LAST,
            };
            self.usual_pause_s += share * (pause_s - self.usual_pause_s);
        }
        self.was_silent = is_silent;
        self.last = Some(now);
        self.count += 1;
    }

    /// How long ago the last message came.
    pub(super) fn age(&self, now: Instant) -> Option<Duration> {
        self.last.map(|last| now.saturating_duration_since(last))
    }

    /// For how long the topic has been silent, where it used to come more often.
    pub(super) fn silence(&self, now: Instant) -> Option<Duration> {
        let age = self.age(now).filter(|_| self.count >= LEAST_MESSAGES)?;
        let longest_s = (USUAL_PAUSES * self.usual_pause_s).max(LEAST_SILENCE.as_secs_f64());
        (age.as_secs_f64() > longest_s).then_some(age)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrivals(pause: Duration, count: u32) -> (Arrivals, Instant) {
        let start = Instant::now();
        let mut arrivals = Arrivals::default();
        (0..count).for_each(|index| arrivals.note(start + pause * index));
        (arrivals, start + pause * (count - 1))
    }

    #[test]
    fn a_topic_that_came_often_and_comes_no_more_is_silent() {
        let (arrivals, last) = arrivals(Duration::from_millis(100), 20);
        let after = |ms| last + Duration::from_millis(ms);
        assert_eq!(arrivals.age(after(300)), Some(Duration::from_millis(300)));
        assert_eq!(arrivals.silence(after(1400)), None);
        assert_eq!(arrivals.silence(after(1600)), Some(Duration::from_millis(1600)));
    }

    #[test]
    fn a_topic_that_comes_seldom_may_pause_for_longer() {
        let (arrivals, last) = arrivals(Duration::from_secs(1), 20);
        assert_eq!(arrivals.silence(last + Duration::from_secs(9)), None);
        assert!(arrivals.silence(last + Duration::from_secs(11)).is_some());
    }

    /// Regression: the pause of a source that was away made the next one seem usual, and that was reported seconds later.
    #[test]
    fn a_silence_is_no_usual_pause() {
        let (mut arrivals, last) = arrivals(Duration::from_millis(100), 20);
        let after = |ms| last + Duration::from_millis(ms);
        arrivals.note(after(5_000));
        assert!(arrivals.silence(after(6_600)).is_some(), "it is known how it comes");
        (0..10).for_each(|index| arrivals.note(after(7_000 + 100 * index)));
        assert!(arrivals.silence(after(9_500)).is_some());
        // And a source that has become slow is no silent one for long.
        let start = after(60_000);
        (0..10).for_each(|index| arrivals.note(start + Duration::from_secs(5) * index));
        assert_eq!(arrivals.silence(start + Duration::from_secs(45 + 30)), None);
    }

    #[test]
    fn a_few_messages_promise_no_more() {
        let (arrivals, last) = arrivals(Duration::from_millis(100), 4);
        assert_eq!(arrivals.silence(last + Duration::from_secs(100)), None);
        assert_eq!(Arrivals::default().age(last), None);
    }
}
