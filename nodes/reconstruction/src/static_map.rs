//! The incremental voxel map (Rec-HV 3.2.8, 3.3.4, eq. 9).

mod addition;
mod anchor;
mod behaviour;
mod blanks;
mod blocks;
mod changes;
mod clearing;
mod correction;
mod evidence;
mod loading;
mod queries;
mod seen_order;
mod spill;
mod voxel;
mod whole;

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use geometry::{BuildVoxelHasher, Cloud, SegmentedCycle, Stamp, VoxelGrid, VoxelKey};
use nalgebra::Point3;

use crate::config::{AtMaxVoxels, ConfigError, ReconstructionConfig};
use crate::tiles::TileStore;
pub use addition::{Addition, MapError};
use anchor::Anchor;
use behaviour::{Behaviour, Clearing};
pub(crate) use blocks::BLOCK_EDGE_VOXELS;
use blocks::Blocks;
use changes::Changes;
pub use changes::{LISTENER_TOLERANCE_IN_EDGES, MapChanges};
pub use correction::{CorrectionCounts, CorrectionError, MapCorrection};
pub(crate) use correction::{Corrections, MapNow};
pub use loading::{LOADED_HITS, LoadError};
use seen_order::SeenOrder;
use spill::Spill;
use voxel::VoxelMean;
pub use whole::WholeMap;

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
/// That is [`geometry::Method::RecHv`]. With [`geometry::Method::FreeSpace`] the rays to the points clear what they pass
/// ([`StaticMap::integrate`]), and what stood in directions from which nothing comes back any more goes, too; a map that
/// loses voxels so hangs on the order of the cycles, not on that of the points within one.
///
/// The map of a SLAM that corrects itself follows its corrections: [`StaticMap::follow_path`].
///
/// # Memory
/// 80 bytes a voxel, the time at which it was seen first among them, and a byte of the table, which is between 7/16 and 7/8 full: 93 to 185 bytes a voxel,
/// and half as much again while the table grows. Where voxels go, too, their places are not all used again before the
/// table grows once more, so that it may end half as full: up to 370 bytes a voxel. While changes are followed, 12 to 24
/// bytes more for each voxel that waits, and 28 to 56 for each one that is gone and waits. [`geometry::Method::FreeSpace`] keeps a
/// bit a voxel besides, in blocks of 64 that take 25 to 60 bytes, and 0.3 MB for what the camera saw by direction;
/// [`AtMaxVoxels::DropOldest`] keeps 40 to 80 bytes a voxel besides. `max_voxels` bounds them all.
///
/// [`AtMaxVoxels::Spill`] keeps the bits too, and `max_voxels` bounds what is in memory. Besides, with the way that
/// was driven and no other bound, grow the 25 to 50 bytes of each tile that is out of memory, a thousandth of what its
/// voxels take or less, and while changes are followed those of the voxels that wait, as above.
#[derive(Debug)]
pub struct StaticMap {
    grid: VoxelGrid,
    max_voxels: usize,
    /// Looked up by key alone; its order reaches no result.
    voxels: HashMap<VoxelKey, VoxelMean, BuildVoxelHasher>,
    changed: Vec<VoxelKey>,
    /// Present while somebody follows the changes.
    changes: Option<Changes>,
    /// Present where rays clear voxels, or tiles are spilled.
    occupied: Option<Blocks>,
    behaviour: Behaviour,
    /// Present where old voxels make room.
    seen_order: Option<SeenOrder>,
    /// Present where tiles are spilled.
    spill: Option<Spill>,
    frame_id: Option<String>,
    stamp: Stamp,
    cycles: u32,
    refused_points: u64,
    /// When the first cycle was: what anchors count from.
    epoch: Option<Stamp>,
    /// That of voxels that come now.
    anchor: Anchor,
    corrections: Corrections,
}

impl StaticMap {
    /// An empty map that holds all it has in memory.
    ///
    /// # Errors
    /// When a parameter is out of its range, or the map is to spill tiles: see [`StaticMap::with_tile_store`].
    pub fn new(config: ReconstructionConfig) -> Result<Self, ConfigError> {
        Self::with_store_if_any(config, None)
    }

    /// An empty map that writes tiles to `store`, where [`AtMaxVoxels::Spill`] is chosen. The store is the map's
    /// alone, and is cleared.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn with_tile_store(
        config: ReconstructionConfig,
        store: Box<dyn TileStore>,
    ) -> Result<Self, ConfigError> {
        Self::with_store_if_any(config, Some(store))
    }

    fn with_store_if_any(
        config: ReconstructionConfig,
        store: Option<Box<dyn TileStore>>,
    ) -> Result<Self, ConfigError> {
        config.validate()?;
        let grid = config.pipeline.voxel_grid()?;
        let behaviour = Behaviour::of(config.pipeline.method);
        let clears = matches!(behaviour, Behaviour::FreeSpace(_));
        let spill = match config.at_max_voxels {
            AtMaxVoxels::Spill => {
                let store = store.ok_or(ConfigError::NoTileStore)?;
                Some(Spill::new(config.tile_edge_voxels()?, grid, store))
            }
            AtMaxVoxels::Refuse | AtMaxVoxels::DropOldest => None,
        };
        Ok(Self {
            grid,
            max_voxels: config.max_voxels,
            voxels: HashMap::default(),
            changed: Vec::new(),
            changes: None,
            occupied: (clears || spill.is_some()).then(Blocks::default),
            behaviour,
            seen_order: (config.at_max_voxels == AtMaxVoxels::DropOldest).then(SeenOrder::default),
            spill,
            frame_id: None,
            stamp: Stamp::default(),
            cycles: 0,
            refused_points: 0,
            epoch: None,
            anchor: Anchor::default(),
            corrections: Corrections::default(),
        })
    }

    /// Takes in one cycle. [`geometry::Method::RecHv`]: [`StaticMap::add`] of its static cloud. [`geometry::Method::FreeSpace`]:
    /// besides, what the rays from the camera to the points of both clouds pass loses evidence, as does what is in
    /// directions that have gone blank, and goes when it has none left (modules `clearing` and `blanks`, and
    /// [`Addition::cleared_voxels`]). The order of the points changes nothing there.
    ///
    /// # Errors
    /// When the static cloud is in another frame; the map is then as it was.
    pub fn integrate(&mut self, cycle: &SegmentedCycle) -> Result<Addition, MapError> {
        // Taken out for the time of the cycle, since it works on the voxels.
        let mut behaviour = std::mem::take(&mut self.behaviour);
        let addition = match &mut behaviour {
            Behaviour::RecHv => self.add(&cycle.static_cloud),
            Behaviour::FreeSpace(clearing) => self.add_and_clear(cycle, clearing),
        };
        self.behaviour = behaviour;
        addition
    }

    /// Joins one cycle's static cloud PCL_k, in the map frame, to the map PCL_kT (eq. 9). The first
    /// cloud sets the map's frame. An empty cloud is a cycle like any other.
    ///
    /// # Errors
    /// When the cloud is in another frame; the map is then as it was.
    pub fn add(&mut self, static_cloud: &Cloud) -> Result<Addition, MapError> {
        self.begin_cycle(static_cloud)?;
        let static_cloud = self.cloud_brought_over(static_cloud);
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
            None => {
                self.frame_id = Some(static_cloud.frame_id.clone());
                self.corrections.forget_path_of_another_frame(&static_cloud.frame_id);
            }
        }
        self.stamp = static_cloud.stamp;
        let epoch = *self.epoch.get_or_insert(static_cloud.stamp);
        self.anchor = Anchor::at(static_cloud.stamp, epoch);
        self.begin_counting_cycle();
        Ok(())
    }

    fn begin_counting_cycle(&mut self) {
        self.cycles = self.cycles.wrapping_add(1);
        self.changed.clear();
        self.begin_round();
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
        let is_refused = !self.fetch(key)
            || (self.voxels.len() >= self.max_voxels
                && !self.voxels.contains_key(&key)
                && !self.make_room(addition));
        if is_refused {
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
                if let Some(spill) = &mut self.spill {
                    spill.has_one_more();
                }
                let new = VoxelMean::new(self.anchor);
                let voxel = entry.insert(new);
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

    /// Makes room for a voxel. Returns whether there is some: not where old voxels are kept, not where all
    /// were seen in this cycle, and not where no tile can be written.
    fn make_room(&mut self, addition: &mut Addition) -> bool {
        if self.spill.is_some() {
            return self.spill_until(1);
        }
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
        self.behaviour.clear();
        if let Some(seen_order) = &mut self.seen_order {
            *seen_order = SeenOrder::default();
        }
        if let Some(spill) = &mut self.spill {
            spill.clear();
        }
        self.frame_id = None;
        self.stamp = Stamp::default();
        self.cycles = 0;
        self.refused_points = 0;
        self.epoch = None;
        self.anchor = Anchor::default();
        self.corrections.clear();
    }
}

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
