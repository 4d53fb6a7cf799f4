//! The occupancy grid for navigation: which cells of the floor plan are occupied, free or unknown.
//!
//! With [`GridSource::HeightBand`] a cell is occupied where the map has a surface within a band of heights above the floor. It is
//! free where a depth image was seen through low in the band, up to the nearest thing in that direction; in a map that was loaded
//! also where there is floor. What moves is not in the map, and what stood and left is cleared from it, so that neither is in the grid. With
//! [`GridSource::Scan`] a cell is what the scanner's rays say of it, without the beams that hit what moves.
//!
//! | module | what |
//! |---|---|
//! | `config` | the parameters |
//! | `floor` | the height of the floor, found in the map |
//! | `depth_fan` | up to where each direction of a depth image is free within the band |
//! | `columns` | the map's points above each cell |
//! | `observations` | what the cycles say of cells: [`volume::PlaneOccupancy`] |
//!
//! # Limits
//! Up is the z axis of the map's frame. A cell is free as soon as it was seen free at one height that is low enough
//! (`grid_free_below_m`): what is lower, and was never in view, is not seen. There is one floor.

mod columns;
mod config;
mod depth_fan;
mod floor;
mod observations;
#[cfg(test)]
pub(crate) mod tests;

use geometry::{GridCell, OccupancyGrid, Stamp};
use nalgebra::{Point3, Vector3};
use volume::{CellState, PlaneOccupancy};

pub(crate) use columns::Columns;
pub use config::{GridConfig, GridFloor, GridSource};
pub use floor::find_floor_m;
pub(crate) use observations::GridObservations;

/// The border of a grid is at multiples of so many cells, 1.6 m at 5 cm: it stays where it is while the map grows a little.
const BORDER_CELLS: i32 = 32;

/// There is no grid.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum GridError {
    /// It was not asked for.
    #[error("there is no grid: the parameter grid is none")]
    Off,
    /// Nothing is in the map.
    #[error("there is no grid: the map is empty")]
    EmptyMap,
    /// It is of scans, and none was seen.
    #[error("there is no grid: no scan was seen yet")]
    NoScan,
    /// The map shows no floor, above which the band would be.
    #[error(
        "there is no grid: no floor was found in the map's {points} points; with grid_floor given the height is that of \
         grid_floor_height_m"
    )]
    NoFloor {
        /// The points that were searched.
        points: usize,
    },
    /// It would have too many cells.
    #[error(
        "the grid would have {width} x {height} cells, and grid_max_cells is {most}: raise that or grid_resolution_m"
    )]
    TooLarge {
        /// Cells along x.
        width: u64,
        /// Cells along y.
        height: u64,
        /// The bound.
        most: usize,
    },
    /// A tile of the map cannot be read.
    #[error("the grid would be incomplete: {0}")]
    Unreadable(#[from] crate::tiles::TileError),
}

/// The points of a map.
#[derive(Clone, Copy, Debug)]
pub struct GridPoints<'a> {
    /// The points, in the map.
    pub points_m: &'a [Point3<f32>],
    /// Their normals, to the side from which they were seen: one a point, or none.
    pub normals: &'a [Vector3<f32>],
}

/// Cells along both axes, both ends included.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Bounds {
    least: [i32; 2],
    most: [i32; 2],
}

impl Bounds {
    fn around(bounds: Option<Self>, [x, y]: [i32; 2]) -> Self {
        bounds.map_or(Self { least: [x, y], most: [x, y] }, |Self { least, most }| Self {
            least: [least[0].min(x), least[1].min(y)],
            most: [most[0].max(x), most[1].max(y)],
        })
    }

    /// Out to multiples of [`BORDER_CELLS`].
    fn rounded(self) -> Self {
        let down = |cell: i32| cell.div_euclid(BORDER_CELLS).saturating_mul(BORDER_CELLS);
        let up = |cell: i32| down(cell).saturating_add(BORDER_CELLS - 1);
        Self { least: self.least.map(down), most: self.most.map(up) }
    }
}

/// The grid of a map's points alone: of a saved map, or with the method `rec_hv`. A cell is free where the map has floor and
/// nothing in the band.
///
/// # Errors
/// When nothing is in the map, no floor is found, or the grid would be too large.
pub fn grid_of_points(
    config: &GridConfig,
    points: GridPoints<'_>,
    (frame_id, stamp): (&str, Stamp),
) -> Result<OccupancyGrid, GridError> {
    if points.points_m.is_empty() {
        return Err(GridError::EmptyMap);
    }
    let floor_m =
        config.floor_m(points).ok_or(GridError::NoFloor { points: points.points_m.len() })?;
    let columns = Columns::of(config, points, floor_m);
    let mut grid = Layers::of_points(&columns).grid(config)?;
    grid.frame_id = frame_id.to_owned();
    grid.stamp = stamp;
    Ok(grid)
}

/// What is known of cells.
pub(crate) struct Layers<'a> {
    pub(crate) columns: Option<&'a Columns>,
    /// Whether a cell is free where the map has floor and nothing in the band. Where cycles are seen they say more: under a
    /// table there is floor, too.
    pub(crate) floor_is_free: bool,
    pub(crate) plane: Option<&'a PlaneOccupancy>,
    /// Whether what rays end at is occupied; otherwise that is what the map says.
    pub(crate) rays_occupy: bool,
}

impl<'a> Layers<'a> {
    fn of_points(columns: &'a Columns) -> Self {
        Self { columns: Some(columns), floor_is_free: true, plane: None, rays_occupy: false }
    }

    /// The grid, without stamp and frame.
    pub(crate) fn grid(&self, config: &GridConfig) -> Result<OccupancyGrid, GridError> {
        let mut bounds = None;
        self.for_each(|cell, _| bounds = Some(Bounds::around(bounds, cell)));
        let bounds = bounds.ok_or(GridError::EmptyMap)?.rounded();
        let size = |axis: usize| {
            (i64::from(bounds.most[axis]) - i64::from(bounds.least[axis]) + 1).unsigned_abs()
        };
        let (width, height, most) = (size(0), size(1), config.grid_max_cells);
        let cells = usize::try_from(width.saturating_mul(height)).unwrap_or(usize::MAX);
        if cells > most {
            return Err(GridError::TooLarge { width, height, most });
        }
        let mut grid = OccupancyGrid {
            resolution_m: config.grid_resolution_m,
            least: bounds.least,
            width: width as usize,
            height: height as usize,
            cells: vec![GridCell::Unknown; cells],
            ..OccupancyGrid::default()
        };
        self.for_each(|cell, state| {
            if let Some(place) = grid.index(cell).and_then(|index| grid.cells.get_mut(index))
                && *place != GridCell::Occupied
            {
                *place = state;
            }
        });
        Ok(grid)
    }

    fn for_each(&self, mut visit: impl FnMut([i32; 2], GridCell)) {
        if let Some(plane) = self.plane {
            plane.for_each_known(|cell, state| match state {
                CellState::Free => visit(cell, GridCell::Free),
                CellState::Occupied if self.rays_occupy => visit(cell, GridCell::Occupied),
                CellState::Occupied | CellState::Unknown => {}
            });
        }
        if let Some(columns) = self.columns {
            columns.for_each(self.floor_is_free, visit);
        }
    }
}
