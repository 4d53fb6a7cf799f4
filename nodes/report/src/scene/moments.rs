//! From which cycle on each place of the map had been seen.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, VoxelEdgeError, VoxelGrid, VoxelKey};
use nalgebra::{Isometry3, Point3};

use crate::RunRecord;

/// The cycle, counted within the run, in which each voxel was seen first. A page of more cycles than 16 bits count shows the rest with
/// the last one.
pub(crate) struct Moments {
    grid: VoxelGrid,
    first_seen: HashMap<VoxelKey, u16, BuildVoxelHasher>,
    last: u16,
}

/// A cycle as the page counts it.
pub(crate) fn moment(ordinal: usize) -> u16 {
    ordinal.min(usize::from(u16::MAX)) as u16
}

impl Moments {
    pub(crate) fn of(run: &RunRecord) -> Result<Self, VoxelEdgeError> {
        let grid = VoxelGrid::new(run.voxel_edge_m)?;
        let mut first_seen = HashMap::default();
        for (ordinal, cycle) in run.cycles.iter().enumerate() {
            let map_from_rig: Isometry3<f32> = cycle.map_from_rig.cast();
            for point_m in cycle.view.iter().flat_map(|view| view.cloud_m()) {
                first_seen.entry(grid.key(&(map_from_rig * point_m))).or_insert(moment(ordinal));
            }
        }
        Ok(Self { grid, first_seen, last: moment(run.cycles.len().saturating_sub(1)) })
    }

    /// When a point's voxel was seen first, or one beside it where it was not; the last cycle where neither was.
    pub(crate) fn first_seen(&self, point_m: &Point3<f32>) -> u16 {
        self.known_first_seen(point_m).unwrap_or(self.last)
    }

    /// The same; none where neither was seen.
    pub(crate) fn known_first_seen(&self, point_m: &Point3<f32>) -> Option<u16> {
        let key = self.grid.key(point_m);
        let seen = |key: VoxelKey| self.first_seen.get(&key).copied();
        seen(key).or_else(|| key.with_neighbours().filter_map(seen).min())
    }
}
