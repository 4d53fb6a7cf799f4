//! The latency of messages: exact to a thousandth, in bounded memory for any number of messages.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

use robot::Failure;

/// Latencies are counted in microseconds.
const MICROS_PER_MS: f64 = 1e3;
/// Larger latencies are clamped to this: ten minutes.
const LATEST_MICROS: u64 = 600_000_000;
/// Significant digits of a quantile.
const DIGITS: u8 = 3;

/// Latencies so far.
pub(super) struct Latencies {
    micros: Histogram<u64>,
    oldest_ms: f64,
}

/// Quantiles of latencies.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub(super) struct LatencyMs {
    /// The median.
    pub(super) median: f64,
    /// The 99th percentile.
    pub(super) p99: f64,
    /// The maximum.
    pub(super) max: f64,
}

impl Latencies {
    pub(super) fn new() -> Result<Self, Failure> {
        let micros = Histogram::new_with_bounds(1, LATEST_MICROS, DIGITS)
            .map_err(|error| Failure::new(format!("cannot count latencies: {error}")))?;
        Ok(Self { micros, oldest_ms: 0.0 })
    }

    /// Adds a latency. A negative one, from a sender whose clock is ahead, counts as zero.
    pub(super) fn note(&mut self, seconds: f64) {
        let milliseconds = (seconds * 1e3).max(0.0);
        self.oldest_ms = self.oldest_ms.max(milliseconds);
        self.micros.saturating_record((milliseconds * MICROS_PER_MS).round() as u64);
    }

    /// The quantiles; `None` before the first latency.
    pub(super) fn quantiles(&self) -> Option<LatencyMs> {
        // A quantile is the upper end of its bin, which may be above all values.
        let at = |quantile| {
            (self.micros.value_at_quantile(quantile) as f64 / MICROS_PER_MS).min(self.oldest_ms)
        };
        (!self.micros.is_empty()).then(|| LatencyMs {
            median: at(0.5),
            p99: at(0.99),
            max: self.oldest_ms,
        })
    }
}

/// The age of the messages when they were taken, except for the last one: nothing newer was sent after
/// it, so that its age depends on when the reader took it and not on the transport.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ages {
    oldest_ms: Option<f64>,
    last_ms: Option<f64>,
}

impl Ages {
    /// Adds the age of a message.
    pub(super) fn note(&mut self, seconds: f64) {
        if let Some(before) = self.last_ms.replace(seconds * 1e3) {
            self.oldest_ms = Some(self.oldest_ms.map_or(before, |oldest| oldest.max(before)));
        }
    }

    /// The greatest age of a message other than the last.
    pub(super) fn oldest_ms(&self) -> Option<f64> {
        self.oldest_ms
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_what_was_noted() {
        let mut latencies = Latencies::new().unwrap();
        assert_eq!(latencies.quantiles(), None);
        for milliseconds in 1..=1000 {
            latencies.note(f64::from(milliseconds) / 1e3);
        }
        let found = latencies.quantiles().unwrap();
        let close = |found: f64, truth: f64| (found - truth).abs() <= truth * 2e-3;
        assert!(close(found.median, 500.0), "{found:?}");
        assert!(close(found.p99, 990.0), "{found:?}");
        assert_eq!(found.max, 1000.0);
    }

    #[test]
    fn what_no_clock_can_mean_is_counted_at_the_bounds() {
        let mut latencies = Latencies::new().unwrap();
        for seconds in [-5.0, f64::NAN, 1e12] {
            latencies.note(seconds);
        }
        let found = latencies.quantiles().unwrap();
        assert_eq!(found.median, 0.0);
        assert!(found.p99 >= 599_000.0 && found.p99 < 601_000.0, "{found:?}");
        assert_eq!(found.max, 1e15);
    }

    /// Regression: the last message, which a slow reader takes after the end, made a depth of 1 appear late.
    #[test]
    fn the_last_message_has_no_age() {
        let mut ages = Ages::default();
        ages.note(0.5);
        assert_eq!(ages.oldest_ms(), None);
        ages.note(0.25);
        ages.note(0.75);
        assert_eq!(ages.oldest_ms(), Some(500.0));
    }
}
