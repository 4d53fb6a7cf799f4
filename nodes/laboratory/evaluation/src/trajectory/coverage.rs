//! How much of the reference the estimate covers: a tracker that stops in the difficult parts has small errors.

use serde::Serialize;

use super::absolute::MatchedPose;
use super::path::path_lengths_m;

/// Not longer than this is no gap, in median intervals of the reference, or in frames: a sparse reference has no gaps by itself, and one frame that is
/// missing is none.
const LEAST_GAP_INTERVALS: f64 = 2.0;
/// The most gaps that are listed, the longest first.
const MOST_GAPS: usize = 20;

/// The unit of the coverage.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CoverageUnit {
    /// Seconds.
    Seconds,
    /// Frames, for trajectories without stamps.
    Frames,
}

/// How much of the reference the estimate covers.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Coverage {
    /// The unit of `reference` and `covered`.
    pub unit: CoverageUnit,
    /// From the first pose of the reference to its last.
    pub reference: f64,
    /// Of this, the part between pairs of poses without a gap.
    pub covered: f64,
    /// The share of the two.
    pub share: f64,
    /// The same share of the reference's path: a tracker that is lost while the body does not move loses nothing.
    pub path_share: f64,
    /// Pairs farther apart than this have a gap between them.
    pub max_gap: f64,
    /// The gaps, with those before the first pair and after the last, the longest first; at most 20.
    pub gaps: Vec<Gap>,
    /// The number of gaps.
    pub gap_count: usize,
}

/// A part of the reference without an estimate.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Gap {
    /// Its start, since the reference's first pose.
    pub start: f64,
    /// Its end, since the reference's first pose.
    pub end: f64,
}

/// The reference and the pairs, each by its place in time and in the list of the reference's poses.
pub(super) struct Span<'a> {
    /// The times of the reference's poses, since the first.
    pub(super) at: &'a [f64],
    /// Its poses.
    pub(super) poses: &'a [nalgebra::Isometry3<f64>],
    /// Which of them have a partner, in order.
    pub(super) matched: &'a [usize],
}

/// The coverage. `max_gap` is the longest time between two pairs that is not a gap.
pub(super) fn coverage(span: &Span<'_>, unit: CoverageUnit, max_gap: f64) -> Coverage {
    let end = span.at.last().copied().unwrap_or(0.0);
    let path_m = path_lengths_m(span.poses);
    let max_gap = match unit {
        CoverageUnit::Seconds => max_gap.max(LEAST_GAP_INTERVALS * median_interval(span.at)),
        // Seconds say nothing of frames.
        CoverageUnit::Frames => LEAST_GAP_INTERVALS,
    };
    let (mut covered, mut covered_m, mut gaps) = (0.0, 0.0, Vec::new());
    let mut gap = |start: f64, end: f64| {
        if end > start {
            gaps.push(Gap { start, end });
        }
    };
    for pair in span.matched.windows(2) {
        let (from, to) = (span.at[pair[0]], span.at[pair[1]]);
        if to - from <= max_gap {
            covered += to - from;
            covered_m += path_m[pair[1]] - path_m[pair[0]];
        } else {
            gap(from, to);
        }
    }
    match (span.matched.first(), span.matched.last()) {
        (Some(&first), Some(&last)) => {
            gap(0.0, span.at[first]);
            gap(span.at[last], end);
        }
        _ => gap(0.0, end),
    }
    gaps.sort_by(|one, other| {
        (other.end - other.start)
            .total_cmp(&(one.end - one.start))
            .then(one.start.total_cmp(&other.start))
    });
    let gap_count = gaps.len();
    gaps.truncate(MOST_GAPS);
    let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 1.0 };
    Coverage {
        unit,
        reference: end,
        covered,
        share: share(covered, end),
        path_share: share(covered_m, path_m.last().copied().unwrap_or(0.0)),
        max_gap,
        gaps,
        gap_count,
    }
}

/// Whether two pairs have a gap between them.
pub(super) fn is_gap(from: &MatchedPose, to: &MatchedPose, coverage: &Coverage) -> bool {
    to.at - from.at > coverage.max_gap
}

fn median_interval(at: &[f64]) -> f64 {
    let mut intervals: Vec<f64> = at.windows(2).map(|pair| pair[1] - pair[0]).collect();
    estimation::quantile::upper_median(&mut intervals).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;

    /// Ten poses a second for ten seconds; the body does not move in the second half.
    fn covered_by(matched: &[usize]) -> Coverage {
        let at: Vec<f64> = (0..=100).map(|index| f64::from(index) * 0.1).collect();
        let poses: Vec<_> =
            at.iter().map(|at_s| Isometry3::translation(at_s.min(5.0), 0.0, 0.0)).collect();
        coverage(&Span { at: &at, poses: &poses, matched }, CoverageUnit::Seconds, 1.0)
    }

    #[test]
    fn a_tracker_that_never_stops_covers_everything() {
        // Three poses a second are enough.
        let whole = covered_by(&(0..=100).step_by(4).collect::<Vec<_>>());
        assert!((whole.share - 1.0).abs() < 1e-12 && (whole.path_share - 1.0).abs() < 1e-12);
        assert_eq!(whole.gaps, []);
    }

    #[test]
    fn one_that_is_lost_at_either_end_and_between_covers_the_rest() {
        let part = covered_by(&(10..=20).chain(40..=80).collect::<Vec<_>>());
        assert!((part.covered - 5.0).abs() < 1e-9, "{part:?}");
        assert!((part.share - 0.5).abs() < 1e-9);
        assert!((part.path_share - 0.4).abs() < 1e-9);
        let gaps: Vec<[i64; 2]> =
            part.gaps.iter().map(|gap| [gap.start, gap.end].map(|at| at.round() as i64)).collect();
        assert_eq!(gaps, [[2, 4], [8, 10], [0, 1]]);
    }

    #[test]
    fn no_pair_covers_nothing() {
        let none = covered_by(&[]);
        assert_eq!((none.share, none.gap_count), (0.0, 1));
        assert_eq!(none.gaps[0], Gap { start: 0.0, end: 10.0 });
    }

    #[test]
    fn of_frames_two_that_are_missing_are_a_gap() {
        let part = covered_frames(&[0, 1, 2, 5]);
        assert_eq!((part.covered, part.share), (2.0, 0.2));
        assert_eq!(part.gaps, [Gap { start: 5.0, end: 10.0 }, Gap { start: 2.0, end: 5.0 }]);
    }

    /// Regression: each frame that was missing alone took the two intervals beside it: with 86 of 600 missing the coverage was 71.5 %.
    #[test]
    fn a_frame_that_is_missing_alone_is_no_gap() {
        let part = covered_frames(&[0, 2, 3, 5, 6, 7, 9, 10]);
        assert_eq!((part.share, part.gap_count), (1.0, 0));
    }

    fn covered_frames(matched: &[usize]) -> Coverage {
        let at: Vec<f64> = (0..11).map(f64::from).collect();
        let poses = vec![Isometry3::identity(); 11];
        coverage(&Span { at: &at, poses: &poses, matched }, CoverageUnit::Frames, 9.0)
    }

    #[test]
    fn a_sparse_reference_has_no_gaps_by_itself() {
        let at: Vec<f64> = (0..11).map(|index| f64::from(index) * 3.0).collect();
        let poses = vec![Isometry3::identity(); 11];
        let matched: Vec<usize> = (0..11).collect();
        let all = coverage(
            &Span { at: &at, poses: &poses, matched: &matched },
            CoverageUnit::Seconds,
            1.0,
        );
        assert_eq!((all.share, all.max_gap), (1.0, 6.0));
    }
}
