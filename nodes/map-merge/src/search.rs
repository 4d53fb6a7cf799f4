//! Where one map may lie in another, as seen from above: for each yaw that comes into question every shift, by branch and bound (Hess
//! et al. 2016, "Real-time loop closure in 2D LIDAR SLAM", section V.B; the score is a sum over a plan as in Carpin 2008, "Fast and
//! accurate map merging for multi-robot systems"). Nothing is drawn at random, and nothing of the range is left out.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::{Isometry3, Point2, Point3, Rotation2, Translation3, UnitQuaternion, Vector3};

use crate::plan::{CELL_M, Cell, LEVELS, Plan, upright_cells};
use crate::saved_map::{Lie, PreparedMap};

/// Places nearer to each other than this, in metres and radians, are one: the registration leads from one to the other.
const SAME_M: f64 = 0.5;
const SAME_RAD: f64 = 0.14;
/// The places that are looked at more closely: of a wrong one among the first few the other side, the next room and the quarter turns
/// are distinct, and the right one is among them although furniture has moved.
const MOST_PLACES: usize = 12;
/// A place that has less than this share of the best score is none.
const LEAST_SHARE: f32 = 0.4;
/// So many cells of the other map suffice for a score, taken at equal steps from all.
const MOST_CELLS: usize = 4000;
/// The most windows that are looked into; it bounds the time where all is alike.
const MOST_WINDOWS: usize = 300_000;
/// The end of the work is asked for every so many windows.
const ASK_EVERY: usize = 512;

/// A place of one map in the other, as seen from above.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Place {
    pub(crate) score: f32,
    pub(crate) yaw_rad: f64,
    /// Of the middle of the other map.
    pub(crate) middle_m: Point2<f64>,
}

/// The places that were found, the best first.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Places {
    pub(crate) places: Vec<Place>,
    /// The middle of the other map, in its level frame.
    middle_m: Point2<f64>,
}

impl Places {
    /// Takes the level frame of `b` to that of `a`.
    pub(crate) fn a_from_b(&self, place: &Place, up_m: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), place.yaw_rad);
        let turned = turn * Point3::new(self.middle_m.x, self.middle_m.y, 0.0);
        let [x_m, y_m] = [place.middle_m.x - turned.x, place.middle_m.y - turned.y];
        Isometry3::from_parts(Translation3::new(x_m, y_m, up_m), turn)
    }
}

/// Half of the extent of the upright surfaces of a map, seen from above.
pub(crate) fn radius_m(map: &PreparedMap) -> f64 {
    let middle_m = middle_m(map);
    map.lying(Lie::Upright).map(|piece| (piece.place_m.xy() - middle_m).norm()).fold(0.0, f64::max)
}

fn middle_m(map: &PreparedMap) -> Point2<f64> {
    let (mut sum, mut count) = (Point2::origin(), 0.0_f64);
    for piece in map.lying(Lie::Upright) {
        sum += piece.place_m.xy().coords;
        count += 1.0;
    }
    sum / count.max(1.0)
}

/// A window of shifts at one yaw.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// No shift of the window has a higher score.
    bound: f32,
    yaw: usize,
    level: usize,
    shift: Cell,
}

impl Ord for Window {
    /// Equal bounds have an order too, so that the result is the same each time.
    fn cmp(&self, other: &Self) -> Ordering {
        let rest = |window: &Self| (window.level, window.yaw, window.shift);
        self.bound.total_cmp(&other.bound).then_with(|| rest(other).cmp(&rest(self)))
    }
}

impl PartialOrd for Window {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Window {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Window {}

/// The upright surfaces of the other map at a yaw, about its middle.
struct Turned {
    yaw_rad: f64,
    cells: Vec<(Cell, f32)>,
}

impl Turned {
    fn of(map: &PreparedMap, middle_m: &Point2<f64>, yaw_rad: f64) -> Self {
        let turn = Rotation2::new(yaw_rad);
        let places = map.lying(Lie::Upright).map(|piece| {
            let seen = turn * (piece.place_m.xy() - middle_m);
            Point3::new(seen.x, seen.y, piece.place_m.z)
        });
        let cells = upright_cells(places);
        let step = cells.len().div_ceil(MOST_CELLS).max(1);
        Self { yaw_rad, cells: cells.into_iter().step_by(step).collect() }
    }

    /// The score of the best shift of a window, or more.
    fn bound(&self, plan: &Plan, level: usize, [x, y]: Cell) -> f32 {
        self.cells
            .iter()
            .map(|([cx, cy], weight)| weight * plan.count(level, [cx + x, cy + y]))
            .sum()
    }

    /// The windows of the widest level that hold every shift at which the maps touch.
    fn widest(&self, plan: &Plan) -> impl Iterator<Item = Cell> + use<> {
        let width = 1 << LEVELS;
        let bounds = plan.bounds();
        let range = |axis: usize| {
            let along = || self.cells.iter().map(|(cell, _)| cell[axis]);
            let (least, most) = (along().min().unwrap_or(0), along().max().unwrap_or(0));
            (bounds[axis][0] - most)..(bounds[axis][1] - least)
        };
        let (x, y) = (range(0), range(1));
        y.step_by(width).flat_map(move |y| x.clone().step_by(width).map(move |x| [x, y]))
    }
}

/// The most likely places of `b` in the plan of `a`, at these yaws. `None` when the work was ended.
pub(crate) fn places(
    plan: &Plan,
    b: &PreparedMap,
    yaws_rad: &[f64],
    is_over: &dyn Fn() -> bool,
) -> Option<Places> {
    let middle_m = middle_m(b);
    let mut turned = Vec::with_capacity(yaws_rad.len());
    let mut windows = BinaryHeap::new();
    for (yaw, yaw_rad) in yaws_rad.iter().enumerate() {
        if is_over() {
            return None;
        }
        let at_yaw = Turned::of(b, &middle_m, *yaw_rad);
        windows.extend(at_yaw.widest(plan).map(|shift| {
            let bound = at_yaw.bound(plan, LEVELS, shift);
            Window { bound, yaw, level: LEVELS, shift }
        }));
        turned.push(at_yaw);
    }
    let mut places: Vec<Place> = Vec::new();
    let mut looked = 0;
    while let Some(window) = windows.pop() {
        looked += 1;
        if looked % ASK_EVERY == 0 && is_over() {
            return None;
        }
        let least = places.first().map_or(0.0, |best| LEAST_SHARE * best.score);
        if places.len() == MOST_PLACES || window.bound <= least || looked > MOST_WINDOWS {
            break;
        }
        let at_yaw = &turned[window.yaw];
        if places.iter().any(|place| is_part_of(&window, at_yaw.yaw_rad, place)) {
            continue;
        }
        let Some(finer) = window.level.checked_sub(1) else {
            let middle_m = Point2::from(window.shift.map(|cell| f64::from(cell) * CELL_M));
            places.push(Place { score: window.bound, yaw_rad: at_yaw.yaw_rad, middle_m });
            continue;
        };
        let half = 1 << finer;
        for [dx, dy] in [[0, 0], [half, 0], [0, half], [half, half]] {
            let shift = [window.shift[0] + dx, window.shift[1] + dy];
            let bound = at_yaw.bound(plan, finer, shift);
            windows.push(Window { bound, level: finer, shift, ..window });
        }
    }
    Some(Places { places, middle_m })
}

/// Whether all of a window is the same place as one that was found.
fn is_part_of(window: &Window, yaw_rad: f64, place: &Place) -> bool {
    let width_m = f64::from((1 << window.level) - 1) * CELL_M;
    let farthest_m = [(0, place.middle_m.x), (1, place.middle_m.y)].map(|(axis, of_place_m)| {
        let first_m = f64::from(window.shift[axis]) * CELL_M;
        (first_m - of_place_m).abs().max((first_m + width_m - of_place_m).abs())
    });
    let turn_rad = Rotation2::new(yaw_rad - place.yaw_rad).angle().abs();
    turn_rad < SAME_RAD && farthest_m[0].hypot(farthest_m[1]) < SAME_M
}

/// Whether two poses of a map are one: by its middle, in its own frame.
pub(crate) fn is_same_place(
    one: &Isometry3<f64>,
    other: &Isometry3<f64>,
    middle_m: &Point3<f64>,
) -> bool {
    (one * middle_m - other * middle_m).norm() < SAME_M
        && one.rotation.angle_to(&other.rotation) < SAME_RAD
}

#[cfg(test)]
mod tests;
