//! A coarse search for the pose, for where the prediction does not lead onto the map: how many returns fall onto cells
//! that lines of the map run through (correlative matching, Olson 2009, at one resolution).

use std::f64::consts::PI;

use nalgebra::{Isometry2, Point2, UnitComplex, Vector2};

use crate::local_map::LocalMap;
use crate::scan_returns::DeskewedReturn;

/// Cells of the search: the registration finds what is left from half of the radius that it looks within.
const CELL_M: f64 = 0.1;
/// Steps of the angle: at 4 m, a cell and a half.
const ANGLE_STEP_RAD: f64 = 2.5 * PI / 180.0;
/// This many returns, spread over the revolution, decide.
const MOST_RETURNS: usize = 120;
/// Returns and lines farther away are left out: the grid stays small.
const REACH_M: f64 = 25.0;
/// A return on a line's own cell counts this much, on one beside it 1.
const ON_CELL: u8 = 2;
/// Between poses of equal count the one nearer to the prediction is taken: this much of all returns a cell or step.
const NEARER: f64 = 1e-3;

/// How far around the prediction to search.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct SearchWindow {
    pub(crate) position_m: f64,
    pub(crate) turn_rad: f64,
}

/// The pose around `predicted` under which most returns fall onto the map. `None` without returns or lines.
pub(crate) fn search(
    map: &LocalMap,
    sightings: &[DeskewedReturn],
    predicted: &Isometry2<f64>,
    window: &SearchWindow,
) -> Option<Isometry2<f64>> {
    let near = |one: &&DeskewedReturn| one.point_m.coords.norm() < REACH_M;
    let all: Vec<Vector2<f64>> =
        sightings.iter().filter(near).map(|one| one.point_m.coords).collect();
    let stride = all.len().div_ceil(MOST_RETURNS).max(1);
    let points: Vec<Vector2<f64>> = all.into_iter().step_by(stride).collect();
    let field = Field::of(map, &predicted.translation.vector.into(), window.position_m)?;
    let shifts = (window.position_m / CELL_M).ceil() as i64;
    let turns = (window.turn_rad / ANGLE_STEP_RAD).ceil() as i64;
    let mut best: Option<(f64, Isometry2<f64>)> = None;
    let mut cells = Vec::with_capacity(points.len());
    for turn in -turns..=turns {
        let rotation = UnitComplex::new(turn as f64 * ANGLE_STEP_RAD) * predicted.rotation;
        cells.clear();
        cells.extend(
            points
                .iter()
                .map(|point| field.cell(&(predicted.translation.vector + rotation * point).into())),
        );
        for row in -shifts..=shifts {
            for column in -shifts..=shifts {
                let hits: u64 = cells
                    .iter()
                    .map(|cell| u64::from(field.at(cell[0] + column, cell[1] + row)))
                    .sum();
                let away = (turn.abs() + row.abs() + column.abs()) as f64;
                let score = hits as f64 - NEARER * away * points.len() as f64;
                if hits > 0 && best.as_ref().is_none_or(|(most, _)| score > *most) {
                    let shift = CELL_M * Vector2::new(column as f64, row as f64);
                    let translation = predicted.translation.vector + shift;
                    best = Some((score, Isometry2::from_parts(translation.into(), rotation)));
                }
            }
        }
    }
    best.map(|(_, pose)| pose)
}

/// The cells that lines of the map run through.
struct Field {
    origin_m: Point2<f64>,
    side: i64,
    marks: Vec<u8>,
}

impl Field {
    fn of(map: &LocalMap, around_m: &Point2<f64>, margin_m: f64) -> Option<Self> {
        let far = |line: &&crate::local_map::MapLine| {
            let apart_m = (line.position_m - around_m).amax();
            (apart_m < REACH_M + margin_m).then_some(apart_m)
        };
        let farthest_m = map
            .lines()
            .iter()
            .filter_map(|line| far(&line))
            .fold(None, |most, apart_m| Some(f64::max(most.unwrap_or(0.0), apart_m)))?;
        let half_m = farthest_m + 2.0 * CELL_M;
        let side = (2.0 * half_m / CELL_M).ceil() as i64;
        let origin_m = around_m - Vector2::repeat(half_m);
        let mut field = Self { origin_m, side, marks: vec![0; (side * side) as usize] };
        for line in map.lines() {
            let [column, row] = field.cell(&line.position_m);
            for (aside, up) in (-1..=1).flat_map(|up| (-1..=1).map(move |aside| (aside, up))) {
                let mark = if (aside, up) == (0, 0) { ON_CELL } else { 1 };
                if let Some(cell) = field.index(column + aside, row + up) {
                    field.marks[cell] = field.marks[cell].max(mark);
                }
            }
        }
        Some(field)
    }

    fn cell(&self, point_m: &Point2<f64>) -> [i64; 2] {
        let place = (point_m - self.origin_m) / CELL_M;
        [place.x.floor() as i64, place.y.floor() as i64]
    }

    fn index(&self, column: i64, row: i64) -> Option<usize> {
        let within = (0..self.side).contains(&column) && (0..self.side).contains(&row);
        within.then_some((row * self.side + column) as usize)
    }

    fn at(&self, column: i64, row: i64) -> u8 {
        self.index(column, row).map_or(0, |index| self.marks[index])
    }
}

#[cfg(test)]
mod tests;
