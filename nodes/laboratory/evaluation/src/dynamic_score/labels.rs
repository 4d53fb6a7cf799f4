//! The dynamic label of each point, and the accuracies that benchmarks of the removal of moving points share.

use std::collections::HashSet;

use geometry::VoxelKey;
use serde::{Deserialize, Serialize};

use super::tally::share;
use super::{MapScore, RemovedPoints};

/// How well the points that were removed are those that moved.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct LabelScore {
    /// Of the moving points, the share that was removed; none without moving points.
    pub recall: Option<f64>,
    /// Of the removed points, the share that moved, where a static point in a voxel next to one that a moving
    /// point touches in the same cycle does not count: there the border runs through a voxel, or a camera's
    /// pixel mixes both. None where nothing was removed.
    pub precision: Option<f64>,
    /// The same, with these counted.
    pub precision_with_borders: Option<f64>,
    /// Static points that were removed and do not lie at a border.
    pub static_removed_off_borders: u64,
}

impl LabelScore {
    pub(super) fn of(
        object_points: RemovedPoints,
        static_points: RemovedPoints,
        static_removed_off_borders: u64,
    ) -> Self {
        let moved = object_points.removed;
        Self {
            recall: object_points.share,
            precision: share(moved, moved + static_removed_off_borders),
            precision_with_borders: share(moved, moved + static_points.removed),
            static_removed_off_borders,
        }
    }
}

/// Static, dynamic and associated accuracy (Zhang et al. 2023, A Dynamic Points Removal Benchmark in Point Cloud
/// Maps, section IV-A): what was kept of the static, what was removed of the moving, and their geometric mean.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct MapAccuracy {
    /// SA: of what stays still, the share that is kept.
    pub static_accuracy: Option<f64>,
    /// DA: of what moves, the share that is removed.
    pub dynamic_accuracy: Option<f64>,
    /// AA: the square root of their product.
    pub associated_accuracy: Option<f64>,
}

impl MapAccuracy {
    fn new(static_accuracy: Option<f64>, dynamic_accuracy: Option<f64>) -> Self {
        let associated_accuracy =
            static_accuracy.zip(dynamic_accuracy).map(|(kept, removed)| (kept * removed).sqrt());
        Self { static_accuracy, dynamic_accuracy, associated_accuracy }
    }

    /// By points, as each cycle has them.
    pub(super) fn by_points(object_points: RemovedPoints, static_points: RemovedPoints) -> Self {
        Self::new(static_points.share.map(|removed| 1.0 - removed), object_points.share)
    }

    /// By voxels of the final map, where each counts once however many points it has.
    pub(super) fn by_voxels(map: &MapScore) -> Self {
        let left = share(map.object_only_left as u64, map.object_only as u64);
        Self::new(map.static_kept_share, left.map(|left| 1.0 - left))
    }
}

/// The voxels of one cycle that a moving point touches, and those next to them.
pub(super) fn with_neighbours(voxels: &HashSet<VoxelKey>) -> HashSet<VoxelKey> {
    voxels.iter().flat_map(|key| key.with_neighbours()).collect()
}
