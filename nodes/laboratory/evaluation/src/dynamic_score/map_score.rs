//! The final map against the ground truth.

use std::collections::{BTreeMap, HashMap, HashSet};

use geometry::{BuildVoxelHasher, VoxelGrid, VoxelKey};
use nalgebra::Point3;
use report::{MapScore, RunRecord, StaticVoxels};

use super::tally::{ObjectTally, SceneTally, share};

fn static_voxels(means_m: impl Iterator<Item = Point3<f32>>, map: &MapVoxels) -> StaticVoxels {
    let (mut voxels, mut without_removal, mut kept, mut kept_by_both) = (0, 0, 0, 0);
    for mean_m in means_m {
        let is_near = [&map.unfiltered, &map.filtered].map(|points| points.is_near(&mean_m));
        voxels += 1;
        without_removal += usize::from(is_near[0]);
        kept += usize::from(is_near[1]);
        // Each map has its own means: the final one may have a point within the tolerance where the other has none.
        kept_by_both += usize::from(is_near == [true; 2]);
    }
    StaticVoxels {
        voxels,
        without_removal,
        kept,
        kept_share: share(kept as u64, voxels as u64),
        kept_share_of_unfiltered: share(kept_by_both as u64, without_removal as u64),
    }
}

/// The voxels of the static scene, touched at all, in which the final map has a point.
pub(super) fn static_voxels_with_points(scene: &SceneTally, map: &MapVoxels) -> usize {
    scene.voxels().filter(|key| map.filtered.contains(key)).count()
}

/// The points of the two final maps.
pub(super) struct MapVoxels {
    pub(super) filtered: MapPoints,
    pub(super) unfiltered: MapPoints,
}

/// The points of a map by the voxel that they lie in.
pub(super) struct MapPoints {
    // Only looked up by key: the order of hashing affects no result.
    voxels: HashMap<VoxelKey, Vec<Point3<f32>>, BuildVoxelHasher>,
    grid: VoxelGrid,
}

impl MapVoxels {
    pub(super) fn of(run: &RunRecord, grid: &VoxelGrid) -> Self {
        let points = |points_m: &[Point3<f32>]| MapPoints::of(points_m, *grid);
        Self { filtered: points(&run.static_map), unfiltered: points(&run.unfiltered_map) }
    }
}

impl MapPoints {
    fn of(points_m: &[Point3<f32>], grid: VoxelGrid) -> Self {
        let mut voxels: HashMap<_, Vec<_>, _> = HashMap::default();
        for point_m in points_m {
            voxels.entry(grid.key(point_m)).or_default().push(*point_m);
        }
        Self { voxels, grid }
    }

    /// Whether a point lies in a voxel.
    pub(super) fn contains(&self, key: &VoxelKey) -> bool {
        self.voxels.contains_key(key)
    }

    /// Whether a point lies within one edge of a place.
    fn is_near(&self, place_m: &Point3<f32>) -> bool {
        let edge_m = self.grid.edge_m() as f32;
        let is_within = |point_m: &Point3<f32>| (point_m - place_m).norm() <= edge_m;
        let around = self.grid.key(place_m).with_neighbours();
        around.into_iter().any(|key| self.voxels.get(&key).into_iter().flatten().any(is_within))
    }
}

pub(super) fn map_score(
    scene: &SceneTally,
    objects: &BTreeMap<u16, ObjectTally>,
    map: &MapVoxels,
    confirming_cycles: u32,
) -> MapScore {
    // Objects may share a voxel: it counts once here, and once in the score of each of them.
    let object_only: HashSet<&VoxelKey> = objects
        .values()
        .flat_map(|tally| tally.region.voxels())
        .filter(|key| !scene.contains(key))
        .collect();
    let count_in = |map: &MapPoints, keys: &HashSet<&VoxelKey>| {
        keys.iter().filter(|key| map.contains(key)).count()
    };
    // Touched at all.
    let touched = static_voxels(scene.means_of_voxels(1), map);
    MapScore {
        object_only: object_only.len(),
        object_only_without_removal: count_in(&map.unfiltered, &object_only),
        object_only_left: count_in(&map.filtered, &object_only),
        static_scene: touched.voxels,
        static_without_removal: touched.without_removal,
        static_kept: touched.kept,
        static_kept_share: touched.kept_share,
        static_kept_share_of_unfiltered: touched.kept_share_of_unfiltered,
        static_confirmed: static_voxels(scene.means_of_voxels(confirming_cycles), map),
        surface: None,
    }
}
