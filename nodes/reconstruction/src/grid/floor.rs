//! The height of the floor in a map whose z axis is up.

use nalgebra::Point3;

use super::GridPoints;

/// Layers are so high, and overlap by half: the noise of depth and a slight slope fit into one.
const LAYER_M: f64 = 0.06;
const HALF_LAYER_M: f64 = 0.5 * LAYER_M;
/// The area of a layer is counted in cells of this edge.
const CELL_M: f64 = 0.1;
/// A floor that is seen has at least so many cells: 0.3 m2, more than a seat has.
const LEAST_CELLS: usize = 30;
/// Half layers above a floor at which walls and furniture alone are: there is less than half of its area.
const ABOVE: i64 = 4;
/// The upward component of the normal of a level surface: within 25 degrees.
const LEAST_UP: f32 = 0.9;
/// Nothing is so far below a floor: where more than a few points of noise are, it is a table.
const BELOW_M: f64 = 0.12;
/// Points farther above or below the origin of the map are none of a building, nor of a mine.
const MOST_HEIGHT_M: f32 = 1e5;
/// The share of points that may lie below.
const MOST_BELOW: f64 = 0.01;

/// The height of the lowest level surface that is large enough to be a floor, with hardly anything below it; `None` where there is
/// none. With normals only points that face up count.
#[must_use]
pub fn find_floor_m(points: GridPoints<'_>) -> Option<f64> {
    let GridPoints { points_m, normals } = points;
    let has_normals = normals.len() == points_m.len();
    let faces_up = |index: usize| {
        !has_normals || normals.get(index).is_some_and(|normal| normal.z >= LEAST_UP)
    };
    let level: Vec<Point3<f32>> = points_m
        .iter()
        .enumerate()
        .filter_map(|(index, point)| faces_up(index).then_some(*point))
        .collect();
    let heights_m: Vec<f32> = points_m.iter().map(|point| point.z).collect();
    floor_of(&level, &heights_m)
}

/// The floor among points of level surfaces, by the heights of all points.
pub(super) fn floor_of(level: &[Point3<f32>], heights_m: &[f32]) -> Option<f64> {
    let is_height =
        |point: &&Point3<f32>| geometry::is_finite(point) && point.z.abs() <= MOST_HEIGHT_M;
    let level = || level.iter().filter(is_height);
    // The casts saturate.
    let along = |value: f32| (f64::from(value) / CELL_M).floor() as i32;
    let half_layer = |z: f32| (f64::from(z) / HALF_LAYER_M).floor() as i64;
    let mut cells: Vec<(i64, i32, i32)> = level()
        .flat_map(|point| {
            let (layer, x, y) = (half_layer(point.z), along(point.x), along(point.y));
            [(layer - 1, x, y), (layer, x, y)]
        })
        .collect();
    cells.sort_unstable();
    cells.dedup();
    let layers: Vec<(i64, usize)> = cells
        .chunk_by(|one, other| one.0 == other.0)
        .filter_map(|layer| layer.first().map(|first| (first.0, layer.len())))
        .collect();
    let area_of = |layer: i64| {
        let found = layers.binary_search_by_key(&layer, |(layer, _)| *layer).ok();
        found.and_then(|index| layers.get(index)).map_or(0, |(_, area)| *area)
    };
    let is_floor =
        |(layer, area): &(i64, usize)| *area >= LEAST_CELLS && 2 * area_of(layer + ABOVE) <= *area;
    let (lowest, _) = *layers.iter().find(|layer| is_floor(layer))?;
    // The next ones may have more of the same floor.
    let layer = (lowest..lowest + 3).max_by_key(|layer| (area_of(*layer), -layer))?;
    let is_in = |z: f32| (layer..layer + 2).contains(&half_layer(z));
    let mut floor_m: Vec<f32> = level().map(|point| point.z).filter(|z| is_in(*z)).collect();
    let middle = floor_m.len() / 2;
    if floor_m.is_empty() {
        return None;
    }
    let (_, median_m, _) = floor_m.select_nth_unstable_by(middle, f32::total_cmp);
    let median_m = f64::from(*median_m);
    let below = heights_m.iter().filter(|z| f64::from(**z) < median_m - BELOW_M).count();
    (below as f64 <= MOST_BELOW * heights_m.len() as f64).then_some(median_m)
}
