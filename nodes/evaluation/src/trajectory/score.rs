//! The whole score of an estimated trajectory.

use geometry::{ParameterError, parameter};
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use super::absolute::{self, AbsoluteScore, MatchedPose};
use super::alignment::{self, Alignment, AlignmentError, FoundAlignment};
use super::association::{self, AssociationConfig, AssociationSummary, Pair};
use super::coverage::{Coverage, CoverageUnit, Span, coverage};
use super::path::{LeftOut, Times, Trajectory};
use super::relative::{self, DeltaUnit, RelativeConfig, RelativeScore};
use super::segments::{self, SegmentConfig, SegmentLengths, SegmentScore};

/// Fewer pairs determine no transform of space.
const LEAST_PAIRS: usize = 3;

/// How a trajectory is scored.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrajectoryScoreConfig {
    /// Which poses belong together.
    pub association: AssociationConfig,
    /// What may be done to the estimate first.
    pub alignment: Alignment,
    /// The relative errors.
    pub relative: RelativeConfig,
    /// The drift over segments.
    pub segments: SegmentConfig,
    /// Between pairs farther apart than this the reference is not covered.
    pub max_gap_s: f64,
}

impl Default for TrajectoryScoreConfig {
    fn default() -> Self {
        Self {
            association: AssociationConfig::default(),
            alignment: Alignment::default(),
            relative: RelativeConfig::default(),
            segments: SegmentConfig::default(),
            // Keyframes come several a second; who hears nothing for a second does not know where he is.
            max_gap_s: 1.0,
        }
    }
}

impl TrajectoryScoreConfig {
    /// Whether all numbers are of use.
    ///
    /// # Errors
    /// Names the first that is not.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::not_negative("max_difference_s", self.association.max_difference_s)?;
        parameter::not_negative("max_gap_s", self.max_gap_s)?;
        parameter::not_negative("tolerance", self.relative.tolerance)?;
        parameter::not_negative("offset_s", self.association.offset_s.abs())?;
        for delta in &self.relative.deltas {
            let value = delta.value;
            if delta.unit == DeltaUnit::Frames && value.fract() != 0.0 {
                parameter::check("delta", "a whole number above 0", value, false)?;
            }
            parameter::positive("delta", value)?;
        }
        if let SegmentLengths::Metres(lengths_m) = &self.segments.lengths {
            for length_m in lengths_m {
                parameter::positive("segment length", *length_m)?;
            }
        }
        parameter::at_least("step_poses", self.segments.step_poses, 1)
    }
}

/// A trajectory cannot be scored.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum TrajectoryScoreError {
    /// The configuration is of no use.
    #[error(transparent)]
    Config(#[from] ParameterError),
    /// One of the two has no pose.
    #[error("the {which} has no pose ({} lines of it were no pose)", left_out.not_a_pose)]
    Empty {
        /// `estimate` or `reference`.
        which: &'static str,
        /// What was left out of it.
        left_out: LeftOut,
    },
    /// One has stamps and the other has none.
    #[error("the {with_stamps} has stamps and the other trajectory has none")]
    TimesDiffer {
        /// `estimate` or `reference`.
        with_stamps: &'static str,
    },
    /// Too few poses belong together.
    #[error(
        "only {matched} of {estimate} poses of the estimate belong to one of the {reference} of the reference, and \
         {LEAST_PAIRS} are the least ({spans})"
    )]
    TooFewPairs {
        /// Pairs that were found.
        matched: usize,
        /// Poses of the estimate.
        estimate: usize,
        /// Poses of the reference.
        reference: usize,
        /// When the two were.
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
        /// How long they are.
        delta: relative::Delta,
        /// How many are held in memory.
        most: usize,
    },
}

/// When two trajectories were, first and last.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Spans {
    /// In seconds, or frames.
    pub estimate: [f64; 2],
    /// In seconds, or frames.
    pub reference: [f64; 2],
    unit: CoverageUnit,
}

/// What is known of a trajectory by itself.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct TrajectoryFacts {
    /// How many poses it has.
    pub poses: usize,
    /// From the first to the last; absent where there are no stamps.
    pub duration_s: Option<f64>,
    /// The length of its path.
    pub path_m: f64,
    /// What of its source it does without.
    pub left_out: LeftOut,
}

/// The score of a trajectory.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TrajectoryScore {
    /// The estimate by itself.
    pub estimate: TrajectoryFacts,
    /// The reference by itself.
    pub reference: TrajectoryFacts,
    /// Which poses belong together.
    pub association: AssociationSummary,
    /// How much of the reference is covered.
    pub coverage: Coverage,
    /// What was done to the estimate.
    pub alignment: FoundAlignment,
    /// The absolute errors.
    pub absolute: AbsoluteScore,
    /// The relative errors, a score for each length.
    pub relative: Vec<RelativeScore>,
    /// The drift over segments.
    pub segments: SegmentScore,
}

/// The score, and what it was made of.
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
/// When the configuration is of no use, a trajectory has no pose, one has stamps and the other none, fewer than
/// three poses belong together, or no scale can be found.
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
    let score = TrajectoryScore {
        estimate: TrajectoryFacts::of(estimate),
        reference: TrajectoryFacts::of(reference),
        association: association::summary(&pairs, estimate, reference, &config.association),
        coverage: covered(&pairs, reference, &at, config),
        alignment,
        absolute,
        relative: relative::scores(&matched, &config.relative).map_err(|error| {
            TrajectoryScoreError::TooManyStretches { delta: error.delta, most: error.most }
        })?,
        segments: segments::score(&matched, &config.segments),
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

#[cfg(test)]
mod tests {
    use geometry::Stamp;

    use super::super::testing::{pose, raw, stamped, walk};
    use super::*;

    #[test]
    fn an_estimate_in_another_frame_is_as_good_as_its_shape() {
        let truth = walk(200);
        let elsewhere = pose([5.0, -3.0, 1.0], [0.4, 0.1, -2.0]);
        let estimate: Vec<_> = truth.iter().map(|pose| elsewhere * pose).collect();
        let scored = score_trajectory(
            &stamped(&estimate),
            &stamped(&truth),
            &TrajectoryScoreConfig::default(),
        )
        .unwrap();
        let score = &scored.score;
        assert!(score.absolute.translation_m.max < 1e-12, "{score:?}");
        assert!(score.absolute.rotation_deg.unwrap().max < 1e-9);
        assert!((score.coverage.share - 1.0).abs() < 1e-12);
        assert_eq!((score.association.matched, score.association.estimate_left_out), (200, 0));
        for relative in &score.relative {
            assert!(relative.count > 50 && relative.translation_m.unwrap().max < 1e-11);
        }
        let unaligned = TrajectoryScoreConfig { alignment: Alignment::None, ..Default::default() };
        let scored = score_trajectory(&stamped(&estimate), &stamped(&truth), &unaligned).unwrap();
        assert!(scored.score.absolute.translation_m.rmse > 1.0);
        assert!(scored.score.relative[0].translation_m.unwrap().max < 1e-11);
    }

    #[test]
    fn one_camera_needs_its_scale() {
        let truth = walk(200);
        let mut estimate = truth.clone();
        for pose in &mut estimate {
            pose.translation.vector *= 0.4;
        }
        let score = |alignment| {
            let config = TrajectoryScoreConfig { alignment, ..Default::default() };
            score_trajectory(&stamped(&estimate), &stamped(&truth), &config).unwrap().score
        };
        let sim3 = score(Alignment::Sim3);
        assert!((sim3.alignment.scale - 2.5).abs() < 1e-12);
        assert!(sim3.absolute.translation_m.max < 1e-12);
        assert!(sim3.relative[1].translation_m.unwrap().max < 1e-11);
        assert!(score(Alignment::Se3).absolute.translation_m.rmse > 0.5);
    }

    #[test]
    fn a_lost_tracker_has_small_errors_and_little_coverage() {
        let truth = walk(200);
        let score = score_trajectory(
            &stamped(&truth[..40]),
            &stamped(&truth),
            &TrajectoryScoreConfig::default(),
        )
        .unwrap()
        .score;
        assert!(score.absolute.translation_m.max < 1e-12);
        assert!((score.coverage.share - 39.0 / 199.0).abs() < 1e-9, "{:?}", score.coverage);
        assert_eq!(score.coverage.gap_count, 1);
    }

    #[test]
    fn what_cannot_be_scored_says_why() {
        let config = TrajectoryScoreConfig::default();
        let truth = stamped(&walk(50));
        let score = |estimate: &Trajectory| {
            score_trajectory(estimate, &truth, &config).unwrap_err().to_string()
        };
        let nothing = Trajectory::stamped([]);
        assert!(score(&nothing).contains("the estimate has no pose"), "{}", score(&nothing));
        let frames = Trajectory::numbered(walk(50).iter().map(raw));
        assert!(score(&frames).contains("the reference has stamps"), "{}", score(&frames));
        let late = Trajectory::stamped(
            walk(5)
                .iter()
                .enumerate()
                .map(|(index, pose)| (Stamp::from_nanos(index as i64), raw(pose))),
        );
        let error = score(&late);
        assert!(error.contains("only 0 of 5 poses") && error.contains("from 100.000 s"), "{error}");
        let two = score(&stamped(&walk(2)));
        assert!(two.contains("only 2 of 2"), "{two}");
        let still = stamped(&[Isometry3::identity(); 50]);
        let sim3 = TrajectoryScoreConfig { alignment: Alignment::Sim3, ..config.clone() };
        let error = score_trajectory(&still, &truth, &sim3).unwrap_err();
        assert!(error.to_string().contains("stands still"), "{error}");
    }

    #[test]
    fn numbers_of_no_use_are_named() {
        let refused = |change: fn(&mut TrajectoryScoreConfig)| {
            let mut config = TrajectoryScoreConfig::default();
            change(&mut config);
            config.validate().unwrap_err().to_string()
        };
        let delta = |value, unit| relative::Delta { value, unit };
        assert_eq!(
            refused(|config| config.max_gap_s = -1.0),
            "max_gap_s must be a number that is not negative, not -1"
        );
        assert!(refused(|config| config.association.offset_s = f64::NAN).contains("offset_s"));
        assert!(refused(|config| config.segments.step_poses = 0).contains("step_poses"));
        let mut config = TrajectoryScoreConfig::default();
        config.relative.deltas = vec![delta(1.5, DeltaUnit::Frames)];
        assert!(config.validate().unwrap_err().to_string().contains("whole number"));
        config.relative.deltas = vec![delta(0.0, DeltaUnit::Metres)];
        assert!(config.validate().is_err());
        config.relative.deltas = vec![delta(1.5, DeltaUnit::Metres)];
        config.segments.lengths = SegmentLengths::Metres(vec![3.0, 0.0]);
        assert!(config.validate().unwrap_err().to_string().contains("segment length"));
    }
}
