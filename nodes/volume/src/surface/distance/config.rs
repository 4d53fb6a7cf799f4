//! The parameters of a field of distances, their defaults, and where these come from.

/// The parameters of [`super::DistanceField`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DistanceConfig {
    /// How far the nodes are apart, in metres. It need not be the edge of the map.
    pub edge_m: f64,
    /// Obstacles that are farther away count as none, in metres.
    pub max_distance_m: f64,
    /// Blocks of 8 voxels an axis that are kept at most, of 2.9 kB each where an obstacle is within the bound. One more, and all
    /// are forgotten: they are computed again when they are asked for.
    pub max_blocks: usize,
}

impl Default for DistanceConfig {
    fn default() -> Self {
        Self {
            // The cells of the occupancy grid, and of Nav2's costmaps.
            edge_m: 0.05,
            // As voxblox and nvblox have it for planners (`esdf_max_distance_m`, `max_esdf_distance_m`: 2 m).
            max_distance_m: 2.0,
            // 60 MB: 1,200 cubic metres at 5 cm.
            max_blocks: 20_000,
        }
    }
}

/// A parameter has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum DistanceConfigError {
    /// The edge is of no use.
    #[error(
        "distances every {edge_m} m: from {} m to {} m are possible",
        DistanceConfig::LEAST_EDGE_M,
        DistanceConfig::MOST_EDGE_M
    )]
    Edge {
        /// The parameter.
        edge_m: f64,
    },
    /// The bound is of no use.
    #[error(
        "distances up to {max_distance_m} m: from {} m to {} m are possible",
        DistanceConfig::LEAST_BOUND_M,
        DistanceConfig::MOST_BOUND_M
    )]
    Bound {
        /// The parameter.
        max_distance_m: f64,
    },
    /// There is no room.
    #[error("distances in no blocks: at least one is needed")]
    NoBlocks,
}

impl DistanceConfig {
    /// The finest nodes.
    pub const LEAST_EDGE_M: f64 = 0.01;
    /// The coarsest nodes.
    pub const MOST_EDGE_M: f64 = 1.0;
    /// The least bound.
    pub const LEAST_BOUND_M: f64 = 0.1;
    /// The largest bound: what a block costs grows with its third power.
    pub const MOST_BOUND_M: f64 = 10.0;

    /// Checks every parameter.
    ///
    /// # Errors
    /// When one means nothing.
    pub fn validate(&self) -> Result<(), DistanceConfigError> {
        let Self { edge_m, max_distance_m, max_blocks } = *self;
        if !(Self::LEAST_EDGE_M..=Self::MOST_EDGE_M).contains(&edge_m) {
            return Err(DistanceConfigError::Edge { edge_m });
        }
        if !(Self::LEAST_BOUND_M..=Self::MOST_BOUND_M).contains(&max_distance_m) {
            return Err(DistanceConfigError::Bound { max_distance_m });
        }
        if max_blocks == 0 { Err(DistanceConfigError::NoBlocks) } else { Ok(()) }
    }
}
