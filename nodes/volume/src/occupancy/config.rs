//! The parameters of the occupancy map, their defaults, and the sources of these.

use geometry::{VoxelEdgeError, VoxelGrid};
use serde::{Deserialize, Serialize};

/// The parameters of [`super::Occupancy`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct OccupancyConfig {
    /// The edge of the voxels, in metres.
    pub edge_m: f64,
    /// The maximum distance from the camera at which evidence is recorded, in metres.
    pub reach_m: f64,
    /// The maximum number of blocks of 8 voxels an axis; those not seen for the longest time are dropped first.
    pub max_blocks: usize,
    /// The maximum number of blocks that one image updates, the nearest first: it bounds the time.
    pub max_blocks_per_image: usize,
}

impl Default for OccupancyConfig {
    fn default() -> Self {
        Self {
            // Rec-HV 3.3.4.
            edge_m: 0.08,
            reach_m: 5.0,
            // 160 MB if none is free as a whole.
            max_blocks: 20_000,
            // A view of 5 m has 300 at 8 cm, and 20,000 at 2 cm.
            max_blocks_per_image: 30_000,
        }
    }
}

/// A parameter is out of its range.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum OccupancyConfigError {
    /// The edge is invalid.
    #[error(transparent)]
    Edge(#[from] VoxelEdgeError),
    /// A length is out of its range.
    #[error("{name} of {value_m} m: from {least_m} m to {most_m} m are possible")]
    Length {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value_m: f64,
        /// The minimum.
        least_m: f64,
        /// The maximum.
        most_m: f64,
    },
    /// A number of blocks is 0.
    #[error("{name} is 0: there must be blocks")]
    NoBlocks {
        /// The parameter.
        name: &'static str,
    },
}

impl OccupancyConfig {
    /// The finest voxels.
    pub const LEAST_EDGE_M: f64 = 0.001;
    /// The coarsest voxels.
    pub const MOST_EDGE_M: f64 = 10.0;

    /// Checks every parameter.
    ///
    /// # Errors
    /// When one is out of its range.
    pub fn validate(&self) -> Result<(), OccupancyConfigError> {
        VoxelGrid::new(self.edge_m)?;
        let lengths = [
            ("edge_m", self.edge_m, Self::LEAST_EDGE_M, Self::MOST_EDGE_M),
            ("reach_m", self.reach_m, 0.1, 1000.0),
        ];
        for (name, value_m, least_m, most_m) in lengths {
            if !(least_m..=most_m).contains(&value_m) {
                return Err(OccupancyConfigError::Length { name, value_m, least_m, most_m });
            }
        }
        for (name, blocks) in
            [("max_blocks", self.max_blocks), ("max_blocks_per_image", self.max_blocks_per_image)]
        {
            if blocks == 0 {
                return Err(OccupancyConfigError::NoBlocks { name });
            }
        }
        Ok(())
    }
}
