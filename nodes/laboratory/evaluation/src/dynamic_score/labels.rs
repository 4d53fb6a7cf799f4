//! The dynamic label of each point, and the accuracies that benchmarks of the removal of moving points share.

use std::collections::HashSet;

use geometry::VoxelKey;

use report::{LabelScore, MapAccuracy, MapScore, RemovedPoints};

use super::tally::share;

pub(super) fn label_score(
    object_points: RemovedPoints,
    static_points: RemovedPoints,
    static_removed_off_borders: u64,
) -> LabelScore {
    let moved = object_points.removed;
    LabelScore {
        recall: object_points.share,
        precision: share(moved, moved + static_removed_off_borders),
        precision_with_borders: share(moved, moved + static_points.removed),
        static_removed_off_borders,
    }
}

/// By points, over all cycles.
pub(super) fn accuracy_by_points(
    object_points: RemovedPoints,
    static_points: RemovedPoints,
) -> MapAccuracy {
    accuracy(static_points.share.map(|removed| 1.0 - removed), object_points.share)
}

/// By voxels of the final map, where each counts once however many points it has. `static_with_points` are those of the
/// static scene that have one.
pub(super) fn accuracy_by_voxels(map: &MapScore, static_with_points: usize) -> MapAccuracy {
    let left = share(map.object_only_left as u64, map.object_only as u64);
    let kept = share(static_with_points as u64, map.static_scene as u64);
    accuracy(kept, left.map(|left| 1.0 - left))
}

fn accuracy(static_accuracy: Option<f64>, dynamic_accuracy: Option<f64>) -> MapAccuracy {
    let associated_accuracy =
        static_accuracy.zip(dynamic_accuracy).map(|(kept, removed)| (kept * removed).sqrt());
    MapAccuracy { static_accuracy, dynamic_accuracy, associated_accuracy }
}

/// The voxels of one cycle that a moving point touches, and those next to them.
pub(super) fn with_neighbours(voxels: &HashSet<VoxelKey>) -> HashSet<VoxelKey> {
    voxels.iter().flat_map(|key| key.with_neighbours()).collect()
}
