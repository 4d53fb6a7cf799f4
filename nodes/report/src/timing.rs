//! How long the steps of a cycle took.

use estimation::quantile::{median_of_sorted, percentile_of_sorted};
use serde::{Deserialize, Serialize};

use crate::CycleRecord;

const MILLISECONDS_PER_SECOND: f64 = 1e3;

/// The durations of a run. This is the only part of a summary that differs between two runs of the same
/// input.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Timing {
    /// The whole cycle: the sum of its steps.
    pub cycle: DurationStatistics,
    /// Each step, in the order in which the steps run.
    pub steps: Vec<StepTiming>,
}

/// The durations of one step.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct StepTiming {
    /// The step's name.
    pub step: String,
    /// Its durations.
    #[serde(flatten)]
    pub durations: DurationStatistics,
}

/// Statistics of a duration over the cycles that have it.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct DurationStatistics {
    /// Cycles that have it.
    pub cycles: usize,
    /// The middle one; the mean of the two middle ones of an even number.
    pub median_ms: f64,
    /// The smallest duration that 99 % of the cycles do not exceed (nearest rank): with fewer than 100
    /// cycles this is the longest.
    pub p99_ms: f64,
    /// The longest.
    pub max_ms: f64,
}

impl Timing {
    /// The statistics over `cycles`; none when no cycle has a duration. A duration that is negative or not
    /// finite is left out.
    #[must_use]
    pub fn of_cycles(cycles: &[CycleRecord]) -> Option<Self> {
        let mut steps: Vec<(&str, Vec<f64>)> = Vec::new();
        let mut totals_s = Vec::with_capacity(cycles.len());
        for cycle in cycles {
            let mut total_s = None;
            for (name, duration_s) in &cycle.step_durations_s {
                if !duration_s.is_finite() || *duration_s < 0.0 {
                    continue;
                }
                total_s = Some(total_s.unwrap_or(0.0) + duration_s);
                match steps.iter_mut().find(|(step, _)| step == name) {
                    Some((_, durations_s)) => durations_s.push(*duration_s),
                    None => steps.push((name, vec![*duration_s])),
                }
            }
            totals_s.extend(total_s);
        }
        let steps = steps
            .into_iter()
            .filter_map(|(step, durations_s)| {
                let durations = DurationStatistics::of_seconds(durations_s)?;
                Some(StepTiming { step: step.to_owned(), durations })
            })
            .collect();
        Some(Self { cycle: DurationStatistics::of_seconds(totals_s)?, steps })
    }
}

impl DurationStatistics {
    /// The statistics of durations in any order, in seconds; none of none.
    #[must_use]
    pub fn of_seconds(mut durations_s: Vec<f64>) -> Option<Self> {
        durations_s.sort_by(f64::total_cmp);
        let cycles = durations_s.len();
        let at =
            |percent| Some(percentile_of_sorted(&durations_s, percent)? * MILLISECONDS_PER_SECOND);
        Some(Self {
            cycles,
            median_ms: median_of_sorted(&durations_s)? * MILLISECONDS_PER_SECOND,
            p99_ms: at(99)?,
            max_ms: at(100)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run_record::tests::cycle;

    fn cycle_with(index: u32, steps: &[(&str, f64)]) -> CycleRecord {
        CycleRecord {
            step_durations_s: steps.iter().map(|(name, s)| ((*name).to_owned(), *s)).collect(),
            ..cycle(index)
        }
    }

    #[test]
    fn median_p99_and_max_are_those_of_a_hand_computed_run() {
        // Durations 1 .. 200 ms: median 100.5, the 198th is the 99th percentile.
        let cycles: Vec<_> = (0..200_u32)
            .map(|index| cycle_with(index, &[("a", f64::from(200 - index) * 1e-3)]))
            .collect();
        let timing = Timing::of_cycles(&cycles).unwrap();
        let durations = timing.steps[0].durations;
        assert_eq!(durations.cycles, 200);
        assert!((durations.median_ms - 100.5).abs() < 1e-9);
        assert!((durations.p99_ms - 198.0).abs() < 1e-9);
        assert!((durations.max_ms - 200.0).abs() < 1e-9);
    }

    #[test]
    fn the_cycle_is_the_sum_of_its_steps_and_steps_keep_their_order() {
        let cycles = [
            cycle_with(0, &[("z", 0.001), ("a", 0.002)]),
            cycle_with(1, &[("z", 0.003), ("m", 0.004), ("a", f64::NAN)]),
            cycle_with(2, &[]),
        ];
        let timing = Timing::of_cycles(&cycles).unwrap();
        let names: Vec<_> = timing.steps.iter().map(|step| step.step.as_str()).collect();
        assert_eq!(names, ["z", "a", "m"]);
        assert_eq!(timing.steps[1].durations.cycles, 1);
        assert_eq!(timing.cycle.cycles, 2);
        assert!((timing.cycle.median_ms - 5.0).abs() < 1e-9);
        assert!((timing.cycle.max_ms - 7.0).abs() < 1e-9);
    }

    #[test]
    fn a_run_without_durations_has_no_timing() {
        assert_eq!(Timing::of_cycles(&[]), None);
        assert_eq!(Timing::of_cycles(&[cycle_with(0, &[])]), None);
    }
}
