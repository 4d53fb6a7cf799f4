//! The final map against the truth.

use std::collections::{BTreeMap, HashSet};

use geometry::{VoxelGrid, VoxelKey};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::tally::{ObjectTally, SceneTally, share};
use crate::RunRecord;

/// The final map against the truth, in voxels of the map frame.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct MapScore {
    /// Voxels that objects touched and no static point ever did.
    pub object_only: usize,
    /// Of these, voxels that the map without removal holds.
    pub object_only_without_removal: usize,
    /// Of `object_only`, voxels that the final map still holds.
    pub object_only_left: usize,
    /// Voxels that static points ever touched, if only in one cycle: what the static accuracy of the benchmarks
    /// counts.
    pub static_scene: usize,
    /// Of these, voxels that the map without removal holds: fewer, since the reduction leaves one point
    /// a voxel of the rig's grid, which need not be that of the map.
    pub static_without_removal: usize,
    /// Of `static_scene`, voxels that the final map holds.
    pub static_kept: usize,
    /// `static_kept / static_scene`; none without a static point.
    pub static_kept_share: Option<f64>,
    /// `static_kept / static_without_removal`: what the removal alone cost the static scene.
    pub static_kept_share_of_unfiltered: Option<f64>,
    /// Of `static_scene`, the voxels that are more than noise: see
    /// [`DynamicScoreRules::confirming_cycles`](super::DynamicScoreRules::confirming_cycles).
    pub static_confirmed: StaticVoxels,
}

/// Voxels of the static scene, and what became of them.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct StaticVoxels {
    /// How many.
    pub voxels: usize,
    /// Of these, voxels that the map without removal holds.
    pub without_removal: usize,
    /// Of these, voxels that the final map holds.
    pub kept: usize,
    /// `kept / voxels`; none without a voxel.
    pub kept_share: Option<f64>,
    /// `kept / without_removal`: what the removal alone cost.
    pub kept_share_of_unfiltered: Option<f64>,
}

impl StaticVoxels {
    fn of<'k>(keys: impl Iterator<Item = &'k VoxelKey>, map: &MapVoxels) -> Self {
        let (mut voxels, mut without_removal, mut kept) = (0, 0, 0);
        for key in keys {
            voxels += 1;
            without_removal += usize::from(map.unfiltered.contains(key));
            kept += usize::from(map.filtered.contains(key));
        }
        Self {
            voxels,
            without_removal,
            kept,
            kept_share: share(kept as u64, voxels as u64),
            kept_share_of_unfiltered: share(kept as u64, without_removal as u64),
        }
    }
}

/// The voxels that the two final maps hold.
pub(super) struct MapVoxels {
    pub(super) filtered: HashSet<VoxelKey>,
    pub(super) unfiltered: HashSet<VoxelKey>,
}

impl MapVoxels {
    pub(super) fn of(run: &RunRecord, grid: &VoxelGrid) -> Self {
        let voxels = |points: &[Point3<f32>]| points.iter().map(|point| grid.key(point)).collect();
        Self { filtered: voxels(&run.static_map), unfiltered: voxels(&run.unfiltered_map) }
    }
}

pub(super) fn map_score(
    scene: &SceneTally,
    objects: &BTreeMap<u16, ObjectTally>,
    map: &MapVoxels,
    confirming_cycles: u32,
) -> MapScore {
    // Objects may share a voxel: counted once here, and once for each of them in their own scores.
    let object_only: HashSet<&VoxelKey> = objects
        .values()
        .flat_map(|tally| tally.region.voxels())
        .filter(|key| !scene.contains(key))
        .collect();
    let count_in = |voxels: &HashSet<VoxelKey>, keys: &HashSet<&VoxelKey>| {
        keys.iter().filter(|key| voxels.contains(**key)).count()
    };
    // Touched at all.
    let touched = StaticVoxels::of(scene.touched_in(1), map);
    MapScore {
        object_only: object_only.len(),
        object_only_without_removal: count_in(&map.unfiltered, &object_only),
        object_only_left: count_in(&map.filtered, &object_only),
        static_scene: touched.voxels,
        static_without_removal: touched.without_removal,
        static_kept: touched.kept,
        static_kept_share: touched.kept_share,
        static_kept_share_of_unfiltered: touched.kept_share_of_unfiltered,
        static_confirmed: StaticVoxels::of(scene.touched_in(confirming_cycles), map),
    }
}
