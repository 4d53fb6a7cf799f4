//! The stretches of a given length.

use super::{Delta, DeltaUnit, Pairs, PairsFrom, RelativeConfig, TooManyStretches};
use crate::trajectory::absolute::MatchedPose;
use crate::trajectory::path::path_lengths_m;

/// The most stretches: a quarter of a gigabyte. Long trajectories have billions of stretches of a few degrees.
const MOST_STRETCHES: usize = 16_000_000;

/// Stamps of text files are rounded to microseconds.
const STAMP_ROUNDING_S: f64 = 1e-6;

type Stretch = (usize, usize);

/// The stretches, by the poses that they begin and end at.
///
/// Consecutive ones end at the first pose at which the count of frames, the path or the sum of the turns has
/// reached the length. Of all pairs, those of frames, seconds and metres end at the pose that is nearest to the
/// length, if it is within the tolerance; those of degrees at every pose whose turn from the first is within it.
/// Those of seconds end so in either case: stamps are never so even that the first pose after a second would do.
pub(super) fn stretches(
    poses: &[MatchedPose],
    delta: Delta,
    config: &RelativeConfig,
) -> Result<Vec<Stretch>, TooManyStretches> {
    let tolerance = delta.value * config.tolerance;
    Ok(match (delta.unit, config.pairs) {
        (DeltaUnit::Frames, pairs) => frames(poses.len(), delta.value as usize, pairs),
        (DeltaUnit::Seconds, _) if poses.iter().any(|pose| pose.stamp.is_none()) => Vec::new(),
        (DeltaUnit::Seconds, pairs) => {
            let times_s: Vec<f64> = poses.iter().map(|pose| pose.at).collect();
            let last_s = times_s.last().copied().unwrap_or_default() + STAMP_ROUNDING_S;
            let nearest = |from: usize| {
                // At the end of a recording a shorter stretch would count as a whole one.
                let lasts = *times_s.get(from)? + delta.value <= last_s;
                lasts.then(|| nearest(&times_s, from, delta.value, tolerance)).flatten()
            };
            match pairs {
                Pairs::All => all(poses.len(), nearest),
                Pairs::Consecutive => consecutive(poses.len(), nearest),
            }
        }
        (DeltaUnit::Metres, pairs) => {
            let poses: Vec<_> = poses.iter().map(|pose| config.pairs_from.of(pose)).collect();
            let path_m = path_lengths_m(&poses);
            match pairs {
                Pairs::All => {
                    all(path_m.len(), |from| nearest(&path_m, from, delta.value, tolerance))
                }
                Pairs::Consecutive => reaching(&path_m, delta.value),
            }
        }
        (DeltaUnit::Degrees, pairs) => {
            let turn_deg = |from: usize, to: usize| {
                let turn = |at: usize| config.pairs_from.of(&poses[at]).rotation;
                turn(from).angle_to(&turn(to)).to_degrees()
            };
            match pairs {
                Pairs::All => {
                    let within = |from, to| (turn_deg(from, to) - delta.value).abs() <= tolerance;
                    return every(poses.len(), within)
                        .ok_or(TooManyStretches { delta, most: MOST_STRETCHES });
                }
                Pairs::Consecutive => {
                    let mut sum_deg = 0.0;
                    let sums_deg: Vec<f64> = (0..poses.len())
                        .map(|at| {
                            sum_deg += at.checked_sub(1).map_or(0.0, |before| turn_deg(before, at));
                            sum_deg
                        })
                        .collect();
                    reaching(&sums_deg, delta.value)
                }
            }
        }
    })
}

impl PairsFrom {
    fn of(self, pose: &MatchedPose) -> nalgebra::Isometry3<f64> {
        match self {
            Self::Reference => pose.reference,
            Self::Estimate => pose.estimate,
        }
    }
}

fn frames(count: usize, step: usize, pairs: Pairs) -> Vec<Stretch> {
    let step = step.max(1);
    let stride = if pairs == Pairs::All { 1 } else { step };
    (0..count.saturating_sub(step)).step_by(stride).map(|from| (from, from + step)).collect()
}

/// A stretch from every pose that has an end.
fn all(count: usize, end: impl Fn(usize) -> Option<usize>) -> Vec<Stretch> {
    (0..count).filter_map(|from| Some((from, end(from)?))).collect()
}

/// Stretches of which each begins where the one before ends; a pose without an end is skipped.
fn consecutive(count: usize, end: impl Fn(usize) -> Option<usize>) -> Vec<Stretch> {
    let (mut from, mut stretches) = (0, Vec::new());
    while from < count {
        match end(from) {
            Some(to) => {
                stretches.push((from, to));
                from = to;
            }
            None => from += 1,
        }
    }
    stretches
}

/// Stretches that end where a sum has grown by `length` since they began.
fn reaching(sums: &[f64], length: f64) -> Vec<Stretch> {
    let (mut from, mut stretches) = (0, Vec::new());
    for (at, sum) in sums.iter().enumerate() {
        if sum - sums[from] >= length {
            stretches.push((from, at));
            from = at;
        }
    }
    stretches
}

/// The index after `from` at which a non-decreasing sum is nearest to its value at `from` plus `length`; the first
/// of several.
fn nearest(sums: &[f64], from: usize, length: f64, tolerance: f64) -> Option<usize> {
    let wanted = sums.get(from)? + length;
    let after = sums.partition_point(|sum| *sum < wanted).max(from + 1);
    let off = |at: usize| sums.get(at).map(|sum| ((sum - wanted).abs(), at));
    let before = off(after - 1).filter(|(_, at)| *at > from).map(|(off, at)| {
        // When the body was at rest, the first pose at rest.
        (off, sums[..at].partition_point(|sum| *sum < sums[at]).max(from + 1))
    });
    let found = [before, off(after)]
        .into_iter()
        .flatten()
        .reduce(|one, other| if other.0 < one.0 { other } else { one })?;
    (found.0 <= tolerance).then_some(found.1)
}

/// All that are within the tolerance; `None` when there are too many.
fn every(count: usize, within: impl Fn(usize, usize) -> bool) -> Option<Vec<Stretch>> {
    let mut stretches = Vec::new();
    for from in 0..count {
        stretches.extend((from + 1..count).filter(|to| within(from, *to)).map(|to| (from, to)));
        if stretches.len() > MOST_STRETCHES {
            return None;
        }
    }
    Some(stretches)
}
