//! Mean and deviation of each beam over the moving window (Rec-HV 3.2.1.2, eq. 2 to 4).

use std::collections::VecDeque;

/// Mean and deviation of each beam over the window.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct BeamStatistics {
    /// The mean range of each beam (eq. 2).
    pub mean_m: Vec<f32>,
    /// The population deviation of each beam's range, dr (eq. 3).
    pub std_dev_m: Vec<f32>,
}

/// The ranges of the last n scans.
#[derive(Clone, Debug)]
pub struct VariabilityWindow {
    window_scans: usize,
    scans: VecDeque<Vec<f32>>,
}

impl VariabilityWindow {
    /// An empty window for `window_scans` scans (taken as 1 when 0): the thesis' n.
    #[must_use]
    pub fn new(window_scans: usize) -> Self {
        Self { window_scans: window_scans.max(1), scans: VecDeque::new() }
    }

    /// Adds the filled ranges of the next scan; a full window drops the oldest scan. A scan with another number of beams
    /// empties the window first.
    pub fn push(&mut self, ranges_m: Vec<f32>) {
        if self.scans.back().is_some_and(|newest| newest.len() != ranges_m.len()) {
            self.clear();
        }
        if self.scans.len() == self.window_scans {
            self.scans.pop_front();
        }
        self.scans.push_back(ranges_m);
    }

    /// Forgets all scans.
    pub fn clear(&mut self) {
        self.scans.clear();
    }

    /// How many scans it holds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.scans.len()
    }

    /// Whether it holds no scan.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.scans.is_empty()
    }

    /// Mean and deviation of each beam (eq. 2, 3), or `None` until the window is full: over fewer scans
    /// the deviation means something else, and the threshold was measured for n.
    #[must_use]
    pub fn statistics(&self) -> Option<BeamStatistics> {
        if self.scans.len() < self.window_scans {
            return None;
        }
        let beams = self.scans.front().map_or(0, Vec::len);
        let share = 1.0 / self.window_scans as f64;
        let mut statistics = BeamStatistics {
            mean_m: Vec::with_capacity(beams),
            std_dev_m: Vec::with_capacity(beams),
        };
        for beam in 0..beams {
            let ranges = || self.scans.iter().map(|scan| f64::from(scan[beam]));
            let mean_m = share * ranges().sum::<f64>();
            let variance_m2 = share * ranges().map(|range| (range - mean_m).powi(2)).sum::<f64>();
            statistics.mean_m.push(mean_m as f32);
            statistics.std_dev_m.push(variance_m2.sqrt() as f32);
        }
        Some(statistics)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn mean_and_population_deviation_by_hand() {
        let mut window = VariabilityWindow::new(3);
        // Constant; a step of 3 m in the last scan; 1, 2, 3.
        window.push(vec![2.0, 5.0, 1.0]);
        assert_eq!(window.statistics(), None);
        window.push(vec![2.0, 5.0, 2.0]);
        assert_eq!(window.statistics(), None);
        window.push(vec![2.0, 2.0, 3.0]);
        let statistics = window.statistics().unwrap();
        assert_eq!(statistics.mean_m, [2.0, 4.0, 2.0]);
        // (1 + 1 + 4) / 3 = 2 and (1 + 0 + 1) / 3 = 2 / 3: divided by n, not by n - 1.
        assert_eq!(statistics.std_dev_m, [0.0, 2f32.sqrt(), (2f32 / 3.0).sqrt()]);
    }

    #[test]
    fn the_oldest_scan_leaves() {
        let mut window = VariabilityWindow::new(3);
        for range_m in [100.0, 4.0, 4.0, 4.0] {
            window.push(vec![range_m]);
        }
        let statistics = window.statistics().unwrap();
        assert_eq!((statistics.mean_m, statistics.std_dev_m), (vec![4.0], vec![0.0]));
    }

    #[test]
    fn another_number_of_beams_starts_the_window_anew() {
        let mut window = VariabilityWindow::new(2);
        window.push(vec![1.0, 1.0]);
        window.push(vec![1.0, 1.0, 1.0]);
        assert_eq!((window.len(), window.statistics()), (1, None));
    }

    proptest! {
        #[test]
        fn the_deviation_is_within_half_of_the_spread(
            scans in prop::collection::vec(prop::array::uniform4(0.0f32..8.0), 3..9),
        ) {
            let mut window = VariabilityWindow::new(3);
            for scan in &scans {
                window.push(scan.to_vec());
            }
            let statistics = window.statistics().unwrap();
            for beam in 0..4 {
                let last: Vec<f32> = scans.iter().rev().take(3).map(|scan| scan[beam]).collect();
                let least = last.iter().copied().fold(f32::INFINITY, f32::min);
                let most = last.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                prop_assert!((least - 1e-5..=most + 1e-5).contains(&statistics.mean_m[beam]));
                prop_assert!(statistics.std_dev_m[beam] <= 0.5 * (most - least) + 1e-5);
            }
        }
    }
}
