//! A line through each return and its neighbours on the same surface.

use std::ops::Range;

use nalgebra::{Point2, Vector2};

use crate::scan_returns::{DeskewedReturn, Return, ScanReturns};

/// Returns with more beams missing between them are not neighbours: a scanner loses one beam here and there.
const MOST_STEPS: usize = 3;
/// A surface seen more grazingly than this is not distinguished from a step in depth: tan(80 degrees).
const GRAZING_TAN: f64 = 5.67;
/// Ranges differ by more than noise beyond this many standard deviations of one.
const NOISE_STEP: f64 = 4.0;
/// A line reaches this far to each side: longer than the noise is high, shorter than furniture.
const HALF_WINDOW_M: f64 = 0.15;
/// Where beams are wide apart it takes this many neighbours to a side in any case ...
const LEAST_BESIDE: usize = 2;
/// ... or to the one side, when it only has one ...
const LEAST_ON_ONE_SIDE: usize = 4;
/// ... unless they are farther than this: the space between is not known.
const LONGEST_WINDOW_M: f64 = 1.0;
/// More neighbours to a side add cost and nothing else.
const MOST_BESIDE: usize = 30;
/// A line needs this many points to be overdetermined.
const LEAST_POINTS: usize = 5;
/// Points that deviate by more than this many times the noise form no line.
const ROUGHEST: f64 = 3.0;
/// A line whose direction is less certain is dropped: 11 degrees.
const LEAST_CERTAIN_NORMAL_RAD: f64 = 0.2;
/// Two lines are compared by how well they are known at this distance from the return, two spacings of the map.
const NEARBY_M: f64 = 0.1;
/// A line represents this much of its surface to each side, at most: half of the smallest reach of a search.
const LONGEST_HALF_M: f64 = 0.25;

/// A piece of a surface around a return, in the frame of the middle of the turn.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct LocalLine {
    /// The return's place on the line.
    pub(crate) position_m: Point2<f64>,
    /// Of length 1, towards the scanner.
    pub(crate) normal: Vector2<f64>,
    /// How far the line reaches to each side.
    pub(crate) half_length_m: f64,
    /// Of the position along the normal.
    pub(crate) offset_variance_m2: f64,
    /// Of the normal's angle.
    pub(crate) normal_variance_rad2: f64,
}

impl LocalLine {
    /// Its variance where returns of other scans will be matched to it.
    fn variance_nearby_m2(&self) -> f64 {
        self.offset_variance_m2 + self.normal_variance_rad2 * NEARBY_M * NEARBY_M
    }
}

/// The line of each return; `None` where it has too few neighbours, or these lie on no line.
pub(crate) fn local_lines(
    turn: &ScanReturns,
    sightings: &[DeskewedReturn],
) -> Vec<Option<LocalLine>> {
    let mut lines = vec![None; turn.returns.len()];
    let order = order_from_an_edge(turn);
    for run in runs(turn, &order) {
        let surface = Surface::new(&order[run], sightings);
        for (place, &index) in surface.order.iter().enumerate() {
            lines[index] = surface.line_at(place, &turn.returns[index], turn.step_rad);
        }
    }
    lines
}

/// The returns in the order of their beams, for a full turn starting at an edge, so that no surface is cut by the
/// seam.
fn order_from_an_edge(turn: &ScanReturns) -> Vec<usize> {
    let mut order: Vec<usize> = (0..turn.returns.len()).collect();
    if turn.is_closed {
        let edge = order
            .windows(2)
            .position(|pair| !is_one_surface(turn, &turn.returns[pair[0]], &turn.returns[pair[1]]));
        order.rotate_left(edge.map_or(0, |edge| edge + 1));
    }
    order
}

/// Stretches of `order` that lie on one surface each.
fn runs(turn: &ScanReturns, order: &[usize]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 0;
    for next in 1..=order.len() {
        let goes_on = next < order.len()
            && is_one_surface(turn, &turn.returns[order[next - 1]], &turn.returns[order[next]]);
        if !goes_on {
            runs.push(start..next);
            start = next;
        }
    }
    runs
}

fn is_one_surface(turn: &ScanReturns, from: &Return, to: &Return) -> bool {
    // Round the seam the number of beams is a full turn.
    let steps = if to.beam > from.beam {
        to.beam - from.beam
    } else {
        (to.beam + turn.beams).saturating_sub(from.beam)
    };
    let slope_m = GRAZING_TAN * steps as f64 * turn.step_rad * from.range_m.min(to.range_m);
    let noise_m = NOISE_STEP * from.std_dev_m.max(to.std_dev_m);
    steps <= MOST_STEPS && (from.range_m - to.range_m).abs() <= slope_m.max(noise_m)
}

/// The points of a run, with the running sums that fit a line to any stretch of them at once.
struct Surface<'a> {
    order: &'a [usize],
    points_m: Vec<Point2<f64>>,
    sums: Vec<Moments>,
}

#[derive(Clone, Copy, Default)]
struct Moments {
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl<'a> Surface<'a> {
    fn new(order: &'a [usize], sightings: &[DeskewedReturn]) -> Self {
        let points_m: Vec<_> = order.iter().map(|&index| sightings[index].point_m).collect();
        let mut sums = Vec::with_capacity(points_m.len() + 1);
        let mut sum = Moments::default();
        sums.push(sum);
        for point in &points_m {
            // From the first point: sums of squares of large numbers would lose the small ones.
            let [x, y]: [f64; 2] = (point - points_m[0]).into();
            sum.x += x;
            sum.y += y;
            sum.xx += x * x;
            sum.xy += x * y;
            sum.yy += y * y;
            sums.push(sum);
        }
        Self { order, points_m, sums }
    }

    /// Of the lines through the neighbours on both sides, on the one and on the other, the most certain one: beside
    /// a corner those of one wall.
    fn line_at(&self, place: usize, one: &Return, step_rad: f64) -> Option<LocalLine> {
        let (behind, ahead) = (
            self.reaches(place, false, HALF_WINDOW_M, LEAST_BESIDE),
            self.reaches(place, true, HALF_WINDOW_M, LEAST_BESIDE),
        );
        let only_behind = self.reaches(place, false, 2.0 * HALF_WINDOW_M, LEAST_ON_ONE_SIDE);
        let only_ahead = self.reaches(place, true, 2.0 * HALF_WINDOW_M, LEAST_ON_ONE_SIDE);
        [behind..ahead + 1, only_behind..place + 1, place..only_ahead + 1]
            .into_iter()
            .filter_map(|window| self.fit(window, place, one, step_rad))
            .min_by(|a, b| a.variance_nearby_m2().total_cmp(&b.variance_nearby_m2()))
    }

    /// The farthest place to a side that belongs to a window of this length.
    fn reaches(&self, place: usize, ahead: bool, length_m: f64, least: usize) -> usize {
        let mut farthest = place;
        for count in 1..=MOST_BESIDE {
            let next = if ahead { place + count } else { place.wrapping_sub(count) };
            let Some(point) = self.points_m.get(next) else { break };
            let far_m = (point - self.points_m[place]).norm();
            let limit_m = if count <= least { LONGEST_WINDOW_M } else { length_m };
            if far_m > limit_m {
                break;
            }
            farthest = next;
        }
        farthest
    }

    /// The line with the least squares of the distances to the points of a window.
    fn fit(
        &self,
        window: Range<usize>,
        place: usize,
        one: &Return,
        step_rad: f64,
    ) -> Option<LocalLine> {
        if window.len() < LEAST_POINTS {
            return None;
        }
        let (from, to) = (&self.sums[window.start], &self.sums[window.end]);
        let count = window.len() as f64;
        let mean = Vector2::new(to.x - from.x, to.y - from.y) / count;
        let xx = to.xx - from.xx - count * mean.x * mean.x;
        let xy = to.xy - from.xy - count * mean.x * mean.y;
        let yy = to.yy - from.yy - count * mean.y * mean.y;
        // The eigenvalues of the scatter: the larger along the line, the smaller what is left over.
        let apart = (xx - yy).hypot(2.0 * xy);
        let (along, left_over) = (0.5 * (xx + yy + apart), (0.5 * (xx + yy - apart)).max(0.0));
        let angle_rad = 0.5 * (2.0 * xy).atan2(xx - yy);
        let tangent = Vector2::new(angle_rad.cos(), angle_rad.sin());
        let point = self.points_m[place];
        let on_line_m = (point - self.points_m[0] - mean).dot(&tangent);
        let position_m = self.points_m[0] + mean + on_line_m * tangent;
        let normal = Vector2::new(-tangent.y, tangent.x);
        // The origin is where the scanner is, to within its motion in half a revolution.
        let normal = if normal.dot(&position_m.coords) > 0.0 { -normal } else { normal };

        let direction = point.coords.try_normalize(f64::EPSILON)?;
        let expected = one.variance_along_m2(&normal, &direction, step_rad);
        let found = left_over / (count - 2.0);
        let variance = expected.max(found);
        let normal_variance_rad2 = variance / along;
        // Not the opposite comparison: NaN is no line either.
        let is_line = found <= ROUGHEST * ROUGHEST * expected
            && normal_variance_rad2 <= LEAST_CERTAIN_NORMAL_RAD * LEAST_CERTAIN_NORMAL_RAD;
        if !is_line {
            return None;
        }
        let ends = [window.start, window.end - 1].map(|end| (self.points_m[end] - point).norm());
        Some(LocalLine {
            position_m,
            normal,
            half_length_m: ends[0].max(ends[1]).min(LONGEST_HALF_M),
            offset_variance_m2: variance * (1.0 / count + on_line_m * on_line_m / along),
            normal_variance_rad2,
        })
    }
}

#[cfg(test)]
mod tests;
