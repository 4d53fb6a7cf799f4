//! The static map of either kind: chosen once, by the parameters.

use estimation::executor::Executor;
use geometry::{
    ColouredCloud, DistanceLattice, Distances, LastSight, MapPath, MapView, MeshUpdate,
    OccupancyGrid, OrientedPoints, SegmentedCycle, TriangleMesh, VoxelGrid,
};
use nalgebra::{Point3, Vector3};
use volume::BLOCK_EDGE;

use crate::distance::{DistanceError, MapBox};
use crate::grid::{GridError, GridObservations};
use crate::mesh::MeshError;
use crate::surface_map::SurfaceMap;
use crate::tiles::{SpillCounts, TileError, TileStore};
use crate::{
    Addition, ConfigError, CorrectionCounts, CorrectionError, LoadError, MapChanges, MapCorrection,
    MapError, ReconstructionConfig, StaticMap, WholeMap,
};

/// The static map: of means with the method `rec_hv`, of the depth images with `free_space`.
#[derive(Debug)]
pub enum Map {
    /// Of the means of the reduced clouds, with voxels of `voxel_edge_m`.
    Means(Box<StaticMap>),
    /// Of the depth images, with voxels of `map_edge_m`.
    Surface(Box<SurfaceMap>),
}

/// A map that only is read serves several threads at once.
const _: fn() = || {
    fn is_shared<T: Send + Sync>() {}
    is_shared::<Map>();
};

impl From<StaticMap> for Map {
    fn from(map: StaticMap) -> Self {
        Self::Means(Box::new(map))
    }
}

/// Calls the same method of either kind.
macro_rules! of_either {
    ($map:expr, $kind:ident => $call:expr) => {
        match $map {
            Map::Means($kind) => $call,
            Map::Surface($kind) => $call,
        }
    };
}

impl Map {
    /// The empty map that the parameters ask for. `store` takes the tiles of one that spills.
    ///
    /// # Errors
    /// When a parameter is out of its range, or the map spills and there is no store.
    pub fn new(
        config: ReconstructionConfig,
        store: Option<Box<dyn TileStore>>,
    ) -> Result<Self, ConfigError> {
        config.check_map()?;
        let Some(surface) = config.surface() else {
            return Ok(StaticMap::new(config)?.into());
        };
        let grid = GridObservations::new(&config.grid, config.map_reach_m)?;
        let tiles = config
            .tiles_of(surface.edge_m)?
            .map(|frame| Ok::<_, ConfigError>((frame, store.ok_or(ConfigError::NoTileStore)?)));
        let view = config.depth_view()?;
        let map = SurfaceMap::new(surface, view, config.at_max_voxels, tiles.transpose()?)?
            .with_grid(grid);
        let map = map.with_distances(config.distances()).with_stop(config.pipeline.max_stop_s);
        Ok(Self::Surface(Box::new(map)))
    }

    /// Takes in one cycle: [`StaticMap::integrate`], [`SurfaceMap::integrate`].
    ///
    /// # Errors
    /// When the cycle does not fit the map; the map is then as it was.
    pub fn integrate(&mut self, cycle: &SegmentedCycle) -> Result<Addition, MapError> {
        of_either!(self, map => map.integrate(cycle))
    }

    /// The same on the threads of an executor: [`SurfaceMap::integrate_on`]. A map of means takes no time to speak of.
    ///
    /// # Errors
    /// When the cycle does not fit the map; the map is then as it was.
    pub fn integrate_on(
        &mut self,
        cycle: &SegmentedCycle,
        executor: &dyn Executor,
    ) -> Result<Addition, MapError> {
        match self {
            Self::Means(map) => map.integrate(cycle),
            Self::Surface(map) => map.integrate_on(cycle, executor),
        }
    }

    /// Takes the trajectory of the platform as the map of the poses has it by now: [`StaticMap::follow_path`].
    ///
    /// # Errors
    /// When the map cannot follow it, now or at all.
    pub fn follow_path(&mut self, path: &MapPath) -> Result<MapCorrection, CorrectionError> {
        of_either!(self, map => map.follow_path(path))
    }

    /// Puts these points in the place of the whole map: [`StaticMap::replace`], which needs no normals, and
    /// [`SurfaceMap::replace`].
    ///
    /// # Errors
    /// When they do not fit.
    pub fn replace(
        &mut self,
        points_m: &[Point3<f32>],
        normals: &[Vector3<f32>],
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        match self {
            Self::Means(map) => map.replace(points_m, frame_id),
            Self::Surface(map) => map.replace(points_m, normals, frame_id),
        }
    }

    /// The same with the colours of the points, or none: [`SurfaceMap::replace_coloured`]. A map of means has no colours.
    ///
    /// # Errors
    /// When they do not fit.
    pub fn replace_coloured(
        &mut self,
        points: &OrientedPoints,
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        match self {
            Self::Means(map) => map.replace(&points.points_m, frame_id),
            Self::Surface(map) => map.replace_coloured(points, frame_id),
        }
    }

    /// Adds the views that the points of a file were seen from. A map of means has none.
    pub fn add_views(&mut self, views: impl IntoIterator<Item = MapView>) {
        if let Self::Surface(map) = self {
            map.add_views(views);
        }
    }

    /// Takes how the blocks of a file were seen last, [`WholeMap::sights`]: after its points. A map of means has none.
    pub fn take_last_sights(&mut self, sights: impl IntoIterator<Item = LastSight>) {
        if let Self::Surface(map) = self {
            map.take_last_sights(sights);
        }
    }

    /// Gives the frame of the map another name. The points stay.
    pub fn rename_frame(&mut self, frame_id: &str) {
        of_either!(self, map => map.rename_frame(frame_id));
    }

    /// Empties the map.
    pub fn clear(&mut self) {
        of_either!(self, map => map.clear());
    }

    /// All points: [`StaticMap::whole`].
    #[must_use]
    pub fn whole(&self) -> WholeMap {
        of_either!(self, map => map.whole())
    }

    /// All points that can be read.
    #[must_use]
    pub fn points(&self) -> Vec<Point3<f32>> {
        self.whole().points.points_m
    }

    /// The occupancy grid for navigation, by the parameters: of the map of means by its points alone, and
    /// [`SurfaceMap::occupancy_grid`].
    ///
    /// # Errors
    /// When none was asked for, or there is none.
    pub fn occupancy_grid(&mut self) -> Result<OccupancyGrid, GridError> {
        match self {
            Self::Means(map) => map.occupancy_grid(),
            Self::Surface(map) => map.occupancy_grid(),
        }
    }

    /// Whether the grid is of the scans that were seen, and not of the points of the map.
    pub(crate) fn has_grid_of_scans(&self) -> bool {
        match self {
            Self::Means(_) => false,
            Self::Surface(map) => map.has_grid_of_scans(),
        }
    }

    /// The surface as triangles: [`SurfaceMap::mesh`].
    ///
    /// # Errors
    /// When there are none, or the map is one of means.
    pub fn mesh(&self) -> Result<TriangleMesh, MeshError> {
        match self {
            Self::Means(_) => Err(MeshError::NoDistances),
            Self::Surface(map) => map.mesh(),
        }
    }

    /// A listener to the mesh is there: [`SurfaceMap::follow_mesh`]. A map of means has none.
    pub fn follow_mesh(&mut self) {
        if let Self::Surface(map) = self {
            map.follow_mesh();
        }
    }

    /// There are no listeners to the mesh any more.
    pub fn unfollow_mesh(&mut self) {
        if let Self::Surface(map) = self {
            map.unfollow_mesh();
        }
    }

    /// The next changes of the mesh: [`SurfaceMap::take_mesh_changes`].
    pub fn take_mesh_changes(&mut self, most_triangles: usize) -> Option<MeshUpdate> {
        match self {
            Self::Means(_) => None,
            Self::Surface(map) => map.take_mesh_changes(most_triangles),
        }
    }

    /// How far places are from the nearest obstacle: [`SurfaceMap::distances`].
    ///
    /// # Errors
    /// When there are none, or the map is one of means.
    pub fn distances(
        &mut self,
        frame_id: &str,
        places_m: &[Point3<f64>],
    ) -> Result<Distances, DistanceError> {
        match self {
            Self::Means(_) => Err(DistanceError::NoDistances),
            Self::Surface(map) => map.distances(frame_id, places_m),
        }
    }

    /// The same of the places of a box: [`SurfaceMap::distance_lattice`].
    ///
    /// # Errors
    /// When there are none, or the map is one of means.
    pub fn distance_lattice(
        &mut self,
        frame_id: &str,
        asked: &MapBox,
    ) -> Result<DistanceLattice, DistanceError> {
        match self {
            Self::Means(_) => Err(DistanceError::NoDistances),
            Self::Surface(map) => map.distance_lattice(frame_id, asked),
        }
    }

    /// Nobody asks for distances any more: [`SurfaceMap::forget_distances`].
    pub fn forget_distances(&mut self) {
        if let Self::Surface(map) = self {
            map.forget_distances();
        }
    }

    /// Follows the changes from now on: [`StaticMap::follow_changes`].
    pub fn follow_changes(&mut self) {
        of_either!(self, map => map.follow_changes());
    }

    /// There are no listeners any more.
    pub fn unfollow_changes(&mut self) {
        of_either!(self, map => map.unfollow_changes());
    }

    /// The next changes: [`StaticMap::take_changes`].
    pub fn take_changes(&mut self, most_points: usize) -> MapChanges {
        of_either!(self, map => map.take_changes(most_points))
    }

    /// The map for a listener to start with: [`StaticMap::cloud_for_listeners`].
    ///
    /// # Errors
    /// When a spilled tile cannot be read for now.
    pub fn cloud_for_listeners(&mut self) -> Result<ColouredCloud, TileError> {
        match self {
            Self::Means(map) => {
                Ok(ColouredCloud { cloud: map.cloud_for_listeners(), colours: Vec::new() })
            }
            Self::Surface(map) => map.cloud_for_listeners(),
        }
    }

    /// How many points the map has; of a map of depth images about: [`SurfaceMap::len`].
    #[must_use]
    pub fn len(&self) -> usize {
        of_either!(self, map => map.len())
    }

    /// Whether nothing is in the map.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        of_either!(self, map => map.is_empty())
    }

    /// What is bounded, how much of it there is, and the bound.
    #[must_use]
    pub fn fill(&self) -> (&'static str, usize, usize) {
        match self {
            Self::Means(map) => ("voxels", map.len(), map.max_voxels()),
            Self::Surface(map) => {
                let surface = map.surface();
                ("map blocks", surface.blocks(), surface.config().max_blocks)
            }
        }
    }

    /// Blocks of 8 by 8 cells that the grid of a map of depth images records, and their bound; `None` without a grid.
    #[must_use]
    pub fn grid_fill(&self) -> Option<(usize, usize)> {
        match self {
            Self::Means(_) => None,
            Self::Surface(map) => {
                map.grid_plane().map(|plane| (plane.blocks(), plane.config().max_blocks))
            }
        }
    }

    /// So many voxels an octomap may have that is to be loaded: as many as fit, or as a flat surface crosses in all blocks.
    #[must_use]
    pub fn max_voxels(&self) -> usize {
        match self {
            Self::Means(map) => map.max_voxels(),
            Self::Surface(map) => {
                map.surface().config().max_blocks.saturating_mul(BLOCK_EDGE * BLOCK_EDGE)
            }
        }
    }

    /// The grid of the map's voxels.
    #[must_use]
    pub fn grid(&self) -> &VoxelGrid {
        of_either!(self, map => map.grid())
    }

    /// The frame of the map, which the first cycle sets.
    #[must_use]
    pub fn frame_id(&self) -> Option<&str> {
        of_either!(self, map => map.frame_id())
    }

    /// About how many bytes the map takes now.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        of_either!(self, map => map.memory_bytes())
    }

    /// What the corrections did since the map was empty.
    #[must_use]
    pub fn correction_counts(&self) -> CorrectionCounts {
        of_either!(self, map => map.correction_counts())
    }

    /// How the tiles are; `None` where none are spilled.
    #[must_use]
    pub fn spill_counts(&self) -> Option<SpillCounts> {
        match self {
            Self::Means(_) => None,
            Self::Surface(map) => map.spill_counts(),
        }
    }

    /// What went wrong with a tile since this was asked last.
    pub fn take_tile_error(&mut self) -> Option<TileError> {
        match self {
            Self::Means(_) => None,
            Self::Surface(map) => map.take_tile_error(),
        }
    }
}
