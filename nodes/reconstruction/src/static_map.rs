//! The incremental voxel map (Rec-HV 3.2.8, 3.3.4, eq. 9).

mod blocks;
mod changes;
mod clearing;
mod evidence;
mod loading;
mod seen_order;
mod voxel;

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use geometry::{Cloud, SegmentedCycle, Stamp, VoxelGrid, VoxelKey};
use nalgebra::Point3;

use crate::config::{AtMaxVoxels, ConfigError, Method, ReconstructionConfig};
use blocks::Blocks;
use changes::Changes;
pub use changes::{LISTENER_TOLERANCE_IN_EDGES, MapChanges};
use clearing::RayTables;
pub use loading::{LOADED_HITS, LoadError};
use seen_order::SeenOrder;
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
    /// Voxels that went since rays passed them.
    pub cleared_voxels: usize,
    /// Voxels that went to make room for others.
    pub dropped_voxels: usize,
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
/// That is [`Method::RecHv`]. With [`Method::Stillmap`] the rays to the points clear what they pass
/// ([`StaticMap::integrate`]); a map that rays have cleared hangs on the order of the cycles, not on that of the
/// points within one.
///
/// # Memory
/// 80 bytes a voxel and a byte of the table, which is between 7/16 and 7/8 full: 93 to 185 bytes a voxel,
/// and half as much again while the table grows. While changes are followed, 12 to 24 bytes more for each
/// voxel that waits, and 28 to 56 for each one that is gone and waits. [`Method::Stillmap`] keeps a bit a voxel
/// besides, in blocks of 64 that take 25 to 60 bytes; [`AtMaxVoxels::DropOldest`] keeps 40 to 80 bytes a voxel
/// besides. `max_voxels` bounds them all.
#[derive(Clone, Debug)]
pub struct StaticMap {
    grid: VoxelGrid,
    max_voxels: usize,
    /// Looked up by key alone; its order reaches no result.
    voxels: HashMap<VoxelKey, VoxelMean, BuildVoxelHasher>,
    changed: Vec<VoxelKey>,
    /// Present while somebody follows the changes.
    changes: Option<Changes>,
    /// Present where rays clear voxels.
    occupied: Option<Blocks>,
    /// The tables of one cycle, kept for their memory.
    rays: RayTables,
    /// Present where old voxels make room.
    seen_order: Option<SeenOrder>,
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
            occupied: (config.method == Method::Stillmap).then(Blocks::default),
            rays: RayTables::default(),
            seen_order: (config.at_max_voxels == AtMaxVoxels::DropOldest).then(SeenOrder::default),
            frame_id: None,
            stamp: Stamp::default(),
            cycles: 0,
            refused_points: 0,
        })
    }

    /// Takes in one cycle. [`Method::RecHv`]: [`StaticMap::add`] of its static cloud. [`Method::Stillmap`]:
    /// besides, what the rays from the camera to the points of both clouds pass loses evidence, and goes when it
    /// has none left (module `clearing`, and [`Addition::cleared_voxels`]). The order of the points changes
    /// nothing there.
    ///
    /// # Errors
    /// When the static cloud is in another frame; the map is then as it was.
    pub fn integrate(&mut self, cycle: &SegmentedCycle) -> Result<Addition, MapError> {
        if self.occupied.is_none() {
            return self.add(&cycle.static_cloud);
        }
        self.begin_cycle(&cycle.static_cloud)?;
        Ok(self.add_and_clear(cycle))
    }

    /// Joins one cycle's static cloud PCL_k, in the map frame, to the map PCL_kT (eq. 9). The first
    /// cloud sets the map's frame. An empty cloud is a cycle like any other.
    ///
    /// # Errors
    /// When the cloud is in another frame; the map is then as it was.
    pub fn add(&mut self, static_cloud: &Cloud) -> Result<Addition, MapError> {
        self.begin_cycle(static_cloud)?;
        let mut addition = Addition::default();
        for point in &static_cloud.points_m {
            self.add_point(point, &mut addition);
        }
        self.end_adding(&mut addition);
        Ok(addition)
    }

    fn begin_cycle(&mut self, static_cloud: &Cloud) -> Result<(), MapError> {
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
        Ok(())
    }

    fn end_adding(&mut self, addition: &mut Addition) {
        addition.changed_voxels = self.changed.len();
        self.refused_points += addition.refused_points as u64;
    }

    fn add_point(&mut self, point: &Point3<f32>, addition: &mut Addition) {
        if !geometry::is_finite(point) {
            addition.not_finite_points += 1;
            return;
        }
        let key = self.grid.key(point);
        if self.voxels.len() >= self.max_voxels
            && !self.voxels.contains_key(&key)
            && !self.drop_oldest(addition)
        {
            addition.refused_points += 1;
            return;
        }
        let voxel = match self.voxels.entry(key) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                addition.new_voxels += 1;
                if let Some(occupied) = &mut self.occupied {
                    occupied.insert(key);
                }
                let voxel = entry.insert(VoxelMean::default());
                if let Some(changes) = &mut self.changes {
                    voxel.told = changes.told_of_new(key);
                }
                voxel
            }
        };
        if voxel.points() == 0 || voxel.last_cycle != self.cycles {
            voxel.last_cycle = self.cycles;
            voxel.evidence.hit();
            self.changed.push(key);
            if let Some(changes) = &mut self.changes {
                changes.touched(key, &mut voxel.told);
            }
            if let Some(seen_order) = &mut self.seen_order {
                seen_order.saw(key);
            }
        }
        voxel.add(point);
        addition.added_points += 1;
    }

    /// Makes room for a voxel. Returns whether there is some: not where old voxels are kept, and not where all
    /// were seen in this cycle.
    fn drop_oldest(&mut self, addition: &mut Addition) -> bool {
        let oldest = self.seen_order.as_ref().and_then(SeenOrder::oldest);
        let Some(key) = oldest else { return false };
        if self.voxels.get(&key).is_none_or(|voxel| voxel.last_cycle == self.cycles) {
            return false;
        }
        self.remove(key);
        addition.dropped_voxels += 1;
        true
    }

    fn remove(&mut self, key: VoxelKey) {
        let Some(voxel) = self.voxels.remove(&key) else { return };
        if let Some(changes) = &mut self.changes {
            changes.removed(key, &voxel.told, voxel.mean());
            if changes.gone() > self.max_voxels {
                self.follow_changes_anew();
            }
        }
        if let Some(occupied) = &mut self.occupied {
            occupied.remove(key);
        }
        if let Some(seen_order) = &mut self.seen_order {
            seen_order.forget(key);
        }
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

    /// The grid of the map's voxels.
    #[must_use]
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// So many voxels the map may have.
    #[must_use]
    pub fn max_voxels(&self) -> usize {
        self.max_voxels
    }

    /// The frame of the map, which the first cloud sets.
    #[must_use]
    pub fn frame_id(&self) -> Option<&str> {
        self.frame_id.as_deref()
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

    /// About how many bytes the map takes now.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        // The table is filled up to 7/8, and keeps one byte beside each entry.
        let slots = (self.voxels.capacity() * 8).div_ceil(7);
        let waiting = self.changes.as_ref().map_or(0, Changes::memory_bytes);
        let occupied = self.occupied.as_ref().map_or(0, Blocks::memory_bytes);
        let seen_order = self.seen_order.as_ref().map_or(0, SeenOrder::memory_bytes);
        slots * (size_of::<(VoxelKey, VoxelMean)>() + 1)
            + waiting
            + occupied
            + seen_order
            + self.rays.memory_bytes()
    }

    /// Empties the map, its frame included. Who follows the changes has to start with a new map.
    pub fn clear(&mut self) {
        self.voxels = HashMap::default();
        self.changed.clear();
        if let Some(changes) = &mut self.changes {
            *changes = Changes::default();
        }
        if let Some(occupied) = &mut self.occupied {
            *occupied = Blocks::default();
        }
        self.rays = RayTables::default();
        if let Some(seen_order) = &mut self.seen_order {
            *seen_order = SeenOrder::default();
        }
        self.frame_id = None;
        self.stamp = Stamp::default();
        self.cycles = 0;
        self.refused_points = 0;
    }
}

#[cfg(test)]
mod tests;
