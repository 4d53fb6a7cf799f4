//! Counts of the true points of a cycle, and of the voxels that they touch over the run.

use std::collections::{HashMap, HashSet};

use geometry::{BuildVoxelHasher, DynamicZone, VoxelKey};
use nalgebra::{Point3, Vector3};
use report::{DynamicScoreRules, ObjectCycleScore, RemovedPoints};

/// The image size for which the visibility threshold is stated: the Kinect v1's.
const REFERENCE_IMAGE_PX: f64 = 640.0 * 480.0;

/// `part / whole`; `None` when the whole is 0.
pub(super) fn share(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

/// The sum of several parts.
pub(super) fn removed_points(parts: impl Iterator<Item = RemovedPoints>) -> RemovedPoints {
    let (points, removed) = parts
        .fold((0, 0), |(points, removed), part| (points + part.points, removed + part.removed));
    RemovedPoints { points, removed, share: share(removed, points) }
}

/// The least points of an object that counts as visible in an image of this size.
pub(super) fn in_view_points(
    rules: &DynamicScoreRules,
    (width_px, height_px): (usize, usize),
) -> u64 {
    let scale = width_px as f64 * height_px as f64 / REFERENCE_IMAGE_PX;
    ((rules.in_view_px_at_640x480 * scale).ceil() as u64).max(1)
}

/// The voxels of the map frame that an object touched.
#[derive(Default)]
pub(super) struct RegionTally {
    // Only used for membership tests and counts, so the order of hashing affects no result.
    voxels: HashSet<VoxelKey>,
    latest: Option<VoxelKey>,
}

impl RegionTally {
    pub(super) fn touch(&mut self, key: VoxelKey) {
        // Neighbouring pixels mostly fall into one voxel: the comparison saves most of the hashing.
        if self.latest != Some(key) {
            self.latest = Some(key);
            self.voxels.insert(key);
        }
    }

    pub(super) fn voxels(&self) -> &HashSet<VoxelKey> {
        &self.voxels
    }
}

/// The voxels of the map frame that static points touched, and in how many cycles.
#[derive(Default)]
pub(super) struct SceneTally {
    // Only looked up by key and counted, so the order of hashing affects no result.
    voxels: HashMap<VoxelKey, Touches, BuildVoxelHasher>,
    /// The number of the cycle, from 1; 0 before the first.
    cycle: u32,
}

#[derive(Default)]
struct Touches {
    cycles: u32,
    last_cycle: u32,
    points: u64,
    sum_m: Vector3<f64>,
}

impl SceneTally {
    /// Begins another cycle.
    pub(super) fn begin_cycle(&mut self) {
        self.cycle += 1;
    }

    pub(super) fn touch(&mut self, key: VoxelKey, point_in_map: &Point3<f32>) {
        let cycle = self.cycle;
        let touches = self.voxels.entry(key).or_default();
        if touches.last_cycle != cycle {
            touches.cycles += 1;
            touches.last_cycle = cycle;
        }
        touches.points += 1;
        touches.sum_m += point_in_map.coords.cast::<f64>();
    }

    pub(super) fn contains(&self, key: &VoxelKey) -> bool {
        self.voxels.contains_key(key)
    }

    /// All voxels that were touched.
    pub(super) fn voxels(&self) -> impl Iterator<Item = &VoxelKey> {
        self.voxels.keys()
    }

    /// The mean of the points that touched a voxel, of each voxel that was touched in at least `cycles` cycles.
    pub(super) fn means_of_voxels(&self, cycles: u32) -> impl Iterator<Item = Point3<f32>> {
        let touched = self.voxels.values().filter(move |touches| touches.cycles >= cycles);
        touched.map(|touches| Point3::from((touches.sum_m / touches.points as f64).cast::<f32>()))
    }
}

/// The counts of an object over the run.
#[derive(Default)]
pub(super) struct ObjectTally {
    pub(super) region: RegionTally,
    pub(super) per_cycle: Vec<ObjectCycleScore>,
}

/// The true points of one label in one cycle.
#[derive(Default)]
pub(super) struct CycleTally {
    points: u64,
    removed: u64,
    in_zone: u64,
    sum_m: Vector3<f64>,
}

impl CycleTally {
    pub(super) fn add_static(&mut self, removed: bool) {
        self.points += 1;
        self.removed += u64::from(removed);
    }

    pub(super) fn add_object(
        &mut self,
        point_in_rig: &Point3<f32>,
        removed: bool,
        zones: &[DynamicZone],
    ) {
        self.points += 1;
        self.removed += u64::from(removed);
        self.in_zone += u64::from(zones.iter().any(|zone| zone.contains(point_in_rig)));
        self.sum_m += point_in_rig.coords.cast::<f64>();
    }

    pub(super) fn removed_points(&self) -> RemovedPoints {
        RemovedPoints {
            points: self.points,
            removed: self.removed,
            share: share(self.removed, self.points),
        }
    }

    /// The mean of the points; `None` without points.
    pub(super) fn mean_in_rig(&self) -> Option<Point3<f64>> {
        (self.points > 0).then(|| (self.sum_m / self.points as f64).into())
    }

    /// Adds the score of an object that has at least one point.
    pub(super) fn object_cycle_score(
        &self,
        index: u32,
        rules: &DynamicScoreRules,
        in_view_points: u64,
    ) -> ObjectCycleScore {
        let points = self.removed_points();
        let share_in_zone = share(self.in_zone, self.points).unwrap_or(0.0);
        let in_view = self.points >= in_view_points;
        let removed_share = points.share.unwrap_or(0.0);
        ObjectCycleScore {
            index,
            points,
            share_in_zone,
            azimuth_rad: self.sum_m.y.atan2(self.sum_m.x),
            in_view,
            found: in_view && share_in_zone >= rules.found_share_in_zone && self.removed > 0,
            removed: in_view && removed_share >= rules.removed_share,
        }
    }
}
