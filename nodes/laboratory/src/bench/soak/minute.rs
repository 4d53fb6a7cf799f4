//! The figures of one minute.

use estimation::quantile::{median, percentile_of_sorted};
use serde::Serialize;

use super::suite::Held;

/// A minute's length, in seconds.
pub(super) const LENGTH_S: f64 = 60.0;

/// The minutes so far.
#[derive(Debug, Default)]
pub(super) struct Minutes {
    pub(super) current: Minute,
    rows: Vec<MinuteRow>,
}

impl Minutes {
    /// The current minute is over; returns how many are.
    pub(super) fn end(&mut self) -> usize {
        let number = self.rows.len() + 1;
        self.rows.extend(std::mem::take(&mut self.current).row(number));
        self.rows.len()
    }

    /// The completed ones; of a shorter run what there is.
    pub(super) fn rows(mut self) -> Vec<MinuteRow> {
        if self.rows.is_empty() {
            self.end();
        }
        self.rows
    }
}

/// The current minute.
#[derive(Clone, Debug, Default)]
pub(super) struct Minute {
    ages_ms: Vec<f64>,
    held: Vec<Held>,
    pub(super) dropped: usize,
    pub(super) voxels: u64,
}

/// A completed minute.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct MinuteRow {
    /// Counted from 1.
    pub(super) minute: usize,
    /// Cycles that came into the map.
    pub(super) cycles: usize,
    /// Cycles that a stage dropped.
    pub(super) dropped: usize,
    /// From the stamp of a cycle's image to the report of the map.
    pub(super) age_median_ms: f64,
    pub(super) age_p99_ms: f64,
    /// Of the map.
    pub(super) voxels: u64,
    /// Of all cores together: 1 is one core.
    pub(super) cores: f64,
    /// The median of the minute, as the two below.
    pub(super) rss_bytes: u64,
    pub(super) descriptors: usize,
    pub(super) threads: usize,
}

impl Minute {
    /// A cycle came into the map, with this age.
    pub(super) fn push(&mut self, age_s: f64) {
        self.ages_ms.push(age_s * 1e3);
    }

    /// What the process holds now.
    pub(super) fn note(&mut self, held: Held) {
        self.held.push(held);
    }

    /// The minute as a row; `None` where nothing was noted or no cycle came.
    pub(super) fn row(mut self, minute: usize) -> Option<MinuteRow> {
        self.ages_ms.sort_by(f64::total_cmp);
        let of = |value: fn(&Held) -> f64| median(self.held.iter().map(value));
        let (first, last) = (self.held.first()?, self.held.last()?);
        let watched_s = last.at.duration_since(first.at).as_secs_f64();
        let spent_s = last.cpu_s - first.cpu_s;
        Some(MinuteRow {
            minute,
            cycles: self.ages_ms.len(),
            dropped: self.dropped,
            age_median_ms: percentile_of_sorted(&self.ages_ms, 50)?,
            age_p99_ms: percentile_of_sorted(&self.ages_ms, 99)?,
            voxels: self.voxels,
            cores: if watched_s > 0.0 { spent_s / watched_s } else { 0.0 },
            rss_bytes: of(|held| held.rss_bytes as f64)? as u64,
            descriptors: of(|held| held.descriptors as f64)? as usize,
            threads: of(|held| held.threads as f64)? as usize,
        })
    }
}

impl MinuteRow {
    pub(super) const NAMES: [&'static str; 10] = [
        "minute",
        "cycles",
        "dropped",
        "age ms",
        "p99 ms",
        "voxels",
        "cores",
        "RSS MB",
        "open files",
        "threads",
    ];

    /// In the order of [`MinuteRow::NAMES`].
    pub(super) fn cells(&self) -> Vec<String> {
        vec![
            self.minute.to_string(),
            self.cycles.to_string(),
            self.dropped.to_string(),
            format!("{:.0}", self.age_median_ms),
            format!("{:.0}", self.age_p99_ms),
            self.voxels.to_string(),
            format!("{:.2}", self.cores),
            format!("{:.1}", self.rss_bytes as f64 / 1e6),
            self.descriptors.to_string(),
            self.threads.to_string(),
        ]
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    /// A minute in which 420 cycles came into the map.
    pub(in super::super) fn a_minute(minute: usize) -> MinuteRow {
        let start = Instant::now();
        let mut cycles = Minute { dropped: 1, voxels: 7, ..Minute::default() };
        for index in 0..420 {
            cycles.push(0.02 + f64::from(index) * 1e-5);
        }
        for index in 0..3 {
            cycles.note(Held {
                at: start + Duration::from_secs(index * 5),
                cpu_s: 2.0 * index as f64,
                rss_bytes: 100_000_000 + index * 1_000_000,
                descriptors: 700,
                threads: 29,
            });
        }
        cycles.row(minute).unwrap()
    }

    #[test]
    fn a_minute_is_told_by_its_middle_and_its_late_cycles() {
        let row = a_minute(3);
        assert_eq!((row.minute, row.cycles, row.dropped, row.voxels), (3, 420, 1, 7));
        assert!((row.age_median_ms - 22.09).abs() < 1e-6, "{row:?}");
        assert!((row.age_p99_ms - 24.15).abs() < 1e-6, "{row:?}");
        assert!((row.cores - 0.4).abs() < 1e-9, "{row:?}");
        assert_eq!((row.rss_bytes, row.descriptors, row.threads), (101_000_000, 700, 29));
        assert_eq!(row.cells().len(), MinuteRow::NAMES.len());
    }

    #[test]
    fn a_minute_without_a_cycle_is_none() {
        assert_eq!(Minute::default().row(1), None);
    }
}
