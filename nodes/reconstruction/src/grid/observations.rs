//! What the cycles say of the cells of a grid.

use geometry::{OccupancyGrid, SegmentedCycle, Stamp};
use nalgebra::Isometry3;
use volume::{PlaneConfig, PlaneOccupancy};

use super::depth_fan::DepthFan;
use super::{Bounds, Columns, GridConfig, GridError, GridFloor, GridPoints, GridSource, Layers};
use crate::ConfigError;

/// Cells of a block of [`PlaneOccupancy`].
const BLOCK_CELLS: usize = 64;
/// Space is passed up to so many cells before what a depth image shows: half a cell is the surface's.
const MARGIN_CELLS: f64 = 0.5;
/// A floor that is found elsewhere than before makes what was seen in the former band void.
const SAME_FLOOR_M: f64 = 0.05;

/// The evidence on cells that cycles bring, and what the grids so far had. See [`super`].
#[derive(Clone, Debug)]
pub(crate) struct GridObservations {
    config: GridConfig,
    plane: PlaneOccupancy,
    fan: DepthFan,
    floor_m: Option<f64>,
    bounds: Option<Bounds>,
}

impl GridObservations {
    /// Nothing seen; `None` where no grid is asked for.
    pub(crate) fn new(config: &GridConfig) -> Result<Option<Self>, ConfigError> {
        if config.grid == GridSource::None {
            return Ok(None);
        }
        let max_blocks = config.grid_max_cells.div_ceil(BLOCK_CELLS);
        let plane =
            PlaneOccupancy::new(PlaneConfig { edge_m: config.grid_resolution_m, max_blocks })
                .map_err(|_| geometry::ParameterError {
                    name: "grid_resolution_m".into(),
                    accepted: "above 0".into(),
                    value: config.grid_resolution_m,
                })?;
        let given = config.grid_floor == GridFloor::Given;
        Ok(Some(Self {
            config: config.clone(),
            plane,
            fan: DepthFan::default(),
            floor_m: given.then_some(config.grid_floor_height_m),
            bounds: None,
        }))
    }

    /// Takes a cycle, with the pose of its rig in the map as it is now.
    pub(crate) fn observe(&mut self, cycle: &SegmentedCycle, map_from_rig: &Isometry3<f64>) {
        self.plane.begin_cycle(cycle.static_cloud.stamp);
        match self.config.grid {
            GridSource::HeightBand => self.observe_depth(cycle, map_from_rig),
            GridSource::Scan | GridSource::None => {}
        }
    }

    fn observe_depth(&mut self, cycle: &SegmentedCycle, map_from_rig: &Isometry3<f64>) {
        if self.floor_m.is_none() {
            // Without normals; the map's points have them, and decide when the grid is made.
            let points_m = &cycle.static_cloud.points_m;
            self.floor_m = self.config.floor_m(GridPoints { points_m, normals: &[] });
        }
        let (Some(floor_m), Some(depth)) = (self.floor_m, &cycle.depth) else { return };
        let map_from_camera = map_from_rig * cycle.setup.mounts.rig_from_camera;
        let band_m =
            floor_m + self.config.grid_min_height_m..=floor_m + self.config.grid_max_height_m;
        let margin_m = MARGIN_CELLS * self.config.grid_resolution_m;
        // The map has refused a camera that is none.
        if let Ok(rays) = self.fan.rays(&depth.frame, &map_from_camera, &band_m, margin_m) {
            self.plane.take_rays(&rays);
        }
    }

    /// The map was corrected.
    pub(crate) fn correct(&mut self, now_from_before: impl Fn(Stamp) -> Isometry3<f64>) {
        self.plane.correct(now_from_before);
        self.bounds = None;
    }

    /// The map is empty, or another one.
    pub(crate) fn clear(&mut self) {
        self.plane.clear();
        self.bounds = None;
        if self.config.grid_floor == GridFloor::Found {
            self.floor_m = None;
        }
    }

    /// The grid of the map with these points, which are not needed of scans. Its border never shrinks.
    pub(crate) fn grid(&mut self, points: GridPoints<'_>) -> Result<OccupancyGrid, GridError> {
        let columns = match self.config.grid {
            GridSource::HeightBand => Some(self.columns(points)?),
            GridSource::Scan | GridSource::None => None,
        };
        let layers = Layers { columns: columns.as_ref(), plane: Some(&self.plane) };
        let (grid, bounds) = layers.grid(&self.config, self.bounds)?;
        self.bounds = Some(bounds);
        Ok(grid)
    }

    fn columns(&mut self, points: GridPoints<'_>) -> Result<Columns, GridError> {
        if points.points_m.is_empty() {
            return Err(GridError::EmptyMap);
        }
        let found_m = self.config.floor_m(points).or(self.floor_m);
        let floor_m = found_m.ok_or(GridError::NoFloor { points: points.points_m.len() })?;
        if self.floor_m.is_some_and(|before_m| (before_m - floor_m).abs() > SAME_FLOOR_M) {
            self.plane.clear();
        }
        self.floor_m = Some(floor_m);
        Ok(Columns::of(&self.config, points, floor_m))
    }

    /// Whether the points of the map are needed.
    pub(crate) fn needs_points(&self) -> bool {
        self.config.grid == GridSource::HeightBand
    }

    /// The evidence on cells.
    pub(crate) fn plane(&self) -> &PlaneOccupancy {
        &self.plane
    }
}
