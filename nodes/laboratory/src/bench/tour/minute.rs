//! The cycle times of one minute, and the memory of the cores at its end.

use estimation::quantile::percentile_of_sorted;
use reconstruction::{Addition, SpillCounts};
use serde::Serialize;

/// The time of one cycle, from its inputs to the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct CycleCost {
    pub(super) wall_ms: f64,
    pub(super) cpu_ms: f64,
    pub(super) detection_ms: f64,
    pub(super) segmentation_ms: f64,
    pub(super) map_ms: f64,
}

/// The state of the cores at the end of a minute.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(super) struct Counts {
    /// Of the map.
    pub(super) voxels: usize,
    /// The memory of the map, by its own count.
    pub(super) map_bytes: usize,
    /// The tiles of the map; absent if none are spilled. `written` and `read` count from the start.
    pub(super) spill: Option<SpillCounts>,
    /// The evidence of segmentation; 0 where the method has none.
    pub(super) evidence_blocks: usize,
    /// Scans and images that wait for a match.
    pub(super) waiting: usize,
    /// The memory of the process, including the simulation; absent if the system does not report it.
    pub(super) rss_bytes: Option<u64>,
}

/// The cycles of the current minute.
#[derive(Clone, Debug, Default)]
pub(super) struct Minute {
    costs: Vec<CycleCost>,
    most_tracks: usize,
    dropped_voxels: usize,
    refused_points: usize,
    /// Scans without a matching image or pose.
    pub(super) scans_dropped: usize,
}

/// A completed minute.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct MinuteRow {
    /// Counted from 1.
    pub(super) minute: usize,
    pub(super) cycles: usize,
    pub(super) scans_dropped: usize,
    pub(super) wall_median_ms: f64,
    pub(super) wall_p99_ms: f64,
    pub(super) wall_max_ms: f64,
    pub(super) cpu_median_ms: f64,
    pub(super) cpu_p99_ms: f64,
    pub(super) detection_median_ms: f64,
    pub(super) segmentation_median_ms: f64,
    pub(super) map_median_ms: f64,
    pub(super) most_tracks: usize,
    pub(super) dropped_voxels: usize,
    pub(super) refused_points: usize,
    #[serde(flatten)]
    pub(super) counts: Counts,
}

impl Minute {
    pub(super) fn push(&mut self, cost: CycleCost, tracks: usize, addition: &Addition) {
        self.costs.push(cost);
        self.most_tracks = self.most_tracks.max(tracks);
        self.dropped_voxels += addition.dropped_voxels;
        self.refused_points += addition.refused_points;
    }

    /// The minute as a row; `None` without a cycle.
    pub(super) fn row(self, minute: usize, counts: Counts) -> Option<MinuteRow> {
        let sorted = |of: fn(&CycleCost) -> f64| {
            let mut values: Vec<f64> = self.costs.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let (wall, cpu) = (sorted(|cost| cost.wall_ms), sorted(|cost| cost.cpu_ms));
        let median = |of| percentile_of_sorted(&sorted(of), 50);
        Some(MinuteRow {
            minute,
            cycles: self.costs.len(),
            scans_dropped: self.scans_dropped,
            wall_median_ms: percentile_of_sorted(&wall, 50)?,
            wall_p99_ms: percentile_of_sorted(&wall, 99)?,
            wall_max_ms: percentile_of_sorted(&wall, 100)?,
            cpu_median_ms: percentile_of_sorted(&cpu, 50)?,
            cpu_p99_ms: percentile_of_sorted(&cpu, 99)?,
            detection_median_ms: median(|cost| cost.detection_ms)?,
            segmentation_median_ms: median(|cost| cost.segmentation_ms)?,
            map_median_ms: median(|cost| cost.map_ms)?,
            most_tracks: self.most_tracks,
            dropped_voxels: self.dropped_voxels,
            refused_points: self.refused_points,
            counts,
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    const COUNTS: Counts = Counts {
        voxels: 7,
        map_bytes: 700,
        spill: None,
        evidence_blocks: 0,
        waiting: 1,
        rss_bytes: None,
    };

    /// A minute of 101 cycles of which this is the median.
    pub(in super::super) fn a_minute(minute: usize, median_ms: f64) -> MinuteRow {
        let mut cycles = Minute::default();
        for index in 0..=100 {
            let wall_ms = median_ms + f64::from(index - 50) / 100.0;
            let cost = CycleCost {
                wall_ms,
                cpu_ms: wall_ms / 2.0,
                detection_ms: 1.0,
                segmentation_ms: 2.0,
                map_ms: 3.0,
            };
            let addition = Addition { dropped_voxels: 1, ..Addition::default() };
            cycles.push(cost, index as usize % 3, &addition);
        }
        cycles.row(minute, COUNTS).unwrap()
    }

    #[test]
    fn a_minute_is_told_by_its_median_and_its_slow_cycles() {
        let row = a_minute(3, 10.0);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert_eq!((row.minute, row.cycles, row.most_tracks, row.dropped_voxels), (3, 101, 2, 101));
        assert!(near(row.wall_median_ms, 10.0) && near(row.wall_p99_ms, 10.49), "{row:?}");
        assert!(near(row.wall_max_ms, 10.5) && near(row.cpu_median_ms, 5.0), "{row:?}");
        assert_eq!((row.detection_median_ms, row.map_median_ms), (1.0, 3.0));
        assert_eq!(Minute::default().row(1, COUNTS), None);
    }
}
