//! The points of a map above each cell.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, GridCell, VoxelKey};
use nalgebra::Vector3;

use super::{GridConfig, GridPoints};

/// A cell with fewer points of the band is not occupied: one may be noise.
const LEAST_POINTS: u32 = 2;
/// A surface is in the cell behind it: its points are taken so far behind the surface, in cells, against the normal. A surface
/// between two cells is then in the one that the body is in, and its noise in no other.
const INTO_THE_BODY: f32 = 0.2;
/// Floor faces up.
const LEAST_UP: f32 = 0.7;

/// How many points a cell has.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Column {
    in_band: u32,
    of_floor: u32,
}

/// The cells that have points in the band, or of the floor.
#[derive(Clone, Debug, Default)]
pub(crate) struct Columns {
    /// By cell, z being 0. Its order reaches no result.
    columns: HashMap<VoxelKey, Column, BuildVoxelHasher>,
}

impl Columns {
    /// Of the points of a map whose floor is at this height.
    pub(crate) fn of(config: &GridConfig, points: GridPoints<'_>, floor_m: f64) -> Self {
        let resolution_m = config.grid_resolution_m;
        let into_m = INTO_THE_BODY * resolution_m as f32;
        let band_m = config.grid_min_height_m..=config.grid_max_height_m;
        let has_normals = points.normals.len() == points.points_m.len();
        let mut columns = Self::default();
        for (index, point) in points.points_m.iter().enumerate() {
            if !geometry::is_finite(point) {
                continue;
            }
            let normal = points.normals.get(index).copied().filter(|_| has_normals);
            let height_m = f64::from(point.z) - floor_m;
            let is_in_band = band_m.contains(&height_m);
            let is_floor = height_m.abs() < config.grid_min_height_m
                && normal.is_none_or(|normal| normal.z >= LEAST_UP);
            if !is_in_band && !is_floor {
                continue;
            }
            let behind = normal
                .filter(|_| is_in_band)
                .map_or_else(Vector3::zeros, |normal| normal * -into_m);
            let place = point + behind;
            // The casts saturate.
            let cell = |along: f32| (f64::from(along) / resolution_m).floor() as i32;
            let key = VoxelKey { x: cell(place.x), y: cell(place.y), z: 0 };
            let column = columns.columns.entry(key).or_default();
            column.in_band += u32::from(is_in_band);
            column.of_floor += u32::from(is_floor);
        }
        columns
    }

    /// Calls `visit` with what each cell is, in no order that means anything.
    pub(crate) fn for_each(&self, floor_is_free: bool, mut visit: impl FnMut([i32; 2], GridCell)) {
        for (VoxelKey { x, y, .. }, column) in &self.columns {
            if column.in_band >= LEAST_POINTS {
                visit([*x, *y], GridCell::Occupied);
            } else if floor_is_free && column.of_floor > 0 && column.in_band == 0 {
                visit([*x, *y], GridCell::Free);
            }
        }
    }
}
