//! The parameters of reconstruction, their defaults, and where these come from.

use geometry::{ParameterError, PipelineConfig, parameter};
use volume::{BLOCK_EDGE, SurfaceConfig, SurfaceConfigError, ViewError};

use crate::static_map::BLOCK_EDGE_VOXELS;
use crate::tiles::TileFrame;

geometry::choices! {
    /// What happens to a point that needs a voxel more than `max_voxels`, or a block more than `max_map_blocks`.
    pub enum AtMaxVoxels {
        /// The point is refused and counted.
        Refuse = "refuse",
        /// The voxels that were seen longest ago are dropped and counted; never one that was seen in this cycle.
        DropOldest = "drop_oldest",
        /// The map grows on the disk: the tile of voxels that no point or ray has reached for longest is written to a file, and
        /// read back when one does; of a map of depth images, the tile that was out of view for longest. max_voxels, or
        /// max_map_blocks, then bounds what is in memory, and the map is the same as without a bound; the whole map, saved or
        /// published, has every tile, and takes the time to read them.
        Spill = "spill",
    }
}

geometry::parameters! {
    /// The parameters of [`crate::StaticMap`].
    #[derive(Clone, PartialEq, Debug)]
    pub struct ReconstructionConfig {
        /// What reconstruction shares with the other nodes of the pipeline.
        pipeline: PipelineConfig as flatten;
        /// The most voxels that the map has (in memory, with spill). A million take less than 200 MB where voxels stay, and less
        /// than 500 MB where they may be removed (free_space, drop_oldest, spill).
        // 6400 square metres of surface, in less than 200 MB; the thesis' largest map (Table 6) has 13,237 points.
        max_voxels: usize = 1_000_000, at_least(1.0);
        /// The most blocks of 8 voxels an axis that a map of depth images (map_edge_m) has (in memory, with spill), of 2.1 kB each.
        /// With spill they are to hold the tiles that the camera sees up to 5 m.
        // 420 MB. At 2 cm some 2,500 square metres of surface.
        max_map_blocks: usize = 200_000, at_least(1.0);
        /// What happens to points that would need another voxel, or block.
        // The map of a place that fits; for a robot that goes on and on there are the other two.
        at_max_voxels: AtMaxVoxels = AtMaxVoxels::Refuse;
        /// Edge of the tiles in which the map is spilled, rounded up to multiples of 4 voxels, or of the blocks of a map of depth
        /// images. A full tile must fit into max_voxels, or max_map_blocks: 4 m at 8 cm are 140608 voxels, 4 m at 2 cm 15625 blocks.
        // A Kinect sees a dozen such cubes at a time. In a corridor one has some 5,000 voxels: 100 kB a file.
        spill_tile_edge_m: f64 = 4.0, read_with("at_max_voxels", "spill");
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
    /// Tiles have nowhere to go.
    #[error("at_max_voxels is spill, and there is no store for the tiles")]
    NoTileStore,
}

impl ReconstructionConfig {
    /// So long a tile may be, in voxels: a larger one would hold a billion.
    pub const MOST_TILE_EDGE_VOXELS: u16 = 1000;

    fn check_tiles(&self) -> Result<(), ParameterError> {
        if self.at_max_voxels != AtMaxVoxels::Spill {
            return Ok(());
        }
        let edge_voxels = usize::from(self.tile_edge_voxels()?);
        let (name, most, parts, words) = if self.pipeline.depth_map_edge_m().is_some() {
            let parts = (edge_voxels / BLOCK_EDGE).pow(3);
            let words = "at least the blocks of a full tile of spill_tile_edge_m";
            ("max_map_blocks", self.max_map_blocks, parts, words)
        } else {
            let words = "at least the voxels of a full tile of spill_tile_edge_m";
            ("max_voxels", self.max_voxels, edge_voxels.pow(3), words)
        };
        parameter::check(name, (words, parts as f64), most as f64, parts <= most)
    }

    /// The parameters of the surface; `None` where the map is of the means of the reduced clouds.
    pub(crate) fn surface(&self) -> Option<SurfaceConfig> {
        self.pipeline.depth_map_edge_m().map(|edge_m| SurfaceConfig {
            edge_m,
            max_blocks: self.max_map_blocks,
            ..SurfaceConfig::default()
        })
    }

    /// How the surface is cut into tiles; `None` where the map does not spill, or has no surface.
    ///
    /// # Errors
    /// When the edge of a tile is not a positive number, or too large.
    pub(crate) fn surface_tiles(&self) -> Result<Option<TileFrame>, ParameterError> {
        let edge_m = self.pipeline.depth_map_edge_m();
        let edge_m = edge_m.filter(|_| self.at_max_voxels == AtMaxVoxels::Spill);
        let frame = |edge_m| Ok(TileFrame { edge_voxels: self.tile_edge_voxels()?, edge_m });
        edge_m.map(frame).transpose()
    }

    /// The edge of a tile in voxels: whole blocks.
    ///
    /// # Errors
    /// When it is not a positive number, or too large.
    pub(crate) fn tile_edge_voxels(&self) -> Result<u16, ParameterError> {
        let (edge_m, block_edge, words) = match self.pipeline.depth_map_edge_m() {
            Some(edge_m) => {
                (edge_m, BLOCK_EDGE as u16, "above 0 and at most 1000 times map_edge_m")
            }
            None => {
                let words = "above 0 and at most 1000 times voxel_edge_m";
                (self.pipeline.voxel_edge_m, BLOCK_EDGE_VOXELS, words)
            }
        };
        let block = f64::from(block_edge);
        let edge = (self.spill_tile_edge_m / (edge_m * block)).ceil() * block;
        // A NaN is in no range.
        let holds = (block..=f64::from(Self::MOST_TILE_EDGE_VOXELS)).contains(&edge);
        let accepted = (words, edge_m);
        parameter::check("spill_tile_edge_m", accepted, self.spill_tile_edge_m, holds)?;
        Ok(edge as u16)
    }
}
