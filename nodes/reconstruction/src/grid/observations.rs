//! What the cycles say of the cells of a grid.

use geometry::{DepthFrame, OccupancyGrid, ScanRay, SegmentedCycle, Stamp};
use nalgebra::{Isometry3, Point3};
use volume::{PlaneConfig, PlaneOccupancy, PlaneRay};

use super::depth_fan::{Band, DepthFan};
use super::floor::FloorFinder;
use super::{Columns, GridConfig, GridError, GridFloor, GridPoints, GridSource, Layers};
use crate::ConfigError;

/// Cells of a block of [`PlaneOccupancy`].
const BLOCK_CELLS: usize = 64;
/// Space is passed up to so many cells before what a depth image shows: half a cell is the surface's.
const MARGIN_CELLS: f64 = 0.5;
/// A floor that is found elsewhere than before makes what was seen in the former band void.
const SAME_FLOOR_M: f64 = 0.05;

/// The evidence on cells that cycles bring. See [`super`].
#[derive(Clone, Debug)]
pub(crate) struct GridObservations {
    config: GridConfig,
    plane: PlaneOccupancy,
    fan: DepthFan,
    floor: FloorFinder,
    /// The floor, given or as the cycles show it.
    floor_m: Option<f64>,
    /// By how much corrections may have lifted what the finder has.
    lifted_m: f64,
    /// The map was loaded: free is also where it has floor.
    is_loaded: bool,
}

impl GridObservations {
    /// Nothing seen, of images that are used up to `reach_m`; `None` where no grid is asked for.
    pub(crate) fn new(config: &GridConfig, reach_m: f64) -> Result<Option<Self>, ConfigError> {
        if config.grid == GridSource::None {
            return Ok(None);
        }
        let max_blocks = config.grid_max_cells.div_ceil(BLOCK_CELLS);
        let plane = PlaneOccupancy::new(PlaneConfig {
            edge_m: config.grid_resolution_m,
            max_blocks,
            ends_at_occupied: config.grid == GridSource::HeightBand,
        })
        .map_err(|_| geometry::ParameterError {
            name: "grid_resolution_m".into(),
            accepted: "above 0".into(),
            value: config.grid_resolution_m,
        })?;
        let given = config.grid_floor == GridFloor::Given;
        Ok(Some(Self {
            config: config.clone(),
            plane,
            fan: DepthFan::new(reach_m),
            floor: FloorFinder::default(),
            floor_m: given.then_some(config.grid_floor_height_m),
            lifted_m: 0.0,
            is_loaded: false,
        }))
    }

    /// Takes a cycle, with the pose of its rig in the map as it is now.
    pub(crate) fn observe(&mut self, cycle: &SegmentedCycle, map_from_rig: &Isometry3<f64>) {
        self.plane.begin_cycle(cycle.static_cloud.stamp);
        match self.config.grid {
            GridSource::HeightBand => self.observe_depth(cycle, map_from_rig),
            GridSource::Scan => self.observe_scan(cycle, map_from_rig),
            GridSource::None => {}
        }
    }

    fn observe_scan(&mut self, cycle: &SegmentedCycle, map_from_rig: &Isometry3<f64>) {
        let in_plane = |point: &Point3<f32>| (map_from_rig * point.cast::<f64>()).xy();
        let ray = |ray: &ScanRay| PlaneRay {
            from_m: in_plane(&ray.from_m),
            to_m: in_plane(&ray.to_m),
            hits: !ray.is_moving,
            joins_next: ray.joins_next,
        };
        let rays: Vec<PlaneRay> = cycle.scan_rays.iter().map(ray).collect();
        self.plane.take_rays(&rays);
    }

    fn observe_depth(&mut self, cycle: &SegmentedCycle, map_from_rig: &Isometry3<f64>) {
        let Some(depth) = &cycle.depth else { return };
        let map_from_camera = map_from_rig * cycle.setup.mounts.rig_from_camera;
        if self.config.grid_floor == GridFloor::Found {
            self.find_floor(depth.frame(), &map_from_camera);
        }
        let Some(floor_m) = self.floor_m else { return };
        let band = Band {
            least_m: floor_m + self.config.grid_min_height_m,
            most_m: floor_m + self.config.grid_max_height_m,
            free_below_m: floor_m + self.config.grid_free_below_m,
        };
        let margin_m = MARGIN_CELLS * self.config.grid_resolution_m;
        let rays = self.fan.rays(depth, &map_from_camera, band, margin_m);
        self.plane.take_rays(&rays);
    }

    fn find_floor(&mut self, frame: &DepthFrame, map_from_camera: &Isometry3<f64>) {
        let (level, heights_m) = self.fan.level_points(frame, map_from_camera);
        self.floor.take(level.into_iter(), heights_m.into_iter());
        let camera_m = map_from_camera.translation.vector.cast::<f32>();
        self.floor.pass_over(camera_m.x, camera_m.y);
        let Some(found_m) = self.floor.floor_m() else { return };
        if self.floor_m.is_some_and(|before_m| (before_m - found_m).abs() > SAME_FLOOR_M) {
            self.plane.clear();
        }
        self.floor_m = Some(found_m);
    }

    /// The map was corrected, and by at most so much in height.
    pub(crate) fn correct(
        &mut self,
        now_from_before: impl Fn(Stamp) -> Isometry3<f64>,
        lift_m: f64,
    ) {
        self.plane.correct(now_from_before);
        self.lifted_m += lift_m;
        // Found anew, a table may be taken for the floor until that is in view.
        if self.lifted_m > SAME_FLOOR_M {
            self.find_floor_anew();
        }
    }

    fn find_floor_anew(&mut self) {
        self.floor = FloorFinder::default();
        self.lifted_m = 0.0;
    }

    /// The map is empty, or another one.
    pub(crate) fn clear(&mut self) {
        self.plane.clear();
        self.is_loaded = false;
        self.find_floor_anew();
        if self.config.grid_floor == GridFloor::Found {
            self.floor_m = None;
        }
    }

    /// The map is that of a file.
    pub(crate) fn loaded(&mut self) {
        self.is_loaded = true;
    }

    /// The grid of the map with these points, which are not needed of scans.
    pub(crate) fn grid(&self, points: GridPoints<'_>) -> Result<OccupancyGrid, GridError> {
        let columns = match self.config.grid {
            GridSource::HeightBand => Some(self.columns(points)?),
            GridSource::Scan | GridSource::None => None,
        };
        let is_band = self.config.grid == GridSource::HeightBand;
        let layers = Layers {
            columns: columns.as_ref(),
            floor_is_free: self.is_loaded,
            plane: Some(&self.plane),
            rays_occupy: !is_band,
        };
        layers.grid(&self.config).map_err(|error| match error {
            GridError::EmptyMap if self.config.grid == GridSource::Scan => GridError::NoScan,
            error => error,
        })
    }

    /// Whether it is of the scans alone, and not of the points of the map.
    pub(crate) fn is_of_scans(&self) -> bool {
        self.config.grid == GridSource::Scan
    }

    fn columns(&self, points: GridPoints<'_>) -> Result<Columns, GridError> {
        if points.points_m.is_empty() {
            return Err(GridError::EmptyMap);
        }
        // Before the first cycle of a map that was loaded its points show the floor.
        let found_m = self.floor_m.or_else(|| self.config.floor_m(points));
        let floor_m = found_m.ok_or(GridError::NoFloor { points: points.points_m.len() })?;
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
