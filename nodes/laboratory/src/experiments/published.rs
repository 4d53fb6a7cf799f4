//! The figures of the thesis (Rec-HV), each with its section or table: tables are in `published.yaml`, single figures are here.
//! The lines are those of the text in `shared/seeds/000_453d88d75f732666.txt`, which has its decimals with a comma.

use serde::Deserialize;
use simulator::SceneName;

use super::scenarios::Direction;
use crate::published_file::{PublishedFile, of_yaml};

/// `published.yaml`.
pub(crate) static TABLES: PublishedFile<Tables> =
    PublishedFile::new("experiments/published.yaml", || of_yaml(include_str!("published.yaml")));

/// The published tables that are compared with ours.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Tables {
    /// Table 4, of experiment 2.
    pub(crate) gap_fill: Vec<FilledPiece>,
    /// Tables 5 and 6, of experiment 8.
    pub(crate) everyday: Vec<EverydayRow>,
    /// Table 7, of experiment 9.
    pub(crate) centroid: CentroidRuns,
    /// Table 8, of experiment 10.
    pub(crate) rail: Vec<RailAxis>,
}

/// A piece of a scan in beams of one degree.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FilledPiece {
    pub(crate) name: String,
    /// The angle from the y axis of the first of them.
    pub(crate) first_deg: f64,
    /// The measured range; `None` for Inf.
    pub(crate) read_m: Vec<Option<f32>>,
    /// The filled range of the thesis.
    pub(crate) filled_m: Vec<f32>,
}

/// A row of Table 5 and of Table 6.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EverydayRow {
    pub(crate) scene: SceneName,
    pub(crate) cycle_ms: f64,
    pub(crate) points: f64,
    pub(crate) reduction: f64,
    pub(crate) cycles_with_high_variability: f64,
    pub(crate) angle_stage: f64,
    pub(crate) depth_stage: f64,
    pub(crate) first_map: f64,
    pub(crate) last_map: f64,
    pub(crate) growth: f64,
}

/// The crossings of Table 7.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CentroidRuns {
    pub(crate) left_to_right: CentroidSide,
    pub(crate) right_to_left: CentroidSide,
}

impl CentroidRuns {
    pub(crate) fn side(&self, direction: Direction) -> &CentroidSide {
        match direction {
            Direction::LeftToRight => &self.left_to_right,
            Direction::RightToLeft => &self.right_to_left,
        }
    }
}

/// The runs of a direction, and their mean as printed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CentroidSide {
    pub(crate) runs: Vec<CentroidRun>,
    pub(crate) mean: CentroidRun,
}

/// A run: the largest error, the mean one, the root of the mean square.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CentroidRun {
    pub(crate) max_m: f64,
    pub(crate) mean_m: f64,
    pub(crate) rmse_m: f64,
}

/// An axis of the rail: the largest error, the mean one, the root of the mean square, the deviation.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RailAxis {
    pub(crate) axis: String,
    pub(crate) errors_m: [f64; 4],
}

/// Cycles of a test of most experiments (3.1.2 to 3.1.9, lines 414 to 482).
pub(crate) const CYCLES_OF_A_TEST: usize = 25;

/// Experiment 1 (4.1, line 924; 5.1, line 1337).
pub(crate) mod raw_ranges {
    /// Cycles of scene B with at least one beam without a return, of 500.
    pub(crate) const CYCLES_WITH_GAPS: f64 = 0.944;
    /// The mean number of such beams per cycle.
    pub(crate) const GAP_BEAMS: f64 = 8.0;
}

/// Experiment 2 (4.2, lines 932 to 965).
pub(crate) mod gap_fill {
    /// Cycles with gaps after the fill, of 500.
    pub(crate) const CYCLES_WITH_GAPS: f64 = 0.0;

    /// The thesis on a window of n scans (4.2, line 986; 5.2, lines 1345 to 1347).
    pub(crate) fn judgement(window_scans: usize) -> &'static str {
        match window_scans {
            2 => "edges hardly stand out",
            3 => "clear: chosen",
            4 => "clear",
            _ => "shape and place suffer",
        }
    }
}

/// Experiment 3 (4.3, line 997): the least and the largest deviation, n = 3.
pub(crate) mod deviations {
    pub(crate) const A_EMPTY_M: (f64, f64) = (0.000_798, 0.042_309);
    pub(crate) const A_ROBOT_MAX_M: f64 = 0.572_288;
    pub(crate) const B_EMPTY_M: (f64, f64) = (0.001_595, 0.490_999);
    pub(crate) const B_ROBOT_MAX_M: f64 = 1.053_558;
}

/// Experiment 4 (4.4, lines 1021 to 1023; discussed in 5.1, line 1359).
pub(crate) mod voxel_edge {
    /// A cycle without the voxel grid.
    pub(crate) const UNREDUCED_MS: f64 = 4210.0;
    /// The least time of a cycle, whatever the edge: the turn of the scanner.
    pub(crate) const LEAST_MS: f64 = 142.0;
}

/// Experiment 5 (4.5, line 1032).
pub(crate) mod found {
    pub(crate) const SHARE: f64 = 1.0;
    pub(crate) const CYCLES_LEFT_TO_RIGHT: f64 = 23.0;
    pub(crate) const CYCLES_RIGHT_TO_LEFT: f64 = 25.0;
}

/// Experiment 6 (discussed in 5.2, line 1369).
pub(crate) mod two_stages {
    pub(crate) const MOST_POINTS_IN_ZONE: f64 = 670.0;
    /// "More than".
    pub(crate) const SHARE_IN_ZONE: f64 = 0.6;
    pub(crate) const DYNAMIC_POINTS: f64 = 40.0;
    pub(crate) const DYNAMIC_SHARE: f64 = 0.05;
}

/// Experiment 7 (4.7, line 1145).
pub(crate) mod correlation {
    /// The mean over 10 runs of 25 cycles.
    pub(crate) const MEAN: f64 = 0.8643;
}

/// Experiment 11 (4.11, lines 1290 to 1321; 5.7, lines 1419 to 1427).
pub(crate) mod tour {
    pub(crate) const CYCLES: f64 = 407.0;
    pub(crate) const CYCLE_MS: f64 = 151.0;
    pub(crate) const FIRST_MAP: f64 = 188.0;
    pub(crate) const LAST_MAP: f64 = 3500.0;
    pub(crate) const CORRELATION: f64 = 0.943;
    pub(crate) const CYCLES_WITH_HIGH_VARIABILITY: f64 = 0.83;
    pub(crate) const CYCLES_NOT_REMOVED: f64 = 2.0;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(runs: &[CentroidRun], of: fn(&CentroidRun) -> f64) -> f64 {
        runs.iter().map(of).sum::<f64>() / runs.len() as f64
    }

    #[test]
    fn the_means_of_table_7_are_those_of_its_rows() {
        let table = &TABLES.get().unwrap().centroid;
        for side in [&table.left_to_right, &table.right_to_left] {
            assert_eq!(side.runs.len(), 5);
            let columns: [fn(&CentroidRun) -> f64; 3] =
                [|run| run.mean_m, |run| run.rmse_m, |run| run.max_m];
            for of in columns {
                let printed = of(&side.mean);
                assert!((mean(&side.runs, of) - printed).abs() < 2.1e-4, "{printed} printed");
            }
        }
    }

    #[test]
    fn the_growth_of_table_6_is_that_of_its_maps() {
        let rows = &TABLES.get().unwrap().everyday;
        assert_eq!(rows.len(), 5);
        for row in rows {
            let growth = row.last_map / row.first_map - 1.0;
            assert!((growth - row.growth).abs() < 0.006, "{}: {growth}", row.scene);
        }
    }

    #[test]
    fn table_4_fills_every_gap_and_keeps_every_return() {
        for piece in &TABLES.get().unwrap().gap_fill {
            assert_eq!(piece.read_m.len(), piece.filled_m.len());
            for (read_m, filled_m) in piece.read_m.iter().zip(&piece.filled_m) {
                assert!(read_m.is_none_or(|read_m| read_m == *filled_m));
            }
        }
    }
}
