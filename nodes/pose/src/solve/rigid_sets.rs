//! Separates the static scene from moving objects.
//!
//! A thing that moves is rigid too, and may fill most of the image: the largest set of points that agree on a pose need not
//! be the room. The sets are found one after the other (sequential RANSAC: Torr 1998), and the background is chosen among them by
//! their sizes and by how well the prediction agrees with each. What the prediction explains is looked for before all others.
//!
//! A thing is one event however many features lie on it. The squared errors of features must not be added to that of the
//! prediction as if every feature of the thing had gone wrong by itself: a few more features would outweigh any
//! prediction. Sizes count by a power of their ratio instead ([`RigidSetsConfig::size_power`]).

#[cfg(test)]
mod tests;

use estimation::chi_square::quantile;
use estimation::perturbation::left::{adjoint, perturbation_between};
use geometry::CameraModel;
use nalgebra::Matrix6;

use super::config::{FirstRound, RefineConfig, RigidSetsConfig};
use super::observation::{LineObservation, PointObservation, Verdict};
use super::ransac::{PnpError, Search};
use super::refine::{PoseError, PoseEstimate, PoseGuess, Problem, Uses, check_camera};

/// The coordinates of a pose.
const COORDINATES: usize = 6;

/// Observations that agree on a pose.
#[derive(Clone, PartialEq, Debug)]
pub struct RigidSet {
    /// The camera's pose, were this set the background. Its verdicts are on all observations that no set before has.
    pub pose: PoseEstimate,
    /// The points that belong to it. One whose place in the image fits but not its depth does not: something that comes
    /// towards the camera looks so.
    pub points: Vec<usize>,
    /// The lines that belong to it, likewise.
    pub lines: Vec<usize>,
    /// The squared distance of its pose from the prediction, in standard deviations of both; `None` without a prediction.
    pub distance2: Option<f64>,
}

/// The observations, split.
#[derive(Clone, PartialEq, Debug)]
pub struct RigidSplit {
    /// The set that the camera's pose is to be taken from.
    pub background: RigidSet,
    /// The sets that moved otherwise: the largest first.
    pub others: Vec<RigidSet>,
    /// Whether the background is where the prediction has it; `None` without a covariance of the prediction.
    pub as_predicted: Option<bool>,
}

/// Splits the observations into sets that move alike and says which of these is the background.
///
/// A prediction without a covariance says nothing: the largest set is the background then. `refine` says how poses are refined, but
/// for its `first_round` and `keep_without_depth`.
///
/// # Errors
/// When the camera, the prediction or a parameter cannot be used, and when no set is large enough.
pub fn split_rigid_sets(
    camera: &CameraModel,
    prediction: Option<&PoseGuess>,
    points: &[PointObservation],
    lines: &[LineObservation],
    config: &RigidSetsConfig,
    refine: &RefineConfig,
) -> Result<RigidSplit, PnpError> {
    config.validate().and_then(|()| refine.validate()).map_err(PoseError::from)?;
    check_camera(camera)?;
    prediction.map_or(Ok(()), PoseGuess::check)?;
    let refine = RefineConfig {
        first_round: FirstRound::FitsGuess,
        // An object that approaches the camera would be taken for the static scene.
        keep_without_depth: false,
        ..*refine
    };
    let problem = Problem::new(camera, points, lines, &refine);
    let mut left = problem.usable();
    let usable_points = left.points.iter().filter(|verdict| verdict.is_inlier()).count();
    let (mut sets, mut failure) = (Vec::new(), None);
    // What the prediction explains comes first, before a set that mixes a part of it with something else.
    if let Some(prediction) = prediction.filter(|prediction| prediction.covariance.is_some()) {
        let near = problem.estimate(prediction).ok();
        let large = |pose: &PoseEstimate| pose.point_inliers() >= config.ransac.min_inliers;
        let set = near.filter(large).map(|pose| RigidSet::new(pose, &mut left, Some(prediction)));
        sets.extend(set);
    }
    while sets.len() < config.max_sets {
        match next_set(camera, points, &problem, &left, config) {
            Ok(pose) => {
                let set = RigidSet::new(pose, &mut left, prediction);
                sets.push(set);
            }
            Err(reason) => {
                failure = Some(reason);
                break;
            }
        }
    }
    let least = config.min_background_share * usable_points as f64;
    let Some(chosen) = background(&sets, least, config) else {
        let (needed, usable) = (config.ransac.min_inliers, usable_points);
        let nothing = PnpError::TooFewPoints { usable, points: points.len(), needed };
        return Err(failure.unwrap_or(nothing));
    };
    let first = sets.remove(chosen);
    sets.sort_by_key(|set| std::cmp::Reverse(set.points.len()));
    let (background, others) = shared_out(&problem, first, sets, prediction, config);
    let as_predicted = background.distance2.map(|distance2| distance2 < gate(config));
    Ok(RigidSplit { background, others, as_predicted })
}

/// Whether a pose is farther from the prediction than this share of right ones; `false` without a covariance of the
/// prediction.
#[must_use]
pub fn is_surprising(
    prediction: &PoseGuess,
    pose: &PoseEstimate,
    config: &RigidSetsConfig,
) -> bool {
    distance2(prediction, pose).is_some_and(|distance2| distance2 > gate(config))
}

/// Gives each set what it explains, the background first: a set that was found before it may hold a part of it, which
/// another pose explains by chance.
fn shared_out(
    problem: &Problem<'_>,
    background: RigidSet,
    others: Vec<RigidSet>,
    prediction: Option<&PoseGuess>,
    config: &RigidSetsConfig,
) -> (RigidSet, Vec<RigidSet>) {
    let mut left = problem.usable();
    let mut again = |set: &RigidSet| {
        let camera_from_map = set.pose.camera_from_map;
        let guess = PoseGuess { camera_from_map, covariance: None };
        let pose = problem.only(&left).estimate(&guess).ok()?;
        let enough = pose.point_inliers() >= config.ransac.min_inliers;
        enough.then(|| RigidSet::new(pose, &mut left, prediction))
    };
    let background = again(&background).unwrap_or(background);
    (background, others.iter().filter_map(again).collect())
}

/// The largest set of what is left.
fn next_set(
    camera: &CameraModel,
    points: &[PointObservation],
    problem: &Problem<'_>,
    left: &Uses,
    config: &RigidSetsConfig,
) -> Result<PoseEstimate, PnpError> {
    let best = Search::new(camera, points, problem, left, &config.ransac)?.run();
    let guess = PoseGuess { camera_from_map: best.camera_from_map, covariance: None };
    let needed = config.ransac.min_inliers;
    let (iterations, usable) = (best.iterations, left.inliers());
    let no_consensus = |inliers| PnpError::NoConsensus { inliers, usable, needed, iterations };
    if best.inliers < needed {
        return Err(no_consensus(best.inliers));
    }
    let pose = problem.only(left).estimate(&guess)?;
    if pose.point_inliers() < needed {
        return Err(no_consensus(pose.point_inliers()));
    }
    Ok(pose)
}

impl RigidSet {
    /// The set of a pose; it is taken out of what is left.
    fn new(pose: PoseEstimate, left: &mut Uses, prediction: Option<&PoseGuess>) -> Self {
        let members = |verdicts: &[Verdict], left: &mut [Verdict]| {
            let mut members = Vec::new();
            for (index, (verdict, left)) in verdicts.iter().zip(left).enumerate() {
                if verdict.is_inlier() {
                    members.push(index);
                    *left = Verdict::Outlier;
                }
            }
            members
        };
        Self {
            points: members(&pose.points, &mut left.points),
            lines: members(&pose.lines, &mut left.lines),
            distance2: prediction.and_then(|prediction| distance2(prediction, &pose)),
            pose,
        }
    }
}

/// How far a pose lies from the prediction, in standard deviations of both.
fn distance2(prediction: &PoseGuess, pose: &PoseEstimate) -> Option<f64> {
    let predicted = prediction.camera_from_map;
    let difference = perturbation_between(&predicted, &pose.camera_from_map);
    let carried = adjoint(&(pose.camera_from_map * predicted.inverse()));
    let covariance: Matrix6<f64> =
        carried * prediction.covariance? * carried.transpose() + pose.covariance;
    Some(difference.dot(&covariance.cholesky()?.solve(&difference)))
}

fn gate(config: &RigidSetsConfig) -> f64 {
    quantile(COORDINATES, config.prediction_probability)
}

/// Which set is the background: of those that are large enough the one that size and prediction favour. A prediction may
/// fail altogether: beyond the gate no distance is worse than another.
fn background(sets: &[RigidSet], least: f64, config: &RigidSetsConfig) -> Option<usize> {
    let gate = gate(config);
    let demerit = |set: &RigidSet| {
        let far = set.distance2.map_or(0.0, |distance2| distance2.min(gate));
        far - 2.0 * config.size_power * (set.points.len() as f64).ln()
    };
    let small = |set: &RigidSet| (set.points.len() as f64) < least;
    let order = |a: &RigidSet, b: &RigidSet| {
        small(a).cmp(&small(b)).then_with(|| demerit(a).total_cmp(&demerit(b)))
    };
    let indexed = sets.iter().enumerate();
    indexed.min_by(|(_, a), (_, b)| order(a, b)).map(|(index, _)| index)
}
