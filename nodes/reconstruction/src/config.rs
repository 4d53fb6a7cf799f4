//! The parameters of reconstruction, their defaults, and where these come from.

use geometry::{ParameterError, VoxelEdgeError, VoxelGrid, parameter};
use serde::{Deserialize, Serialize};

use crate::static_map::BLOCK_EDGE_VOXELS;

/// How the static clouds become a map.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The voxel grid of the concatenation of all clouds, as Rec-HV has it; what was put in stays in.
    RecHv,
    /// Besides, the rays to the points clear the voxels that they pass: what was put in by mistake, or has been
    /// moved away, goes once something was seen behind it, or nothing comes back from there any more.
    #[default]
    Stillmap,
}

/// What happens to a point that needs a voxel more than `max_voxels`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AtMaxVoxels {
    /// The point is refused: the map stays what it has become.
    #[default]
    Refuse,
    /// The voxel that was hit longest ago makes room, unless it was hit in this cycle. Of voxels that were hit
    /// last in the same cycle the one that was taken in first goes first.
    DropOldest,
    /// The tile of voxels that no point or ray has reached for longest goes to a store, and comes back when one does.
    /// The map is that of unbounded memory: `max_voxels` bounds what is in memory at a time. See
    /// [`crate::tiles`].
    Spill,
}

/// The parameters of [`crate::StaticMap`].
///
/// Every default stands in [`ReconstructionConfig::default`] and nowhere else.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct ReconstructionConfig {
    /// How the static clouds become a map.
    pub method: Method,
    /// t_vg, the edge of the map's voxels.
    pub voxel_edge_m: f64,
    /// So many voxels the map may have; so many in memory, where tiles are spilled. See [`crate::StaticMap`] for the
    /// memory of one.
    pub max_voxels: usize,
    /// What happens to points that would need another one. What comes of it is counted: the points that were refused,
    /// the voxels that were dropped, or the tiles that were written.
    pub at_max_voxels: AtMaxVoxels,
    /// The edge of the cubes in which the map is spilled, rounded up to whole blocks of 4 voxels. A full one must
    /// fit into `max_voxels`. Read with [`AtMaxVoxels::Spill`] alone.
    pub spill_tile_edge_m: f64,
}

impl Default for ReconstructionConfig {
    fn default() -> Self {
        Self {
            // All improvements; the published method is there to be compared with.
            method: Method::Stillmap,
            // Rec-HV 3.3.4: the edge t_vg of the reduction, which experiment 4 chose.
            voxel_edge_m: 0.08,
            // 6400 square metres of surface, in less than 200 MB; the thesis' largest map (Table 6) has
            // 13,237 points.
            max_voxels: 1_000_000,
            // The map of a place that fits; for a robot that goes on and on there is the other way.
            at_max_voxels: AtMaxVoxels::Refuse,
            // A Kinect sees a dozen such cubes at a time. In a corridor one has some 5,000 voxels: 100 kB a file.
            spill_tile_edge_m: 4.0,
        }
    }
}

/// A parameter of reconstruction has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum ConfigError {
    /// The voxel edge is no length.
    #[error("parameter voxel_edge_m: {0}")]
    VoxelEdge(#[from] VoxelEdgeError),
    /// A map without room.
    #[error(transparent)]
    NoVoxels(#[from] ParameterError),
    /// A tile is no cube, or none that would ever be read.
    #[error(
        "parameter spill_tile_edge_m must be a positive number of metres, at most {} voxels of {voxel_edge_m} m, not \
         {tile_edge_m}",
        ReconstructionConfig::MOST_TILE_EDGE_VOXELS
    )]
    TileEdge {
        /// The tile's edge.
        tile_edge_m: f64,
        /// The voxel's.
        voxel_edge_m: f64,
    },
    /// A full tile has more voxels than may be in memory.
    #[error(
        "with at_max_voxels spill a full tile must fit into memory: spill_tile_edge_m has {tile_voxels} voxels, and \
         max_voxels is {max_voxels}"
    )]
    LargeTile {
        /// Of a full tile.
        tile_voxels: usize,
        /// The bound.
        max_voxels: usize,
    },
    /// Tiles have nowhere to go.
    #[error("at_max_voxels is spill, and there is no store for the tiles")]
    NoTileStore,
}

impl ReconstructionConfig {
    /// So long a tile may be, in voxels: a larger one would hold a billion.
    pub const MOST_TILE_EDGE_VOXELS: u16 = 1000;

    /// Checks every parameter.
    ///
    /// # Errors
    /// When the voxel edge is not a positive finite number, no voxel is allowed, or tiles are spilled that are none
    /// or too large.
    pub fn validate(&self) -> Result<(), ConfigError> {
        VoxelGrid::new(self.voxel_edge_m)?;
        parameter::at_least("max_voxels", self.max_voxels, 1)?;
        if self.at_max_voxels == AtMaxVoxels::Spill {
            let tile_voxels = usize::from(self.tile_edge_voxels()?).pow(3);
            let max_voxels = self.max_voxels;
            if tile_voxels > max_voxels {
                return Err(ConfigError::LargeTile { tile_voxels, max_voxels });
            }
        }
        Ok(())
    }

    /// The edge of a tile in voxels: whole blocks.
    ///
    /// # Errors
    /// When it is not a positive number, or too large.
    pub(crate) fn tile_edge_voxels(&self) -> Result<u16, ConfigError> {
        let block = f64::from(BLOCK_EDGE_VOXELS);
        let edge = (self.spill_tile_edge_m / (self.voxel_edge_m * block)).ceil() * block;
        // A NaN is in no range.
        if (block..=f64::from(Self::MOST_TILE_EDGE_VOXELS)).contains(&edge) {
            Ok(edge as u16)
        } else {
            let (tile_edge_m, voxel_edge_m) = (self.spill_tile_edge_m, self.voxel_edge_m);
            Err(ConfigError::TileEdge { tile_edge_m, voxel_edge_m })
        }
    }
}
