//! How long the steps of a cycle took of late.

use std::collections::VecDeque;
use std::time::Duration;

/// This many runs are looked back on: with the seven cycles a second of the RPLIDAR A1, a minute; enough for a 99th
/// percentile.
const RUNS_KEPT: usize = 500;

/// The durations of the last runs of one step.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct StepTimes {
    last_s: VecDeque<f64>,
}

/// Their percentiles.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Percentiles {
    pub(super) median_ms: f64,
    pub(super) p99_ms: f64,
    pub(super) max_ms: f64,
}

impl StepTimes {
    pub(super) fn note(&mut self, duration: Duration) {
        if self.last_s.len() == RUNS_KEPT {
            self.last_s.pop_front();
        }
        self.last_s.push_back(duration.as_secs_f64());
    }

    /// None before the first run. A percentile is the least duration that this many of a hundred runs do not exceed (nearest
    /// rank).
    pub(super) fn percentiles(&self) -> Option<Percentiles> {
        let mut sorted: Vec<f64> = self.last_s.iter().copied().collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |percent: usize| {
            let rank = (sorted.len() * percent).div_ceil(100).max(1);
            sorted.get(rank - 1).map(|seconds| seconds * 1e3)
        };
        Some(Percentiles { median_ms: at(50)?, p99_ms: at(99)?, max_ms: at(100)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_last_runs() {
        let mut times = StepTimes::default();
        assert_eq!(times.percentiles(), None);
        for ms in 1..=RUNS_KEPT {
            times.note(Duration::from_millis(ms as u64));
        }
        let found = times.percentiles().unwrap();
        for (found, expected) in
            [(found.median_ms, 250.0), (found.p99_ms, 495.0), (found.max_ms, 500.0)]
        {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
        // The oldest runs are dropped.
        for _ in 0..RUNS_KEPT {
            times.note(Duration::from_millis(7));
        }
        let found = times.percentiles().unwrap();
        assert!((found.max_ms - 7.0).abs() < 1e-9 && (found.median_ms - 7.0).abs() < 1e-9);
    }
}
