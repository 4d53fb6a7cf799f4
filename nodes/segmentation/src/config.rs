//! The parameters of segmentation, their defaults, and where these come from.

use geometry::{VoxelEdgeError, VoxelGrid};
use serde::{Deserialize, Serialize};

/// How the object is cut out of its zone.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The two stages as Rec-HV publishes them.
    #[default]
    RecHv,
}

/// The parameters of [`crate::Segmenter`].
///
/// Every default stands in [`SegmentationConfig::default`] and nowhere else.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct SegmentationConfig {
    /// How the object is cut out of its zone.
    pub method: Method,
    /// The width of a cell of the depth histogram: t_vg, the edge of the reduction's voxels.
    pub depth_cell_m: f64,
}

impl Default for SegmentationConfig {
    fn default() -> Self {
        // Rec-HV 3.3.3.1: the cells have the edge t_vg of the voxel grid, which experiment 4 chose.
        Self { method: Method::RecHv, depth_cell_m: 0.08 }
    }
}

/// A parameter of segmentation has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum ConfigError {
    /// The depth cell is no length.
    #[error("parameter depth_cell_m: {0}")]
    DepthCell(#[from] VoxelEdgeError),
}

impl SegmentationConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// When the depth cell is not a positive finite number.
    pub fn validate(&self) -> Result<(), ConfigError> {
        VoxelGrid::new(self.depth_cell_m)?;
        Ok(())
    }
}
