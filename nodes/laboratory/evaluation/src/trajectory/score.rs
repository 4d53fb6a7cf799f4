//! The whole score of an estimated trajectory.

mod config;
#[cfg(test)]
mod tests;

use geometry::ParameterError;
use nalgebra::Isometry3;
use serde::Serialize;

use super::absolute::{self, AbsoluteScore, MatchedPose};
use super::alignment::{self, Alignment, AlignmentError, FoundAlignment};
use super::association::{self, AssociationSummary, Pair};
use super::coverage::{Coverage, CoverageUnit, Span, coverage};
use super::path::{LeftOut, Times, Trajectory};
use super::relative::{self, RelativeScore};
use super::segments::{self, SegmentScore};

pub use config::TrajectoryScoreConfig;

/// The least pairs that determine a transform in 3D.
const LEAST_PAIRS: usize = 3;

/// A trajectory cannot be scored.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum TrajectoryScoreError {
    /// The configuration is invalid.
    #[error(transparent)]
    Config(#[from] ParameterError),
    /// One of the two has no pose.
    #[error("the {which} has no poses ({} of its lines were invalid)", left_out.not_a_pose)]
    Empty {
        /// `estimate` or `reference`.
        which: &'static str,
        /// Counts of its poses that were left out.
        left_out: LeftOut,
    },
    /// One has stamps and the other has none.
    #[error("the {with_stamps} has stamps and the other trajectory has none")]
    TimesDiffer {
        /// `estimate` or `reference`.
        with_stamps: &'static str,
    },
    /// Too few poses are associated.
    #[error(
        "only {matched} of {estimate} poses of the estimate match one of the {reference} of the reference, but at \
         least {LEAST_PAIRS} are needed ({spans})"
    )]
    TooFewPairs {
        /// The number of pairs.
        matched: usize,
        /// The number of poses of the estimate.
        estimate: usize,
        /// The number of poses of the reference.
        reference: usize,
        /// The time spans of the two.
        spans: Spans,
    },
    /// No transform can be found.
    #[error(transparent)]
    Alignment(#[from] AlignmentError),
    /// There are too many stretches.
    #[error(
        "there are more than {most} stretches of {delta}: take consecutive ones, or a smaller tolerance"
    )]
    TooManyStretches {
        /// Their length.
        delta: relative::Delta,
        /// The most that are held in memory.
        most: usize,
    },
}

/// The time spans of two trajectories, first and last.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Spans {
    /// In seconds, or frames.
    pub estimate: [f64; 2],
    /// In seconds, or frames.
    pub reference: [f64; 2],
    unit: CoverageUnit,
}

/// Figures of a single trajectory.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct TrajectoryFacts {
    /// The number of poses.
    pub poses: usize,
    /// From the first to the last; absent if there are no stamps.
    pub duration_s: Option<f64>,
    /// The length of its path.
    pub path_m: f64,
    /// Counts of the poses of its source that were left out or changed.
    pub left_out: LeftOut,
}

/// The score of a trajectory.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TrajectoryScore {
    /// Figures of the estimate alone.
    pub estimate: TrajectoryFacts,
    /// Figures of the reference alone.
    pub reference: TrajectoryFacts,
    /// The association of the poses.
    pub association: AssociationSummary,
    /// The coverage of the reference.
    pub coverage: Coverage,
    /// The alignment of the estimate.
    pub alignment: FoundAlignment,
    /// The absolute errors.
    pub absolute: AbsoluteScore,
    /// The constant turn from the reference's body to the estimate's, where they are clearly two, as a robot and its camera: relative
    /// errors and drift are without it.
    pub body_turn_deg: Option<f64>,
    /// The relative errors, one score per length.
    pub relative: Vec<RelativeScore>,
    /// The drift over segments.
    pub segments: SegmentScore,
}

/// The score and its inputs.
#[derive(Clone, PartialEq, Debug)]
pub struct ScoredTrajectory {
    /// The score.
    pub score: TrajectoryScore,
    /// The pairs of poses in the order of time.
    pub pairs: Vec<MatchedPose>,
    /// All poses of the reference.
    pub reference: Vec<Isometry3<f64>>,
}

/// Scores an estimate against a reference.
///
/// # Errors
/// When the configuration is invalid, a trajectory has no pose, one has stamps and the other none, fewer than
/// three poses are associated, or no scale can be found.
pub fn score_trajectory(
    estimate: &Trajectory,
    reference: &Trajectory,
    config: &TrajectoryScoreConfig,
) -> Result<ScoredTrajectory, TrajectoryScoreError> {
    config.validate()?;
    for (which, trajectory) in [("estimate", estimate), ("reference", reference)] {
        if trajectory.is_empty() {
            let left_out = trajectory.left_out();
            return Err(TrajectoryScoreError::Empty { which, left_out });
        }
    }
    let pairs = association::associate(estimate, reference, &config.association)
        .map_err(|_| times_differ(estimate))?;
    if pairs.len() < LEAST_PAIRS {
        return Err(TrajectoryScoreError::TooFewPairs {
            matched: pairs.len(),
            estimate: estimate.len(),
            reference: reference.len(),
            spans: Spans::of(estimate, reference),
        });
    }
    let poses: Vec<(Isometry3<f64>, Isometry3<f64>)> = pairs
        .iter()
        .map(|pair| (estimate.poses()[pair.estimate], reference.poses()[pair.reference]))
        .collect();
    let alignment = alignment::align(config.alignment, &poses)?;
    let at = since_first(reference);
    let matched = matched(&pairs, &poses, &alignment, reference, &at);
    let absolute = absolute::score(&matched, alignment.rotation_is_determined)
        .ok_or(TrajectoryScoreError::Alignment(AlignmentError::OutOfRange))?;
    // Without an alignment a turn of the body and one of the frame cannot be told apart.
    let is_turned = matches!(config.alignment, Alignment::Yaw | Alignment::Se3 | Alignment::Sim3);
    let body_turn = is_turned.then(|| absolute::turn_of_bodies(&matched, &absolute)).flatten();
    let of_one_body = absolute::of_one_body(&matched, body_turn);
    let score = TrajectoryScore {
        estimate: TrajectoryFacts::of(estimate),
        reference: TrajectoryFacts::of(reference),
        association: association::summary(&pairs, estimate, reference, &config.association),
        coverage: covered(&pairs, reference, &at, config),
        alignment,
        absolute,
        body_turn_deg: body_turn.map(|turn| turn.angle().to_degrees()),
        relative: relative::scores(&of_one_body, &config.relative).map_err(|error| {
            TrajectoryScoreError::TooManyStretches { delta: error.delta, most: error.most }
        })?,
        segments: segments::score(&of_one_body, &config.segments),
    };
    Ok(ScoredTrajectory { score, pairs: matched, reference: reference.poses().to_vec() })
}

fn matched(
    pairs: &[Pair],
    poses: &[(Isometry3<f64>, Isometry3<f64>)],
    alignment: &FoundAlignment,
    reference: &Trajectory,
    at: &[f64],
) -> Vec<MatchedPose> {
    let with_errors = |(pair, poses): (&Pair, &(Isometry3<f64>, Isometry3<f64>))| {
        let stamp = match reference.times() {
            Times::Stamps(stamps) => stamps.get(pair.reference).copied(),
            Times::Frames(_) => None,
        };
        MatchedPose::new(stamp, at[pair.reference], alignment.apply(&poses.0), poses.1)
    };
    pairs.iter().zip(poses).map(with_errors).collect()
}

fn covered(
    pairs: &[Pair],
    reference: &Trajectory,
    at: &[f64],
    config: &TrajectoryScoreConfig,
) -> Coverage {
    let mut matched: Vec<usize> = pairs.iter().map(|pair| pair.reference).collect();
    matched.dedup();
    let unit = match reference.times() {
        Times::Stamps(_) => CoverageUnit::Seconds,
        Times::Frames(_) => CoverageUnit::Frames,
    };
    let span = Span { at, poses: reference.poses(), matched: &matched };
    coverage(&span, unit, config.max_gap_s)
}

/// Seconds since the first pose, or frames.
fn since_first(trajectory: &Trajectory) -> Vec<f64> {
    match trajectory.times() {
        Times::Stamps(stamps) => {
            let first = stamps.first().copied().unwrap_or_default();
            stamps.iter().map(|stamp| stamp.seconds_since(first)).collect()
        }
        Times::Frames(frames) => {
            let first = frames.first().copied().unwrap_or_default();
            frames.iter().map(|frame| (frame - first) as f64).collect()
        }
    }
}

fn times_differ(estimate: &Trajectory) -> TrajectoryScoreError {
    let with_stamps = match estimate.times() {
        Times::Stamps(_) => "estimate",
        Times::Frames(_) => "reference",
    };
    TrajectoryScoreError::TimesDiffer { with_stamps }
}

impl TrajectoryFacts {
    fn of(trajectory: &Trajectory) -> Self {
        let duration_s = match trajectory.times() {
            Times::Stamps(_) => since_first(trajectory).last().copied(),
            Times::Frames(_) => None,
        };
        Self {
            poses: trajectory.len(),
            duration_s,
            path_m: trajectory.path_m(),
            left_out: trajectory.left_out(),
        }
    }
}

impl Spans {
    fn of(estimate: &Trajectory, reference: &Trajectory) -> Self {
        let ends = |trajectory: &Trajectory| match trajectory.times() {
            Times::Stamps(stamps) => [stamps.first(), stamps.last()]
                .map(|stamp| stamp.map_or(f64::NAN, |stamp| stamp.as_nanos() as f64 * 1e-9)),
            Times::Frames(frames) => [frames.first(), frames.last()]
                .map(|frame| frame.map_or(f64::NAN, |frame| *frame as f64)),
        };
        let unit = match estimate.times() {
            Times::Stamps(_) => CoverageUnit::Seconds,
            Times::Frames(_) => CoverageUnit::Frames,
        };
        Self { estimate: ends(estimate), reference: ends(reference), unit }
    }
}

impl std::fmt::Display for Spans {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { estimate: [from, to], reference: [first, last], unit } = self;
        match unit {
            CoverageUnit::Seconds => write!(
                formatter,
                "the estimate runs from {from:.3} s to {to:.3} s, the reference from {first:.3} s to {last:.3} s"
            ),
            CoverageUnit::Frames => write!(
                formatter,
                "the estimate has frames {from} to {to}, the reference {first} to {last}"
            ),
        }
    }
}
