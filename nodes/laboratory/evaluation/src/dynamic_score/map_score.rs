//! The final map against the truth.

use std::collections::{BTreeMap, HashSet};

use geometry::{VoxelGrid, VoxelKey};
use nalgebra::Point3;
use report::{MapScore, RunRecord, StaticVoxels};

use super::tally::{ObjectTally, SceneTally, share};

fn static_voxels<'k>(keys: impl Iterator<Item = &'k VoxelKey>, map: &MapVoxels) -> StaticVoxels {
    let (mut voxels, mut without_removal, mut kept) = (0, 0, 0);
    for key in keys {
        voxels += 1;
        without_removal += usize::from(map.unfiltered.contains(key));
        kept += usize::from(map.filtered.contains(key));
    }
    StaticVoxels {
        voxels,
        without_removal,
        kept,
        kept_share: share(kept as u64, voxels as u64),
        kept_share_of_unfiltered: share(kept as u64, without_removal as u64),
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
    let touched = static_voxels(scene.touched_in(1), map);
    MapScore {
        object_only: object_only.len(),
        object_only_without_removal: count_in(&map.unfiltered, &object_only),
        object_only_left: count_in(&map.filtered, &object_only),
        static_scene: touched.voxels,
        static_without_removal: touched.without_removal,
        static_kept: touched.kept,
        static_kept_share: touched.kept_share,
        static_kept_share_of_unfiltered: touched.kept_share_of_unfiltered,
        static_confirmed: static_voxels(scene.touched_in(confirming_cycles), map),
    }
}
