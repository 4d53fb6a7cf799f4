//! The height of the floor in a map whose z axis is up.

use std::collections::{BTreeMap, HashSet};

use nalgebra::Point3;

use super::GridPoints;

/// Layers are so high, and overlap by half: the noise of depth and a slight slope fit into one.
const HALF_LAYER_MM: i64 = 30;
/// The area of a layer is counted in cells of this edge.
const CELL_M: f64 = 0.1;
/// A floor that is seen has at least so many cells: 0.3 m2, more than a seat has.
const LEAST_CELLS: usize = 30;
/// Half layers above a floor at which walls and furniture alone are: there is less than half of its area.
const ABOVE: i64 = 4;
/// The upward component of the normal of a level surface: within 25 degrees.
const LEAST_UP: f32 = 0.9;
/// Nothing is so far below a floor: where more than a few points of noise are, it is a table.
const BELOW_MM: i64 = 120;
/// Points farther above or below the origin of the map are none of a building, nor of a mine.
const MOST_HEIGHT_M: f32 = 1e5;
/// The share of points that may lie below.
const MOST_BELOW: f64 = 0.01;
/// The most cells of all layers that are counted: 2,500 m2 of floor, twice over.
const MOST_CELLS: usize = 500_000;

/// The height of the lowest level surface that is large enough to be a floor, with hardly anything below it; `None` where there is
/// none. With normals only points that face up count.
#[must_use]
pub fn find_floor_m(points: GridPoints<'_>) -> Option<f64> {
    let GridPoints { points_m, normals } = points;
    let has_normals = normals.len() == points_m.len();
    let faces_up = |index: usize| {
        !has_normals || normals.get(index).is_some_and(|normal| normal.z >= LEAST_UP)
    };
    let level = points_m.iter().enumerate().filter(|(index, _)| faces_up(*index));
    let mut finder = FloorFinder::default();
    finder.take(level.map(|(_, point)| *point), points_m.iter().map(|point| point.z));
    finder.floor_m()
}

/// Finds the floor in what is seen from cycle to cycle.
#[derive(Clone, Debug, Default)]
pub(super) struct FloorFinder {
    /// The cells of the layers that have some level surface: half layer, x and y.
    cells: HashSet<(i64, i32, i32)>,
    /// How many each layer has.
    areas: BTreeMap<i64, usize>,
    /// Points of level surfaces, by their heights in millimetres.
    level: BTreeMap<i64, u64>,
    /// All points.
    all: BTreeMap<i64, u64>,
}

impl FloorFinder {
    /// Takes points of level surfaces, and the heights of all points.
    pub(super) fn take(
        &mut self,
        level: impl Iterator<Item = Point3<f32>>,
        heights_m: impl Iterator<Item = f32>,
    ) {
        // The casts saturate.
        let in_mm = |height_m: f32| (f64::from(height_m) * 1e3).floor() as i64;
        let along = |value_m: f32| (f64::from(value_m) / CELL_M).floor() as i32;
        let is_height = |height_m: f32| height_m.abs() <= MOST_HEIGHT_M;
        for point in level.filter(|point| geometry::is_finite(point) && is_height(point.z)) {
            let height_mm = in_mm(point.z);
            *self.level.entry(height_mm).or_default() += 1;
            let half_layer = height_mm.div_euclid(HALF_LAYER_MM);
            for layer in [half_layer - 1, half_layer] {
                let is_new = self.cells.len() < MOST_CELLS
                    && self.cells.insert((layer, along(point.x), along(point.y)));
                *self.areas.entry(layer).or_default() += usize::from(is_new);
            }
        }
        for height_m in heights_m.filter(|height_m| is_height(*height_m)) {
            *self.all.entry(in_mm(height_m)).or_default() += 1;
        }
    }

    /// The height of the floor.
    pub(super) fn floor_m(&self) -> Option<f64> {
        let area_of = |layer: i64| self.areas.get(&layer).copied().unwrap_or(0);
        let is_floor = |(layer, area): &(&i64, &usize)| {
            **area >= LEAST_CELLS && 2 * area_of(**layer + ABOVE) <= **area
        };
        let (&lowest, _) = self.areas.iter().find(is_floor)?;
        // The next ones may have more of the same floor.
        let layer = (lowest..lowest + 3).max_by_key(|layer| (area_of(*layer), -layer))?;
        let (from_mm, until_mm) = (layer * HALF_LAYER_MM, (layer + 2) * HALF_LAYER_MM);
        let floor = || self.level.range(from_mm..until_mm);
        let half = floor().map(|(_, points)| points).sum::<u64>() / 2;
        let mut before = 0;
        let (&median_mm, _) = floor().find(|(_, points)| {
            before += **points;
            before > half
        })?;
        let below: u64 = self.all.range(..median_mm - BELOW_MM).map(|(_, points)| points).sum();
        let all: u64 = self.all.values().sum();
        let is_lowest = below as f64 <= MOST_BELOW * all as f64;
        is_lowest.then_some((median_mm as f64 + 0.5) / 1e3)
    }
}
