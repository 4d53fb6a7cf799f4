//! Comparison with evo 1.38.1 on the files of `tests/data/trajectory`; the README there says how its figures were made.

use geometry::Stamp;
use serde::Deserialize;

use super::{
    Alignment, Delta, Pairs, PairsFrom, RelativeConfig, Statistics, Trajectory,
    TrajectoryScoreConfig, parse_trajectory, score_trajectory,
};

/// Both are computed in double precision; evo's stamps and matrices are rounded otherwise.
const TOLERANCE: f64 = 1e-6;

const GOLDEN: &str = include_str!("../../../../../tests/data/trajectory/evo.json");

/// A configuration of evo, and its result.
#[derive(Deserialize, Debug)]
struct Case {
    reference: String,
    estimate: String,
    alignment: Alignment,
    of: Of,
    delta: Option<Delta>,
    pairs: Option<Pairs>,
    pairs_from: Option<PairsFrom>,
    period_s: Option<f64>,
    statistics: Statistics,
}

#[derive(Clone, Copy, Deserialize, Debug)]
#[serde(rename_all = "snake_case")]
enum Of {
    Translation,
    Rotation,
}

fn file(name: &str) -> Trajectory {
    let text: &[u8] = match name {
        "truth.tum" => include_bytes!("../../../../../tests/data/trajectory/truth.tum"),
        "estimate.tum" => include_bytes!("../../../../../tests/data/trajectory/estimate.tum"),
        "truth.kitti" => include_bytes!("../../../../../tests/data/trajectory/truth.kitti"),
        "estimate.kitti" => include_bytes!("../../../../../tests/data/trajectory/estimate.kitti"),
        "truth.euroc.csv" => include_bytes!("../../../../../tests/data/trajectory/truth.euroc.csv"),
        name => panic!("there is no file {name}"),
    };
    parse_trajectory(text).unwrap().trajectory
}

impl Case {
    fn ours(&self) -> Statistics {
        let config = TrajectoryScoreConfig {
            alignment: self.alignment,
            relative: RelativeConfig {
                deltas: self.delta.into_iter().collect(),
                pairs: self.pairs.unwrap_or_default(),
                pairs_from: self.pairs_from.unwrap_or_default(),
                ..RelativeConfig::default()
            },
            ..TrajectoryScoreConfig::default()
        };
        let [estimate, reference] = [&self.estimate, &self.reference].map(|name| {
            let trajectory = file(name);
            let Some(period_s) = self.period_s else { return trajectory };
            let stamp = |frame: usize| Stamp::default().plus_seconds(frame as f64 * period_s);
            let stamps: Vec<Stamp> = (0..trajectory.len()).map(stamp).collect();
            trajectory.with_stamps(&stamps).unwrap()
        });
        let score = score_trajectory(&estimate, &reference, &config).unwrap().score;
        let found = match (self.of, score.relative.first()) {
            (Of::Translation, None) => Some(score.absolute.translation_m),
            (Of::Rotation, None) => score.absolute.rotation_deg,
            (Of::Translation, Some(relative)) => relative.translation_m,
            (Of::Rotation, Some(relative)) => relative.rotation_deg,
        };
        found.unwrap()
    }
}

#[test]
fn the_statistics_are_those_of_evo() {
    let cases: Vec<Case> = serde_json::from_str(GOLDEN).unwrap();
    assert!(cases.len() > 40);
    for case in cases {
        let numbers = |of: Statistics| [of.rmse, of.mean, of.median, of.std, of.min, of.max];
        for (ours, evo) in numbers(case.ours()).into_iter().zip(numbers(case.statistics)) {
            assert!((ours - evo).abs() < TOLERANCE, "{ours} {evo} {case:?}");
        }
    }
}
