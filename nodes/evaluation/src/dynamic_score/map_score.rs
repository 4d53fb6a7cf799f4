//! The final map against the truth.

use std::collections::{BTreeMap, HashSet};

use geometry::{VoxelGrid, VoxelKey};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::tally::{ObjectTally, RegionTally, share};
use crate::RunRecord;

/// The final map against the truth, in voxels of the map frame.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct MapScore {
    /// Voxels that objects touched and no static point ever did.
    pub object_only: usize,
    /// Of these, voxels that the map without removal holds.
    pub object_only_without_removal: usize,
    /// Of these, voxels that the final map still holds.
    pub object_only_left: usize,
    /// Voxels that static points touched.
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
    scene: &RegionTally,
    objects: &BTreeMap<u16, ObjectTally>,
    map: &MapVoxels,
) -> MapScore {
    // Objects may share a voxel: counted once here, and once for each of them in their own scores.
    let object_only: HashSet<&VoxelKey> = objects
        .values()
        .flat_map(|tally| tally.region.voxels())
        .filter(|key| !scene.voxels().contains(key))
        .collect();
    let count_in = |voxels: &HashSet<VoxelKey>, keys: &HashSet<&VoxelKey>| {
        keys.iter().filter(|key| voxels.contains(**key)).count()
    };
    let scene_voxels: HashSet<&VoxelKey> = scene.voxels().iter().collect();
    let static_kept = count_in(&map.filtered, &scene_voxels);
    let static_without_removal = count_in(&map.unfiltered, &scene_voxels);
    MapScore {
        object_only: object_only.len(),
        object_only_without_removal: count_in(&map.unfiltered, &object_only),
        object_only_left: count_in(&map.filtered, &object_only),
        static_scene: scene_voxels.len(),
        static_without_removal,
        static_kept,
        static_kept_share: share(static_kept as u64, scene_voxels.len() as u64),
        static_kept_share_of_unfiltered: share(static_kept as u64, static_without_removal as u64),
    }
}
