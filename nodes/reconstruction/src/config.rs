//! The parameters of reconstruction, their defaults, and where these come from.

use geometry::{VoxelEdgeError, VoxelGrid};
use serde::{Deserialize, Serialize};

/// How the static clouds become a map.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The voxel grid of the concatenation of all clouds, as Rec-HV has it; what was put in stays in.
    #[default]
    RecHv,
    /// Besides, the rays to the points clear the voxels that they pass: what was put in by mistake, or has been
    /// moved away, goes once something was seen behind it.
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
    /// So many voxels the map may have. See [`crate::StaticMap`] for the memory of one.
    pub max_voxels: usize,
    /// What happens to points that would need another one. They, or the voxels that made room, are counted.
    pub at_max_voxels: AtMaxVoxels,
}

impl Default for ReconstructionConfig {
    fn default() -> Self {
        Self {
            method: Method::RecHv,
            // Rec-HV 3.3.4: the edge t_vg of the reduction, which experiment 4 chose.
            voxel_edge_m: 0.08,
            // 6400 square metres of surface, in less than 200 MB; the thesis' largest map (Table 6) has
            // 13,237 points.
            max_voxels: 1_000_000,
            // The map of a place that fits; for a robot that goes on and on there is the other way.
            at_max_voxels: AtMaxVoxels::Refuse,
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
    #[error("parameter max_voxels must be at least 1, not 0")]
    NoVoxels,
}

impl ReconstructionConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// When the voxel edge is not a positive finite number, or no voxel is allowed.
    pub fn validate(&self) -> Result<(), ConfigError> {
        VoxelGrid::new(self.voxel_edge_m)?;
        if self.max_voxels == 0 { Err(ConfigError::NoVoxels) } else { Ok(()) }
    }
}
