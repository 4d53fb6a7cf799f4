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
/// A way over so many cells tells what the robot drives on: 1 m.
const LEAST_WAY_CELLS: usize = 10;
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
///
/// It is the lowest of the level surfaces that are large enough: the others are tables. But where most of the robot's way over level surfaces
/// leads over a higher one, that is it: below are stairs that lead down, another storey, or what a wet floor mirrors.
#[derive(Clone, Debug, Default)]
pub(super) struct FloorFinder {
    /// The cells of the layers that have some level surface: half layer, x and y.
    cells: HashSet<(i64, i32, i32)>,
    /// How many each layer has.
    areas: BTreeMap<i64, usize>,
    /// The cells that the camera has been above, x and y.
    way: HashSet<(i32, i32)>,
    /// How many of them each layer has.
    under_way: BTreeMap<i64, usize>,
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
        let is_height = |height_m: f32| height_m.abs() <= MOST_HEIGHT_M;
        for point in level.filter(|point| geometry::is_finite(point) && is_height(point.z)) {
            let height_mm = in_mm(point.z);
            *self.level.entry(height_mm).or_default() += 1;
            let half_layer = height_mm.div_euclid(HALF_LAYER_MM);
            let (x, y) = (cell_along(point.x), cell_along(point.y));
            for layer in [half_layer - 1, half_layer] {
                let is_new = self.cells.len() < MOST_CELLS && self.cells.insert((layer, x, y));
                *self.areas.entry(layer).or_default() += usize::from(is_new);
                if is_new && self.way.contains(&(x, y)) {
                    *self.under_way.entry(layer).or_default() += 1;
                }
            }
        }
        for height_m in heights_m.filter(|height_m| is_height(*height_m)) {
            *self.all.entry(in_mm(height_m)).or_default() += 1;
        }
    }

    /// Notes that the camera is above a place.
    pub(super) fn pass_over(&mut self, x_m: f32, y_m: f32) {
        let (x, y) = (cell_along(x_m), cell_along(y_m));
        if self.way.len() < MOST_CELLS && self.way.insert((x, y)) {
            let layers = self.areas.keys().filter(|layer| self.cells.contains(&(**layer, x, y)));
            for layer in layers {
                *self.under_way.entry(*layer).or_default() += 1;
            }
        }
    }

    /// The height of the floor.
    pub(super) fn floor_m(&self) -> Option<f64> {
        let area_of = |layer: i64| self.areas.get(&layer).copied().unwrap_or(0);
        let is_floor = |(layer, area): &(&i64, &usize)| {
            **area >= LEAST_CELLS && 2 * area_of(**layer + ABOVE) <= **area
        };
        let (&lowest, _) = self.areas.iter().find(is_floor)?;
        let driven_on = self.driven_on().filter(|layer| *layer > lowest + ABOVE);
        let first = driven_on.unwrap_or(lowest);
        // The next ones may have more of the same floor.
        let layer = (first..first + 3).max_by_key(|layer| (area_of(*layer), -layer))?;
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
        (driven_on.is_some() || is_lowest).then_some((median_mm as f64 + 0.5) / 1e3)
    }

    /// The lowest layer of the surface that most of the way over level surfaces leads over, where that is long enough to tell.
    fn driven_on(&self) -> Option<i64> {
        let by_cells = |(layer, cells): &(&i64, &usize)| (**cells, -**layer);
        let (&layer, &cells) = self.under_way.iter().max_by_key(by_cells)?;
        let area = self.areas.get(&layer).copied().unwrap_or(0);
        (cells >= LEAST_WAY_CELLS && area >= LEAST_CELLS).then_some(layer)
    }
}

/// The cell of a place along x or y. The cast saturates.
fn cell_along(value_m: f32) -> i32 {
    (f64::from(value_m) / CELL_M).floor() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The points of a level surface, 5 cm apart.
    fn level(x_m: [f32; 2], y_m: [f32; 2], z_m: f32) -> Vec<Point3<f32>> {
        let along = |[from_m, to_m]: [f32; 2]| {
            (0..((to_m - from_m) / 0.05) as u32).map(move |at| from_m + 0.05 * at as f32)
        };
        along(x_m).flat_map(|x| along(y_m).map(move |y| Point3::new(x, y, z_m))).collect()
    }

    fn finder_of(surfaces: &[Vec<Point3<f32>>]) -> FloorFinder {
        let mut finder = FloorFinder::default();
        for points in surfaces {
            finder.take(points.iter().copied(), points.iter().map(|point| point.z));
        }
        finder
    }

    fn is_at(finder: &FloorFinder, height_m: f64) -> bool {
        finder.floor_m().is_some_and(|floor_m| (floor_m - height_m).abs() < 0.01)
    }

    /// Regression: beside stairs that lead down the floor was the lower storey's, and no cell of the robot's own was free.
    #[test]
    fn the_floor_is_what_the_robot_drives_on_though_there_is_a_lower_one() {
        let own = level([0.0, 2.5], [-1.0, 1.0], 0.0);
        let below = level([4.0, 9.0], [-1.5, 1.5], -1.53);
        let mut finder = finder_of(&[own.clone(), below.clone()]);
        assert!(is_at(&finder, -1.53));
        for step in 0..24 {
            finder.pass_over(0.05 * step as f32, 0.0);
        }
        assert!(is_at(&finder, 0.0), "{:?}", finder.floor_m());
        // In any order.
        let mut later = FloorFinder::default();
        for step in 0..24 {
            later.pass_over(0.05 * step as f32, 0.0);
        }
        for points in [below, own] {
            later.take(points.iter().copied(), points.iter().map(|point| point.z));
        }
        assert_eq!(later.floor_m(), finder.floor_m());
    }

    #[test]
    fn a_table_that_the_way_leads_beside_is_no_floor() {
        let floor = level([0.0, 4.0], [-2.0, 2.0], -0.9);
        let table = level([1.0, 2.5], [0.3, 1.1], -0.2);
        let mut finder = finder_of(&[floor, table]);
        for step in 0..60 {
            finder.pass_over(0.05 * step as f32, 0.0);
        }
        // A camera on a mast reaches over its edge for a while.
        (0..8).for_each(|step| finder.pass_over(1.0 + 0.1 * step as f32, 0.5));
        assert!(is_at(&finder, -0.9), "{:?}", finder.floor_m());
    }
}
