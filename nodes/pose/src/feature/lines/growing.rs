//! Straight parts of an edge.

use nalgebra::Point2;

use super::LineConfig;
use super::gradient::GradientField;
use super::moments::{FittedLine, Moments};

/// While a line grows it is fitted again each time that it has grown by an eighth.
const REFIT_SHIFT: u32 = 3;
/// The peak of a gradient lies at most this far from the pixel that is the largest: farther, the three pixels are no peak.
const FARTHEST_PEAK_PX: f64 = 1.0;

/// Neighbouring pixels' points of an edge are no farther apart: a diagonal, and a half to each.
const CLOSED_PX: f64 = 2.5;

/// Where an edge turns, the smoothing bends it, over this many pixels: 5 of the kernel and 3 of the operator, half of them
/// on each side.
const BENT_ENDS_PX: usize = 3;

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
    let row = pixel / field.width_px;
    let (column, row) = ((pixel - row * field.width_px) as f64, row as f64);
    if along_row { Point2::new(column, row + peak_px) } else { Point2::new(column + peak_px, row) }
}

/// Appends the straight parts of an edge, given by its points in order (EDLines).
///
/// A line is laid through the first `seed_px` points that lie on one, and grows along the edge, and back, for as long
/// as points keep close to it; the rest of the edge begins where it ends. A closed edge is taken from the end of some
/// line on, since where it was closed there need not be a corner.
pub(super) fn grow(points: &mut [Point2<f64>], config: &LineConfig, found: &mut Vec<StraightEdge>) {
    if is_closed(points)
        && let Some((_, end)) = next_line(points, 0, config)
    {
        points.rotate_left(end);
    }
    let mut rest = 0;
    while let Some((line, end)) = next_line(points, rest, config) {
        found.push(line);
        rest = end;
    }
}

/// Whether an edge ends where it began.
fn is_closed(points: &[Point2<f64>]) -> bool {
    match points {
        [first, .., last] => (last - first).norm() < CLOSED_PX,
        _ => false,
    }
}

/// The first line after `rest` points, and after how many points it ends.
fn next_line(
    points: &[Point2<f64>],
    rest: usize,
    config: &LineConfig,
) -> Option<(StraightEdge, usize)> {
    let (first, seed) = first_seed(points, rest, config)?;
    let end = first + config.seed_px;
    let line = seed.line(points[end - 1] - points[first]);
    let mut growth = Growth { moments: seed, line, refit_in: 1 };
    let end = end + growth.take(points[end..].iter(), config);
    let start = first - growth.take(points[rest..first].iter().rev(), config);
    let moments = growth.settled(&points[start..end], config);
    let line = moments.line(growth.line.direction);
    let start_along_px = line.along_px(points[start]);
    let end_along_px = line.along_px(points[end - 1]);
    Some((StraightEdge { moments, line, start_along_px, end_along_px }, end))
}

/// The first run of this many consecutive points on a line: which, and their moments.
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
    /// After how many more points it is fitted again.
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

    /// The moments of the points that are on the line now, whether they were when they were reached or not; without those
    /// at the ends, if what remains is a seed or more.
    fn settled(&self, points: &[Point2<f64>], config: &LineConfig) -> Moments {
        let bent = if points.len() >= config.seed_px + 2 * BENT_ENDS_PX { BENT_ENDS_PX } else { 0 };
        let mut moments = Moments::default();
        for &point in &points[bent..points.len() - bent] {
            if self.line.across_px(point).abs() <= config.max_deviation_px {
                moments.add(point);
            }
        }
        // A line that left its own points behind as it grew keeps what it grew by.
        if moments.count() >= config.seed_px { moments } else { self.moments }
    }
}
