//! The figures of the thesis (Rec-HV), each with its section or table. The lines are those of the text in
//! `shared/seeds/000_453d88d75f732666.txt`, which has its decimals with a comma.

/// Cycles of a test of most experiments (3.1.2 to 3.1.9, lines 414 to 482).
pub(crate) const CYCLES_OF_A_TEST: usize = 25;

/// Experiment 1 (4.1, line 924; 5.1, line 1337).
pub(crate) mod raw_ranges {
    /// Cycles of scene B with at least one beam without a return, of 500.
    pub(crate) const CYCLES_WITH_GAPS: f64 = 0.944;
    /// Such beams a cycle, on the mean.
    pub(crate) const GAP_BEAMS: f64 = 8.0;
}

/// Experiment 2 (4.2, Table 4, lines 932 to 965).
pub(crate) mod gap_fill {
    /// Cycles with gaps after the fill, of 500.
    pub(crate) const CYCLES_WITH_GAPS: f64 = 0.0;

    /// A piece of a scan in beams of one degree.
    pub(crate) struct Piece {
        pub(crate) name: &'static str,
        /// The angle from the y axis of the first of them: 1.588 rad and 2.199 rad.
        pub(crate) first_deg: f64,
        /// What was read; `None` for Inf.
        pub(crate) read_m: &'static [Option<f32>],
        /// What the thesis made of it.
        pub(crate) filled_m: &'static [f32],
    }

    const INF: Option<f32> = None;

    /// Table 4.
    pub(crate) const PIECES: [Piece; 2] = [
        Piece {
            name: "4A, between returns",
            first_deg: 91.0,
            read_m: &[
                Some(3.697),
                INF,
                Some(2.889),
                Some(2.891),
                INF,
                INF,
                INF,
                INF,
                INF,
                Some(3.722),
            ],
            filled_m: &[3.697, 3.293, 2.889, 2.891, 3.030, 3.168, 3.306, 3.445, 3.583, 3.722],
        },
        Piece {
            name: "4B, at the end",
            first_deg: 126.0,
            read_m: &[Some(4.502), Some(4.576), INF, INF, INF, INF, INF, INF, INF, INF],
            filled_m: &[4.502, 4.576, 4.650, 4.724, 4.798, 4.872, 4.946, 5.020, 5.094, 5.168],
        },
    ];

    /// What the thesis says of a window of n scans (4.2, line 986; 5.2, lines 1345 to 1347).
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

/// Experiment 8 (4.8, lines 1168 to 1192).
pub(crate) mod everyday {
    use simulator::SceneName;

    /// A row of Table 5 and of Table 6.
    pub(crate) struct Row {
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

    /// Tables 5 and 6.
    pub(crate) const ROWS: [Row; 5] = [
        Row {
            scene: SceneName::D,
            cycle_ms: 144.0,
            points: 1658.0,
            reduction: 0.989,
            cycles_with_high_variability: 0.43,
            angle_stage: 0.19,
            depth_stage: 0.08,
            first_map: 1782.0,
            last_map: 2813.0,
            growth: 0.58,
        },
        Row {
            scene: SceneName::E,
            cycle_ms: 147.0,
            points: 2531.0,
            reduction: 0.985,
            cycles_with_high_variability: 0.32,
            angle_stage: 0.14,
            depth_stage: 0.05,
            first_map: 2492.0,
            last_map: 5349.0,
            growth: 1.15,
        },
        Row {
            scene: SceneName::F,
            cycle_ms: 151.0,
            points: 5623.0,
            reduction: 0.976,
            cycles_with_high_variability: 0.55,
            angle_stage: 0.31,
            depth_stage: 0.07,
            first_map: 6811.0,
            last_map: 13_237.0,
            growth: 0.94,
        },
        Row {
            scene: SceneName::G,
            cycle_ms: 150.0,
            points: 3429.0,
            reduction: 0.980,
            cycles_with_high_variability: 0.64,
            angle_stage: 0.40,
            depth_stage: 0.04,
            first_map: 3863.0,
            last_map: 7411.0,
            growth: 0.92,
        },
        Row {
            scene: SceneName::H,
            cycle_ms: 149.0,
            points: 1547.0,
            reduction: 0.993,
            cycles_with_high_variability: 0.47,
            angle_stage: 0.19,
            depth_stage: 0.08,
            first_map: 1532.0,
            last_map: 2716.0,
            growth: 0.77,
        },
    ];
}

/// Experiment 9 (4.9, Table 7, lines 1213 to 1233): five runs each on path A, and their means as printed.
pub(crate) mod centroid {
    /// A run: the largest error, the mean one, the root of the mean square.
    pub(crate) struct Run {
        pub(crate) max_m: f64,
        pub(crate) mean_m: f64,
        pub(crate) rmse_m: f64,
    }

    const fn run(max_m: f64, mean_m: f64, rmse_m: f64) -> Run {
        Run { max_m, mean_m, rmse_m }
    }

    pub(crate) const LEFT_TO_RIGHT: [Run; 5] = [
        run(0.2099, 0.0614, 0.0848),
        run(0.1088, 0.0535, 0.0592),
        run(0.1396, 0.0562, 0.0701),
        run(0.1171, 0.0459, 0.0562),
        run(0.1445, 0.0624, 0.0756),
    ];
    pub(crate) const RIGHT_TO_LEFT: [Run; 5] = [
        run(0.1323, 0.0628, 0.0726),
        run(0.1222, 0.0447, 0.0599),
        run(0.1261, 0.0658, 0.0778),
        run(0.1264, 0.0603, 0.0728),
        run(0.1199, 0.0568, 0.0686),
    ];
    pub(crate) const LEFT_TO_RIGHT_MEAN: Run = run(0.1440, 0.0559, 0.0692);
    pub(crate) const RIGHT_TO_LEFT_MEAN: Run = run(0.1254, 0.0581, 0.0704);
}

/// Experiment 10 (4.10, Table 8, lines 1262 to 1268).
pub(crate) mod rail {
    /// An axis: the largest error, the mean one, the root of the mean square, the deviation.
    pub(crate) struct Axis {
        pub(crate) name: &'static str,
        pub(crate) errors_m: [f64; 4],
    }

    pub(crate) const AXES: [Axis; 3] = [
        Axis { name: "x", errors_m: [0.0535, 0.0124, 0.0188, 0.0176] },
        Axis { name: "y", errors_m: [0.0152, 0.0026, 0.0036, 0.0026] },
        Axis { name: "z", errors_m: [0.0160, 0.0026, 0.0037, 0.0027] },
    ];
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

    fn mean(runs: &[centroid::Run], of: fn(&centroid::Run) -> f64) -> f64 {
        runs.iter().map(of).sum::<f64>() / runs.len() as f64
    }

    #[test]
    fn the_means_of_table_7_are_those_of_its_rows() {
        for (rows, printed) in [
            (&centroid::LEFT_TO_RIGHT, &centroid::LEFT_TO_RIGHT_MEAN),
            (&centroid::RIGHT_TO_LEFT, &centroid::RIGHT_TO_LEFT_MEAN),
        ] {
            let columns: [fn(&centroid::Run) -> f64; 3] =
                [|run| run.mean_m, |run| run.rmse_m, |run| run.max_m];
            for of in columns {
                assert!((mean(rows, of) - of(printed)).abs() < 2.1e-4, "{} printed", of(printed));
            }
        }
    }

    #[test]
    fn the_growth_of_table_6_is_that_of_its_maps() {
        for row in everyday::ROWS {
            let growth = row.last_map / row.first_map - 1.0;
            assert!((growth - row.growth).abs() < 0.006, "{}: {growth}", row.scene);
        }
    }

    #[test]
    fn table_4_fills_every_gap_and_keeps_every_return() {
        for piece in gap_fill::PIECES {
            assert_eq!(piece.read_m.len(), piece.filled_m.len());
            for (read_m, filled_m) in piece.read_m.iter().zip(piece.filled_m) {
                assert!(read_m.is_none_or(|read_m| read_m == *filled_m));
            }
        }
    }
}
