//! The incremental voxel map (Rec-HV 3.2.8, 3.3.4, eq. 9).

mod changes;
mod voxel;

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use geometry::{Cloud, Stamp, VoxelGrid, VoxelKey};
use nalgebra::Point3;

use crate::config::{ConfigError, ReconstructionConfig};
use changes::Changes;
pub use changes::LISTENER_TOLERANCE_IN_EDGES;
use voxel::{BuildVoxelHasher, VoxelMean};

/// What one cloud did to the map.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Addition {
    /// Points of the cloud that went into the map.
    pub added_points: usize,
    /// Points that were refused because they needed a voxel beyond `max_voxels`.
    pub refused_points: usize,
    /// Points that were left out because a coordinate is not finite.
    pub not_finite_points: usize,
    /// Voxels that the map did not have before.
    pub new_voxels: usize,
    /// Voxels that were touched, the new ones included.
    pub changed_voxels: usize,
}

/// A cloud that does not belong into the map.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum MapError {
    /// The cloud is in another frame than those before.
    #[error(
        "the static cloud is in frame {cloud:?}, the map in frame {map:?}: clear the map, or let the pose source \
         keep its frame"
    )]
    AnotherFrame {
        /// The frame of the map.
        map: String,
        /// The frame of the cloud.
        cloud: String,
    },
}

/// The static map: for each voxel the mean of all points that ever fell into it.
///
/// The thesis concatenates the map with the cycle's cloud and reduces the whole again every cycle
/// (eq. 9). Here each voxel keeps the sum and the number of its points, so that
/// - a cycle costs by its own points, not by the map (but for the table that grows now and then, which
///   spread over the cycles costs a constant a voxel);
/// - the map is [`VoxelGrid::reduce`] of all clouds put together, with every point weighing the same,
///   whereas in the thesis' repeated average the latest cycle weighs as much as all before;
/// - the sums are exact integers, so that the map does not hang on the order in which the clouds (or
///   their points) came, to the last bit, as long as no point was refused.
///
/// # Memory
/// 80 bytes a voxel and a byte of the table, which is between 7/16 and 7/8 full: 93 to 185 bytes a voxel,
/// and half as much again while the table grows. While changes are followed, 12 to 24 bytes more for each
/// voxel that waits. `max_voxels` bounds it.
#[derive(Clone, Debug)]
pub struct StaticMap {
    grid: VoxelGrid,
    max_voxels: usize,
    /// Looked up by key alone; its order reaches no result.
    voxels: HashMap<VoxelKey, VoxelMean, BuildVoxelHasher>,
    changed: Vec<VoxelKey>,
    /// Present while somebody follows the changes.
    changes: Option<Changes>,
    frame_id: Option<String>,
    stamp: Stamp,
    cycles: u32,
    refused_points: u64,
}

impl StaticMap {
    /// An empty map.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(config: ReconstructionConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        Ok(Self {
            grid: VoxelGrid::new(config.voxel_edge_m)?,
            max_voxels: config.max_voxels,
            voxels: HashMap::default(),
            changed: Vec::new(),
            changes: None,
            frame_id: None,
            stamp: Stamp::default(),
            cycles: 0,
            refused_points: 0,
        })
    }

    /// Joins one cycle's static cloud PCL_k, in the map frame, to the map PCL_kT (eq. 9). The first
    /// cloud sets the map's frame. An empty cloud is a cycle like any other.
    ///
    /// # Errors
    /// When the cloud is in another frame; the map is then as it was.
    pub fn add(&mut self, static_cloud: &Cloud) -> Result<Addition, MapError> {
        match &self.frame_id {
            Some(map) if *map != static_cloud.frame_id => {
                let cloud = static_cloud.frame_id.clone();
                return Err(MapError::AnotherFrame { map: map.clone(), cloud });
            }
            Some(_) => {}
            None => self.frame_id = Some(static_cloud.frame_id.clone()),
        }
        self.stamp = static_cloud.stamp;
        self.cycles = self.cycles.wrapping_add(1);
        self.changed.clear();
        let mut addition = Addition::default();
        for point in &static_cloud.points_m {
            self.add_point(point, &mut addition);
        }
        addition.changed_voxels = self.changed.len();
        self.refused_points += addition.refused_points as u64;
        Ok(addition)
    }

    fn add_point(&mut self, point: &Point3<f32>, addition: &mut Addition) {
        if !point.iter().all(|coordinate| coordinate.is_finite()) {
            addition.not_finite_points += 1;
            return;
        }
        let key = self.grid.key(point);
        let is_full = self.voxels.len() >= self.max_voxels;
        let voxel = match self.voxels.entry(key) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(_) if is_full => {
                addition.refused_points += 1;
                return;
            }
            Entry::Vacant(entry) => {
                addition.new_voxels += 1;
                entry.insert(VoxelMean::default())
            }
        };
        if voxel.points() == 0 || voxel.last_cycle != self.cycles {
            voxel.last_cycle = self.cycles;
            self.changed.push(key);
            if let Some(changes) = &mut self.changes {
                changes.touched(key, &mut voxel.told);
            }
        }
        voxel.add(point);
        addition.added_points += 1;
    }

    /// The points of the map, one a voxel, in ascending order of the voxels' keys.
    #[must_use]
    pub fn points(&self) -> Vec<Point3<f32>> {
        let mut voxels: Vec<(VoxelKey, Point3<f32>)> =
            self.voxels.iter().map(|(key, voxel)| (*key, voxel.mean())).collect();
        voxels.sort_unstable_by_key(|(key, _)| *key);
        voxels.into_iter().map(|(_, mean)| mean).collect()
    }

    /// The map as a cloud: [`StaticMap::points`] with the map's frame and the stamp of the latest cycle. An
    /// empty frame before the first cycle.
    #[must_use]
    pub fn cloud(&self) -> Cloud {
        self.cloud_of(self.points())
    }

    fn cloud_of(&self, points_m: Vec<Point3<f32>>) -> Cloud {
        let frame_id = self.frame_id.clone().unwrap_or_default();
        Cloud { stamp: self.stamp, frame_id, points_m }
    }

    /// The voxels that the latest cycle touched, in the order in which its points touched them.
    #[must_use]
    pub fn changed(&self) -> &[VoxelKey] {
        &self.changed
    }

    /// The point of a voxel and the number of points that it is the mean of.
    #[must_use]
    pub fn voxel(&self, key: VoxelKey) -> Option<(Point3<f32>, u32)> {
        self.voxels.get(&key).map(|voxel| (voxel.mean(), voxel.points()))
    }

    /// How many voxels, and so points, the map has.
    #[must_use]
    pub fn len(&self) -> usize {
        self.voxels.len()
    }

    /// Whether the map has no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.voxels.is_empty()
    }

    /// The points that were refused since the map was empty.
    #[must_use]
    pub fn refused_points(&self) -> u64 {
        self.refused_points
    }

    /// About how many bytes the voxels and the changes that wait take now.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        // The table is filled up to 7/8, and keeps one byte beside each entry.
        let slots = (self.voxels.capacity() * 8).div_ceil(7);
        let waiting = self.changes.as_ref().map_or(0, Changes::memory_bytes);
        slots * (size_of::<(VoxelKey, VoxelMean)>() + 1) + waiting
    }

    /// Empties the map, its frame included. Who follows the changes has to start with a new map.
    pub fn clear(&mut self) {
        self.voxels = HashMap::default();
        self.changed.clear();
        if let Some(changes) = &mut self.changes {
            *changes = Changes::default();
        }
        self.frame_id = None;
        self.stamp = Stamp::default();
        self.cycles = 0;
        self.refused_points = 0;
    }
}

#[cfg(test)]
mod tests;
