//! What grows over the minutes of a run.

use std::fmt;

use estimation::quantile::median;
use serde::Serialize;

use super::minute::MinuteRow;

/// In a shorter run the noise of the memory's figures is larger than what is looked for.
pub(super) const LEAST_MINUTES: usize = 20;
/// The share of the minutes in which buffers fill and the map comes to its bound.
const WARM_UP: usize = 4;
/// More than this an hour is a leak.
const MOST_MB_PER_HOUR: f64 = 1.0;
const MINUTES_PER_HOUR: f64 = 60.0;

/// The change in an hour, without the first quarter of the run: the median of the slopes between any two minutes (Theil and
/// Sen), which a single large minute does not move.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(super) struct Drift {
    memory_mb_per_hour: f64,
    descriptors_per_hour: f64,
    threads_per_hour: f64,
    /// Of the p99 of the age of a cycle. It depends on what else the machine does.
    age_ms_per_hour: f64,
}

impl Drift {
    /// `None` for a short run.
    pub(super) fn of(minutes: &[MinuteRow]) -> Option<Self> {
        let settled = minutes.get(minutes.len() / WARM_UP..)?;
        if minutes.len() < LEAST_MINUTES {
            return None;
        }
        let slope = |value: fn(&MinuteRow) -> f64| {
            let pairs = settled
                .iter()
                .enumerate()
                .flat_map(|(index, from)| settled[index + 1..].iter().map(move |to| (from, to)));
            median(pairs.map(|(from, to)| {
                (value(to) - value(from)) / (to.minute - from.minute) as f64 * MINUTES_PER_HOUR
            }))
        };
        Some(Self {
            memory_mb_per_hour: slope(|row| row.rss_bytes as f64 / 1e6)?,
            descriptors_per_hour: slope(|row| row.descriptors as f64)?,
            threads_per_hour: slope(|row| row.threads as f64)?,
            age_ms_per_hour: slope(|row| row.age_p99_ms)?,
        })
    }

    /// What grows more than it may; `None` where nothing does.
    pub(super) fn growth(self) -> Option<String> {
        let grown = [
            (self.memory_mb_per_hour, MOST_MB_PER_HOUR, "the memory grows by", "MB"),
            // One of them now and then would do for a leak.
            (self.descriptors_per_hour, 0.0, "the open files grow by", "files"),
            (self.threads_per_hour, 0.0, "the threads grow by", "threads"),
        ];
        let told: Vec<String> = grown
            .into_iter()
            .filter(|(change, most, ..)| change > most)
            .map(|(change, _, what, unit)| format!("{what} {change:.1} {unit} an hour"))
            .collect();
        (!told.is_empty()).then(|| told.join(", "))
    }
}

/// `in an hour, after the first quarter: memory +0.31 MB, open files +0.0, threads +0.0, p99 of the age -1.2 ms`
impl fmt::Display for Drift {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "in an hour, after the first quarter: memory {:+.2} MB, open files {:+.1}, threads {:+.1}, \
             p99 of the age {:+.1} ms",
            self.memory_mb_per_hour,
            self.descriptors_per_hour,
            self.threads_per_hour,
            self.age_ms_per_hour
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::minute::tests::a_minute;
    use super::*;

    /// Forty minutes with what `change` makes of each.
    fn run(change: impl Fn(usize, &mut MinuteRow)) -> Drift {
        let minutes: Vec<MinuteRow> = (1..=40)
            .map(|minute| {
                let mut row = a_minute(minute);
                change(minute, &mut row);
                row
            })
            .collect();
        Drift::of(&minutes).unwrap()
    }

    #[test]
    fn a_leak_of_two_megabytes_an_hour_is_found_under_noise_ten_times_as_large() {
        let leaks = |leak_bytes: usize| {
            run(|minute, row| {
                let noise = minute * 7_919 % 400_000;
                row.rss_bytes += (minute * leak_bytes / 60 + noise) as u64;
            })
        };
        assert!((leaks(3_000_000).memory_mb_per_hour - 3.0).abs() < 0.6, "{}", leaks(3_000_000));
        let growth = leaks(3_000_000).growth().unwrap();
        assert!(growth.starts_with("the memory grows by"), "{growth}");
        assert_eq!(leaks(100_000).growth(), None, "{}", leaks(100_000));
    }

    #[test]
    fn what_fills_in_the_first_quarter_and_a_single_large_minute_are_no_leak() {
        let drift = run(|minute, row| {
            row.rss_bytes += 5_000_000 * minute.min(10) as u64;
            if minute == 40 {
                row.rss_bytes += 50_000_000;
                row.descriptors += 3;
            }
        });
        assert_eq!(drift.growth(), None, "{drift}");
    }

    #[test]
    fn descriptors_that_are_not_closed_and_threads_that_do_not_end_are_told() {
        let drift = run(|minute, row| {
            row.descriptors += minute / 2;
            row.threads += minute / 5;
        });
        let growth = drift.growth().unwrap();
        assert!(growth.contains("files an hour, the threads grow by"), "{growth}");
    }

    #[test]
    fn a_short_run_tells_nothing() {
        let minutes: Vec<_> = (1..LEAST_MINUTES).map(a_minute).collect();
        assert_eq!(Drift::of(&minutes), None);
        assert_eq!(Drift::of(&[]), None);
    }
}
