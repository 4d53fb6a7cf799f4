//! The size of the experiments.

use simulator::{CrossingObject, PathName, Scenario, SceneName};

/// The size of each experiment. [`Settings::new`] has the counts of the thesis.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Settings {
    /// Runs per experiment, for those with several; each has its own seed.
    pub(crate) seeds: u64,
    /// The first seed.
    pub(crate) first_seed: u64,
    /// Scans of the experiments on raw ranges.
    pub(crate) raw_scans: usize,
    /// Lengths of the window, in scans.
    pub(crate) windows: Vec<usize>,
    /// Cycles of each edge of the sweep.
    pub(crate) sweep_cycles: usize,
    /// The edges of the sweep.
    pub(crate) sweep_edges_m: Vec<f64>,
    /// Cycles of the tour.
    pub(crate) tour_cycles: usize,
    /// The everyday scenes.
    pub(crate) everyday_scenes: Vec<SceneName>,
    /// The scenes of the acceptance table.
    pub(crate) scenes: Vec<SceneName>,
    /// The objects of the acceptance table.
    pub(crate) objects: Vec<CrossingObject>,
    /// The paths of the acceptance table.
    pub(crate) paths: Vec<PathName>,
    /// The size of the depth images, if it is not the camera's own.
    pub(crate) depth_size_px: Option<(usize, usize)>,
}

impl Settings {
    /// The counts of chapter 3.1 of the thesis, with this many seeds.
    pub(crate) fn new(seeds: u64) -> Self {
        Self {
            seeds,
            first_seed: 1,
            raw_scans: 500,
            windows: (2..=7).collect(),
            sweep_cycles: 100,
            sweep_edges_m: (5..=16).map(|centimetres| f64::from(centimetres) / 100.0).collect(),
            tour_cycles: 407,
            everyday_scenes: vec![
                SceneName::D,
                SceneName::E,
                SceneName::F,
                SceneName::G,
                SceneName::H,
            ],
            scenes: SceneName::ALL.to_vec(),
            objects: vec![CrossingObject::Robot, CrossingObject::Person],
            paths: vec![PathName::A, PathName::B, PathName::C],
            depth_size_px: None,
        }
    }

    /// The least for a check that everything works: one seed, few cycles, a quarter of the pixels.
    pub(crate) fn quick() -> Self {
        Self {
            seeds: 1,
            first_seed: 1,
            raw_scans: 70,
            windows: vec![2, 3, 7],
            sweep_cycles: 5,
            sweep_edges_m: vec![0.05, 0.08, 0.16],
            tour_cycles: 100,
            everyday_scenes: vec![SceneName::G],
            scenes: vec![SceneName::B],
            objects: vec![CrossingObject::Robot, CrossingObject::Person],
            paths: vec![PathName::A],
            depth_size_px: Some((320, 240)),
        }
    }

    pub(crate) fn is_quick(&self) -> bool {
        self.depth_size_px.is_some()
    }

    /// The seeds, in order.
    pub(crate) fn seeds(&self) -> impl Iterator<Item = u64> + use<> {
        self.first_seed..self.first_seed + self.seeds
    }

    /// A scenario with the image size of these settings.
    pub(crate) fn sized(&self, scenario: Scenario) -> Scenario {
        match self.depth_size_px {
            Some((width_px, height_px)) => scenario.with_depth_size(width_px, height_px),
            None => scenario,
        }
    }

    /// "3 runs".
    pub(crate) fn runs_text(&self) -> String {
        if self.seeds == 1 { "1 run".to_owned() } else { format!("{} runs", self.seeds) }
    }

    /// "seeds 1 to 3".
    pub(crate) fn seeds_text(&self) -> String {
        let first = self.first_seed;
        if self.seeds == 1 {
            format!("seed {first}")
        } else {
            format!("seeds {first} to {}", first + self.seeds - 1)
        }
    }
}
