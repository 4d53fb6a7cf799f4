//! Matching of lines whose place is predicted.

use nalgebra::{Point2, Vector2};

use super::direction_bins::DirectionBins;
use super::{Best, LineMatch, ProjectedLineConfig, each_taken_once};
use crate::feature::lines::{LineDescriptor, LineFeature, LineSegment};

/// Two segments whose ends are no farther from each other's line are pieces of one line: neither is the other's rival.
const SAME_LINE_PX: f64 = 2.0;

/// A line of the map as it should appear in an image.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProjectedLine {
    /// Where one end should be, column and row; it may be out of the image. Looking from here to the other end the
    /// brighter side is on the left.
    pub start_px: Point2<f64>,
    /// Where the other end should be.
    pub end_px: Point2<f64>,
    /// Its descriptor.
    pub descriptor: LineDescriptor,
}

/// Which segment is which of the lines: of those of about its direction, near where it is predicted and beside it rather
/// than ahead of it, the one that is most alike, and clearly more so than the second. In the order of the lines; no
/// segment is taken twice.
///
/// `bins` are those of `features`; one of another number of segments finds only those that exist.
#[must_use]
pub fn match_projected_lines(
    lines: &[ProjectedLine],
    features: &[LineFeature],
    bins: &DirectionBins,
    config: &ProjectedLineConfig,
) -> Vec<LineMatch> {
    let matches = lines.iter().enumerate().filter_map(|(from, line)| {
        let axis = Axis::new(line.start_px, line.end_px)?;
        let best = best_candidate(line, &axis, features, bins, config)?;
        let found = LineMatch { from, to: best.to, distance_bits: best.distance_bits };
        best.passes(&config.matching).then_some(found)
    });
    each_taken_once(matches.collect(), features.len())
}

fn best_candidate(
    line: &ProjectedLine,
    axis: &Axis,
    features: &[LineFeature],
    bins: &DirectionBins,
    config: &ProjectedLineConfig,
) -> Option<Best> {
    let direction_rad = axis.direction.y.atan2(axis.direction.x) as f32;
    let mut candidates: Vec<(u32, usize)> = bins
        .near(direction_rad, config.matching.max_turn_rad as f32)
        .filter_map(|to| {
            let feature = features.get(to)?;
            let is_near = axis.distance_px(&feature.segment) <= config.max_offset_px
                && axis.overlap(&feature.segment) >= config.min_overlap;
            is_near.then(|| (line.descriptor.distance_bits(&feature.descriptor), to))
        })
        .collect();
    candidates.sort_unstable();
    let &(distance_bits, to) = candidates.first()?;
    let best = &features[to].segment;
    let rival =
        candidates[1..].iter().find(|&&(_, rival)| !on_one_line(best, &features[rival].segment));
    Some(Best { to, distance_bits, rival_bits: rival.map(|&(rival_bits, _)| rival_bits) })
}

/// Whether two segments lie on one line.
fn on_one_line(one: &LineSegment, other: &LineSegment) -> bool {
    let lies_on = |one: &LineSegment, other: &LineSegment| {
        let axis = Axis::new(point(one.start_px), point(one.end_px));
        axis.is_some_and(|axis| axis.distance_px(other) <= SAME_LINE_PX)
    };
    // By the longer one: a short one determines the line's direction badly.
    if one.length_px() >= other.length_px() { lies_on(one, other) } else { lies_on(other, one) }
}

fn point([x, y]: [f32; 2]) -> Point2<f64> {
    Point2::new(f64::from(x), f64::from(y))
}

/// A line as an axis along which others are measured.
struct Axis {
    start_px: Point2<f64>,
    /// Of length 1.
    direction: Vector2<f64>,
    length_px: f64,
}

impl Axis {
    /// `None` for a line without length, or with an end that is nowhere.
    fn new(start_px: Point2<f64>, end_px: Point2<f64>) -> Option<Self> {
        let along = end_px - start_px;
        let length_px = along.norm();
        let direction = along / length_px;
        (length_px > 0.0 && length_px.is_finite()).then_some(Self {
            start_px,
            direction,
            length_px,
        })
    }

    /// How far the farther end of a segment is from the line.
    fn distance_px(&self, segment: &LineSegment) -> f64 {
        let [start, end] = [segment.start_px, segment.end_px]
            .map(|end_px| self.direction.perp(&(point(end_px) - self.start_px)).abs());
        start.max(end)
    }

    /// How much of the shorter one of the two, along the line, both share.
    fn overlap(&self, segment: &LineSegment) -> f64 {
        let [one, other] = [segment.start_px, segment.end_px]
            .map(|end_px| self.direction.dot(&(point(end_px) - self.start_px)));
        let (from, to) = (one.min(other), one.max(other));
        let shared = to.min(self.length_px) - from.max(0.0);
        let shorter = (to - from).min(self.length_px);
        if shorter > 0.0 { shared.max(0.0) / shorter } else { 0.0 }
    }
}
