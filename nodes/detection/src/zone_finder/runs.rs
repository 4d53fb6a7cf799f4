//! Runs of consecutive beams of high variability.

/// Consecutive beams of high variability, by their indices.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Run {
    pub(super) first: usize,
    pub(super) last: usize,
    /// The largest deviation.
    pub(super) peak_m: f32,
    /// The first beam that has it.
    pub(super) first_peak: usize,
    /// The last beam that has it.
    pub(super) last_peak: usize,
}

impl Run {
    pub(super) fn beams(&self) -> usize {
        self.last - self.first + 1
    }
}

/// The runs of beams whose deviation exceeds `threshold_m`, in the order of the beams.
pub(super) fn high_variability_runs(std_dev_m: &[f32], threshold_m: f32) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (index, &deviation_m) in std_dev_m.iter().enumerate() {
        if deviation_m <= threshold_m || deviation_m.is_nan() {
            continue;
        }
        match runs.last_mut() {
            Some(run) if run.last + 1 == index => {
                run.last = index;
                if deviation_m > run.peak_m {
                    run.peak_m = deviation_m;
                    run.first_peak = index;
                }
                if deviation_m >= run.peak_m {
                    run.last_peak = index;
                }
            }
            _ => runs.push(Run {
                first: index,
                last: index,
                peak_m: deviation_m,
                first_peak: index,
                last_peak: index,
            }),
        }
    }
    runs
}

/// The positions of the two runs with the largest deviations, dr_max1 and dr_max2, in the order of the
/// beams; of equal runs the earlier ones.
pub(super) fn largest_two(runs: &[Run]) -> Option<(usize, usize)> {
    let largest = |excluded: Option<usize>| {
        let mut best: Option<usize> = None;
        for (position, run) in runs.iter().enumerate() {
            if Some(position) != excluded && best.is_none_or(|best| run.peak_m > runs[best].peak_m)
            {
                best = Some(position);
            }
        }
        best
    };
    let first = largest(None)?;
    let second = largest(Some(first))?;
    Some((first.min(second), first.max(second)))
}
