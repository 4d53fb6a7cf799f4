//! Straight parts of an edge.

use nalgebra::Point2;

use super::LineConfig;
use super::gradient::GradientField;
use super::moments::{FittedLine, Moments};

/// While a line grows it is fitted anew each time that it has grown by an eighth.
const REFIT_SHIFT: u32 = 3;
/// The peak of a gradient lies at most so far from the pixel that is the largest: farther, the three pixels are no peak.
const FARTHEST_PEAK_PX: f64 = 1.0;

/// A straight part of an edge, or of several.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct StraightEdge {
    /// Of the points of the edge.
    pub(super) moments: Moments,
    /// The line through them, the brighter side on its left.
    pub(super) line: FittedLine,
    /// Where on the line it begins.
    pub(super) start_along_px: f64,
    /// Where on the line it ends.
    pub(super) end_along_px: f64,
}

impl StraightEdge {
    pub(super) fn start_px(&self) -> Point2<f64> {
        self.line.at(self.start_along_px)
    }

    pub(super) fn end_px(&self) -> Point2<f64> {
        self.line.at(self.end_along_px)
    }

    pub(super) fn length_px(&self) -> f64 {
        self.end_along_px - self.start_along_px
    }
}

/// Where the edge lies within a pixel of it: at the peak of the gradient across the edge, by a parabola through the
/// pixel and its two neighbours. `pixel` is not outermost.
pub(super) fn edge_point_px(field: &GradientField, pixel: usize) -> Point2<f64> {
    let along_row = field.gradients[pixel].edge_runs_along_row();
    let step = if along_row { field.width_px } else { 1 };
    // The component across the edge peaks where the edge is, however slanted: it is a function of the distance alone.
    let strength = |pixel: usize| {
        let gradient = field.gradients[pixel];
        f64::from(if along_row { gradient.y } else { gradient.x }.unsigned_abs())
    };
    let [before, here, after] = [pixel - step, pixel, pixel + step].map(strength);
    let curvature = before - 2.0 * here + after;
    let peak_px = if curvature < 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
    let peak_px = peak_px.clamp(-FARTHEST_PEAK_PX, FARTHEST_PEAK_PX);
    let (column, row) = ((pixel % field.width_px) as f64, (pixel / field.width_px) as f64);
    if along_row { Point2::new(column, row + peak_px) } else { Point2::new(column + peak_px, row) }
}

/// Appends the straight parts of an edge, given by its points in order (EDLines, section 2.2).
///
/// A line is laid through the first `seed_px` points that lie on one, and grows along the edge, and back, for as long
/// as points keep close to it; the rest of the edge begins where it ends.
pub(super) fn grow(points: &[Point2<f64>], config: &LineConfig, found: &mut Vec<StraightEdge>) {
    let seed_px = config.seed_px;
    let mut rest = 0;
    while let Some((first, seed)) = first_seed(points, rest, config) {
        let ends = [points[first], points[first + seed_px - 1]];
        let mut growth = Growth { moments: seed, line: seed.line(ends[1] - ends[0]), refit_in: 1 };
        let end = first + seed_px;
        let end = end + growth.take(points[end..].iter(), config);
        let start = first - growth.take(points[rest..first].iter().rev(), config);
        let Growth { moments, line, .. } = growth;
        let line = moments.line(line.direction);
        found.push(StraightEdge {
            moments,
            line,
            start_along_px: line.along_px(points[start]),
            end_along_px: line.along_px(points[end - 1]),
        });
        rest = end;
    }
}

/// The first so many consecutive points that lie on a line: which, and their moments.
fn first_seed(
    points: &[Point2<f64>],
    from: usize,
    config: &LineConfig,
) -> Option<(usize, Moments)> {
    let mean_square_px2 = config.max_rms_px * config.max_rms_px;
    let mut moments = Moments::default();
    for &point in points.get(from..from + config.seed_px)? {
        moments.add(point);
    }
    let mut first = from;
    while !moments.lie_within(mean_square_px2) {
        moments.add(*points.get(first + config.seed_px)?);
        moments.remove(points[first]);
        first += 1;
    }
    Some((first, moments))
}

/// A line as it grows.
struct Growth {
    moments: Moments,
    line: FittedLine,
    /// After how many more points it is fitted anew.
    refit_in: usize,
}

impl Growth {
    /// Takes points for as long as not too many in a row are off the line. Returns how many of the given ones reach to
    /// the last that is on it.
    fn take<'a>(
        &mut self,
        points: impl Iterator<Item = &'a Point2<f64>>,
        config: &LineConfig,
    ) -> usize {
        let mut reached = 0;
        for (place, &point) in points.enumerate() {
            if self.line.across_px(point).abs() <= config.max_deviation_px {
                self.moments.add(point);
                reached = place + 1;
                self.refit_in -= 1;
                if self.refit_in == 0 {
                    self.line = self.moments.line(self.line.direction);
                    self.refit_in = (self.moments.count() >> REFIT_SHIFT).max(1);
                }
            } else if place - reached >= config.max_outliers_px {
                break;
            }
        }
        reached
    }
}
