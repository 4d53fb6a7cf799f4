//! One scenario through all three nodes, by each method, with the results and the ground truth: the basis of
//! the experiments.

mod kept;
mod play;
#[cfg(test)]
mod tests;

use evaluation::{Correlation, correlation};
use geometry::{Method, Track, VoxelGrid};
use nalgebra::Point3;
use report::{DynamicScore, DynamicScoreRules, RunRecord};
use simulator::{ObjectPoses, Sample, Scenario};

use self::kept::Truth;
use self::play::{Message, Play};
use robot::{Failure, Interrupt};

/// How a scenario is run.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct TrialOptions {
    /// Each method sees the same samples.
    pub(crate) methods: Vec<Method>,
    /// Whether the map is compared with the empty scene after each cycle (Rec-HV 4.7), or only at the end.
    pub(crate) correlate_each_cycle: bool,
    /// Whether the truth of each pixel is kept and scored: it costs 1.2 MB per cycle.
    pub(crate) score_labels: bool,
    /// The edge of the voxels of the reduction and of the map, when it is not the default.
    pub(crate) voxel_edge_m: Option<f64>,
}

/// The results of one method on a scenario.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Trial {
    pub(crate) method: Method,
    pub(crate) scenario_name: String,
    pub(crate) seed: u64,
    /// The cycles and the final map.
    pub(crate) record: RunRecord,
    /// Against the labels of every pixel and the true surface; `None` when not requested.
    pub(crate) score: Option<DynamicScore>,
    /// One for each cycle of the record, in that order.
    pub(crate) cycles: Vec<TrialCycle>,
    /// The surface of the scene without moving objects: one point per voxel of the map's edge, in the map frame.
    pub(crate) empty_scene_m: Vec<Point3<f32>>,
    /// The final map against the empty scene; `None` when one of them has no points.
    pub(crate) correlation: Option<Correlation>,
}

impl Trial {
    /// What the method measures of a scene in which nothing moves: the map without removal where it is of the same kind as
    /// the map (means of voxels), and otherwise the map.
    pub(crate) fn undisturbed_map(&self) -> &[Point3<f32>] {
        match self.method {
            Method::RecHv => &self.record.unfiltered_map,
            Method::FreeSpace => &self.record.static_map,
        }
    }
}

/// The ground truth of a cycle and its results.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct TrialCycle {
    /// The poses of all objects of the scene, visible or not, at the stamp of the cycle's depth image.
    pub(crate) truth: ObjectPoses,
    /// The tracks that segmentation published for the cycle, in the map frame; none with `rec_hv`.
    pub(crate) tracks: Vec<Track>,
    /// The map so far against the empty scene, when requested.
    pub(crate) correlation: Option<Correlation>,
}

/// Runs a scenario by each method. Apart from the durations in the record, the results depend on the scenario and
/// the options alone. `None` when it was interrupted: part of a scenario is not a trial.
///
/// # Errors
/// When the scenario cannot be simulated, or a parameter is rejected.
pub(crate) fn run_trial(
    scenario: &Scenario,
    options: &TrialOptions,
    interrupt: &Interrupt,
) -> Result<Option<Vec<Trial>>, Failure> {
    let samples = scenario.samples().map_err(failure)?;
    let surface_m = scenario.static_scene_cloud().map_err(failure)?.points_m;
    let mut truth = Truth::new(options.score_labels);
    let mut plays = Vec::new();
    for &method in &options.methods {
        plays.push(Play::start(method, options, &surface_m)?);
    }
    for sample in samples {
        if interrupt.has_come() {
            return Ok(None);
        }
        let message = Message::of(&sample);
        truth.take(sample)?;
        for play in &mut plays {
            if let Some(message) = &message {
                play.take(message, &mut truth)?;
            }
        }
        truth.forget_before(plays.iter().map(Play::reached).min().flatten());
    }
    for play in &mut plays {
        play.end(&mut truth)?;
    }
    plays.into_iter().map(|play| play.finish(scenario, &truth).map(Some)).collect()
}

fn failure(error: impl std::fmt::Display) -> Failure {
    Failure::new(error.to_string())
}
