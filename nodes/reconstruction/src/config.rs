//! The parameters of reconstruction, their defaults, and where these come from.

use geometry::{ParameterError, PipelineConfig, parameter};
use volume::{
    BLOCK_EDGE, DepthNoise, DepthRange, DepthView, DistanceConfig, FARTHEST_SEEN_M, SurfaceConfig,
    SurfaceConfigError, ViewError,
};

use crate::grid::{GridConfig, GridSource};
use crate::tiles::TileFrame;

geometry::choices! {
    /// What happens to a block more than `max_map_blocks`.
    pub enum AtMaxVoxels {
        /// It is refused and counted.
        Refuse = "refuse",
        /// The blocks that were seen longest ago are dropped and counted.
        DropOldest = "drop_oldest",
        /// The map grows on the disk: the tile that was out of view for longest is written to a file, and read back when the
        /// camera comes near. max_map_blocks then bounds what is in memory, and the map is the same as without a bound; the whole
        /// map, saved or published, has every tile, and takes the time to read them.
        Spill = "spill",
    }
}

geometry::parameters! {
    /// The parameters of [`crate::Map`].
    #[derive(Clone, PartialEq, Debug)]
    pub struct ReconstructionConfig {
        /// What reconstruction shares with the other nodes of the pipeline.
        pipeline: PipelineConfig as flatten;
        /// The most voxels that the map has; points that need another one are refused. A million take less than 200 MB.
        // 6400 square metres of surface; the thesis' largest map (Table 6) has 13,237 points.
        max_voxels: usize = 1_000_000, at_least(1.0), read_with("method", "rec_hv");
        /// Farther from the camera nothing is taken into the map; that the space up to there is free is.
        // A Kinect measures to some 6 m. A stereo camera goes on for longer than its depths are of use.
        map_reach_m: f64 = FARTHEST_SEEN_M, between(0.5, 65.0), read_with("method", "free_space");
        /// The noise of the depth camera, for the map: the standard deviation of a depth of 1 m; that of others grows with the square of the
        /// depth. A Kinect has 0.0014 m, a RealSense D435 0.0036 m. With less than the camera has, surfaces far away are two.
        // Of a stereo camera: the noise of the disparity in pixels over focal length in pixels and baseline in metres.
        depth_noise_m: f64 = 1.425e-3, between(0.0, 0.1), read_with("method", "free_space");
        /// The most blocks of 8 voxels an axis that the map has (in memory, with spill), of 2.1 kB each, and 1.5 kB more where colours were seen. With spill they are to
        /// hold the tiles that the camera sees up to 5 m.
        // 420 MB. At 2 cm some 2,500 square metres of surface.
        max_map_blocks: usize = 200_000, at_least(1.0), read_with("method", "free_space");
        /// What happens at max_map_blocks. With the method rec_hv refuse alone is possible.
        // The map of a place that fits; for a robot that goes on and on there are the other two.
        at_max_voxels: AtMaxVoxels = AtMaxVoxels::Refuse;
        /// Edge of the tiles in which the map is spilled, rounded up to multiples of 8 voxels. The blocks of a full tile must fit
        /// into max_map_blocks: 4 m at 2 cm are 15625 blocks.
        // A Kinect sees a dozen such cubes at a time.
        spill_tile_edge_m: f64 = 4.0, read_with("at_max_voxels", "spill");
        /// How far apart the places are at which distances to the nearest obstacle are kept; between them they are interpolated, wrong
        /// by at most half the diagonal of this edge. It need not be that of the map. Nothing is computed until somebody asks.
        // The cells of the occupancy grid, and of Nav2's costmaps.
        distance_edge_m: f64 = 0.05, between(DistanceConfig::LEAST_EDGE_M, DistanceConfig::MOST_EDGE_M), read_with("method", "free_space");
        /// Farther obstacles count as none. What the distances of a place cost grows with the third power.
        // As voxblox and nvblox have it for planners.
        distance_max_m: f64 = 2.0, between(DistanceConfig::LEAST_BOUND_M, DistanceConfig::MOST_BOUND_M), read_with("method", "free_space");
        /// The occupancy grid for navigation.
        grid: GridConfig as flatten;
    }
    check = Self::check_tiles;
}

/// A map cannot be made by these parameters.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum ConfigError {
    /// A parameter has a value that it may not have.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The map of depth images cannot be.
    #[error("parameter map_edge_m: {0}")]
    Surface(#[from] SurfaceConfigError),
    /// A view of depth images cannot be.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The map of means neither drops nor spills.
    #[error(
        "parameter at_max_voxels must be refuse with the method rec_hv: the other values are of free_space"
    )]
    MeansAreRefused,
    /// The map of means has no rays of scans.
    #[error(
        "parameter grid must be none or height_band with the method rec_hv: scan is of free_space"
    )]
    GridOfScans,
    /// Tiles have nowhere to go.
    #[error("at_max_voxels is spill, and there is no store for the tiles")]
    NoTileStore,
}

impl ReconstructionConfig {
    /// So long a tile may be, in voxels: a larger one would hold a billion.
    pub const MOST_TILE_EDGE_VOXELS: u16 = 1000;

    /// Checks whether a map can be made by the parameters: each in its range, and all of what the map of the method has.
    ///
    /// # Errors
    /// When it cannot.
    pub fn check_map(&self) -> Result<(), ConfigError> {
        self.validate()?;
        if self.surface().is_none() {
            if self.at_max_voxels != AtMaxVoxels::Refuse {
                return Err(ConfigError::MeansAreRefused);
            }
            if self.grid.grid == GridSource::Scan {
                return Err(ConfigError::GridOfScans);
            }
        }
        Ok(())
    }

    fn check_tiles(&self) -> Result<(), ParameterError> {
        let Some(edge_m) = self.pipeline.depth_map_edge_m() else { return Ok(()) };
        let Some(TileFrame { edge_voxels, .. }) = self.tiles_of(edge_m)? else { return Ok(()) };
        let (blocks, most) = ((usize::from(edge_voxels) / BLOCK_EDGE).pow(3), self.max_map_blocks);
        let words = "at least the blocks of a full tile of spill_tile_edge_m";
        parameter::check("max_map_blocks", (words, blocks as f64), most as f64, blocks <= most)
    }

    /// The parameters of the surface; `None` where the map is of means.
    pub(crate) fn surface(&self) -> Option<SurfaceConfig> {
        self.pipeline.depth_map_edge_m().map(|edge_m| SurfaceConfig {
            edge_m,
            max_blocks: self.max_map_blocks,
            // It costs nothing until colours come.
            has_colour: true,
            ..SurfaceConfig::default()
        })
    }

    /// An empty view of the camera's images, as the map takes them.
    ///
    /// # Errors
    /// When the reach is none.
    pub(crate) fn depth_view(&self) -> Result<DepthView, ViewError> {
        let range = DepthRange { max_m: self.map_reach_m as f32, ..DepthRange::default() };
        let quadratic_per_m = self.depth_noise_m as f32;
        DepthView::new(range, DepthNoise { quadratic_per_m, ..DepthNoise::default() })
    }

    /// The parameters of distances to the nearest obstacle.
    pub(crate) fn distances(&self) -> DistanceConfig {
        DistanceConfig {
            edge_m: self.distance_edge_m,
            max_distance_m: self.distance_max_m,
            ..DistanceConfig::default()
        }
    }

    /// How a surface with voxels of this edge is cut into tiles; `None` where it does not spill.
    ///
    /// # Errors
    /// When the edge of a tile is not a positive number, or too large.
    pub(crate) fn tiles_of(&self, edge_m: f64) -> Result<Option<TileFrame>, ParameterError> {
        if self.at_max_voxels != AtMaxVoxels::Spill {
            return Ok(None);
        }
        let block = BLOCK_EDGE as f64;
        let edge = (self.spill_tile_edge_m / (edge_m * block)).ceil() * block;
        // A NaN is in no range.
        let holds = (block..=f64::from(Self::MOST_TILE_EDGE_VOXELS)).contains(&edge);
        let accepted = ("above 0 and at most 1000 times map_edge_m", edge_m);
        parameter::check("spill_tile_edge_m", accepted, self.spill_tile_edge_m, holds)?;
        Ok(Some(TileFrame { edge_voxels: edge as u16, edge_m }))
    }
}
