//! The parameters of a surface, their defaults, and where these come from.

use geometry::{VoxelEdgeError, VoxelGrid};
use serde::{Deserialize, Serialize};

/// The parameters of [`super::Surface`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct SurfaceConfig {
    /// The edge of the voxels, in metres.
    pub edge_m: f64,
    /// Distances beyond so many edges are cut: nearer than that before the surface nothing counts as free. How far behind it
    /// something is recorded follows from the edge and the noise of the depth.
    pub truncation_in_edges: f64,
    /// Farther from the camera than this nothing is recorded, in metres.
    pub reach_m: f64,
    /// Blocks of 8 voxels an axis that are kept at most.
    pub max_blocks: usize,
    /// Blocks that one image updates at most, the nearest: it bounds the time.
    pub max_blocks_per_image: usize,
    /// Whether colours are kept. They take memory, 1.5 kB a block, only where a colour was seen.
    pub has_colour: bool,
}

impl Default for SurfaceConfig {
    fn default() -> Self {
        Self {
            edge_m: 0.02,
            // At 2 cm 8 cm, three standard deviations of the Kinect's noise at 4 m. With 2 edges a map has as good a surface, and some
            // more of what moved stays.
            truncation_in_edges: 4.0,
            // A Kinect measures to some 6 m.
            reach_m: 8.0,
            // 400 MB.
            max_blocks: 200_000,
            // A view of a room has 2,500 at 2 cm, and 12,000 at 1 cm.
            max_blocks_per_image: 30_000,
            has_colour: false,
        }
    }
}

/// A parameter has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum SurfaceConfigError {
    /// The edge is none.
    #[error(transparent)]
    Edge(#[from] VoxelEdgeError),
    /// The edge is of no use.
    #[error(
        "voxels of {edge_m} m: from {} m to {} m are possible",
        SurfaceConfig::LEAST_EDGE_M,
        SurfaceConfig::MOST_EDGE_M
    )]
    EdgeOutOfRange {
        /// The edge.
        edge_m: f64,
    },
    /// The truncation is none.
    #[error("distances cut at {in_edges} edges: from 1 to 64 are possible")]
    Truncation {
        /// The parameter.
        in_edges: f64,
    },
    /// The reach is none.
    #[error("a reach of {reach_m} m: it must be a positive number")]
    Reach {
        /// The parameter.
        reach_m: f64,
    },
    /// There is no room.
    #[error("{name} is 0: a surface needs blocks")]
    NoBlocks {
        /// The parameter.
        name: &'static str,
    },
}

impl SurfaceConfig {
    /// The finest voxels.
    pub const LEAST_EDGE_M: f64 = 0.001;
    /// The coarsest voxels.
    pub const MOST_EDGE_M: f64 = 10.0;

    /// Checks every parameter.
    ///
    /// # Errors
    /// When one means nothing.
    pub fn validate(&self) -> Result<(), SurfaceConfigError> {
        let Self { edge_m, truncation_in_edges: in_edges, reach_m, .. } = *self;
        VoxelGrid::new(edge_m)?;
        if !(Self::LEAST_EDGE_M..=Self::MOST_EDGE_M).contains(&edge_m) {
            return Err(SurfaceConfigError::EdgeOutOfRange { edge_m });
        }
        if !(1.0..=64.0).contains(&in_edges) {
            return Err(SurfaceConfigError::Truncation { in_edges });
        }
        if !(reach_m.is_finite() && reach_m > 0.0) {
            return Err(SurfaceConfigError::Reach { reach_m });
        }
        for (name, blocks) in
            [("max_blocks", self.max_blocks), ("max_blocks_per_image", self.max_blocks_per_image)]
        {
            if blocks == 0 {
                return Err(SurfaceConfigError::NoBlocks { name });
            }
        }
        Ok(())
    }
}
