//! The incremental voxel map of means (Rec-HV 3.2.8, 3.3.4, eq. 9).

mod anchor;
mod changes;
mod correction;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod voxel;

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use geometry::{
    BuildVoxelHasher, Cloud, OccupancyGrid, OrientedPoints, SegmentedCycle, Stamp, VoxelGrid,
    VoxelKey,
};
use nalgebra::Point3;

use crate::config::{AtMaxVoxels, ConfigError, ReconstructionConfig};
use crate::correction::Corrections;
use crate::grid::{GridConfig, GridError, GridPoints, GridSource, grid_of_points};
use crate::{Addition, LoadError, MapError, WholeMap};
use anchor::Anchor;
use changes::Changes;
pub use changes::LISTENER_TOLERANCE_IN_EDGES;
use voxel::VoxelMean;

/// A point of a loaded map counts as so many points of its voxel's mean.
pub const LOADED_HITS: u32 = 2;

/// The static map of the method `rec_hv`: for each voxel the mean of all points that ever fell into it.
///
/// The thesis concatenates the map with the cycle's cloud and reduces the whole again every cycle
/// (eq. 9). Here each voxel keeps the sum and the number of its points, so that
/// - a cycle costs by its own points, not by the map (but for the table that grows now and then, which
///   spread over the cycles costs a constant a voxel);
/// - the map is [`VoxelGrid::reduce`] of all clouds put together, with every point weighing the same,
///   whereas in the thesis' repeated average the latest cycle weighs as much as all before;
/// - the sums are exact integers, so that the map does not depend on the order in which the clouds (or
///   their points) came, to the last bit, as long as no point was refused.
///
/// What was put in stays in. The map of a SLAM that corrects itself follows its corrections: [`StaticMap::follow_path`].
///
/// # Memory
/// 80 bytes a voxel, the time at which it was seen first among them, and a byte of the table, which is between 7/16 and 7/8 full:
/// 93 to 185 bytes a voxel, and half as much again while the table grows. While changes are followed, 12 to 24 bytes more for
/// each voxel that waits. `max_voxels` bounds them all: a point that needs another voxel is refused.
#[derive(Debug)]
pub struct StaticMap {
    grid: VoxelGrid,
    max_voxels: usize,
    /// Looked up by key alone; its order reaches no result.
    voxels: HashMap<VoxelKey, VoxelMean, BuildVoxelHasher>,
    changed: Vec<VoxelKey>,
    /// Present while somebody follows the changes.
    changes: Option<Changes>,
    frame_id: Option<String>,
    /// The frame before the map was emptied: who shows the map has to be told in the frame that he knows.
    former_frame_id: Option<String>,
    stamp: Stamp,
    grid_config: GridConfig,
    cycles: u32,
    refused_points: u64,
    /// When the first cycle was: what anchors count from.
    epoch: Option<Stamp>,
    /// That of voxels that come now.
    anchor: Anchor,
    corrections: Corrections,
}

impl StaticMap {
    /// An empty map.
    ///
    /// # Errors
    /// When a parameter is out of its range, or old voxels are to be dropped or spilled.
    pub fn new(config: ReconstructionConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        if config.at_max_voxels != AtMaxVoxels::Refuse {
            return Err(ConfigError::MeansAreRefused);
        }
        Ok(Self {
            grid: config.pipeline.voxel_grid()?,
            max_voxels: config.max_voxels,
            grid_config: config.grid,
            voxels: HashMap::default(),
            changed: Vec::new(),
            changes: None,
            frame_id: None,
            former_frame_id: None,
            stamp: Stamp::default(),
            cycles: 0,
            refused_points: 0,
            epoch: None,
            anchor: Anchor::default(),
            corrections: Corrections::default(),
        })
    }

    /// Takes in one cycle: [`StaticMap::add`] of its static cloud.
    ///
    /// # Errors
    /// When the static cloud is in another frame; the map is then as it was.
    pub fn integrate(&mut self, cycle: &SegmentedCycle) -> Result<Addition, MapError> {
        self.add(&cycle.static_cloud)
    }

    /// Joins one cycle's static cloud PCL_k, in the map frame, to the map PCL_kT (eq. 9). The first
    /// cloud sets the map's frame. An empty cloud is a cycle like any other.
    ///
    /// # Errors
    /// When the cloud is in another frame; the map is then as it was.
    pub fn add(&mut self, static_cloud: &Cloud) -> Result<Addition, MapError> {
        let Cloud { stamp, frame_id, points_m } = static_cloud;
        match &self.frame_id {
            Some(map) if map != frame_id => {
                let (map, cloud) = (map.clone(), frame_id.clone());
                return Err(MapError::AnotherFrame { map, cloud });
            }
            Some(_) => {}
            None => {
                self.frame_id = Some(frame_id.clone());
                self.corrections.forget_path_of_another_frame(frame_id);
            }
        }
        self.stamp = *stamp;
        self.anchor = Anchor::at(*stamp, *self.epoch.get_or_insert(*stamp));
        self.begin_cycle();
        let mut addition = Addition::default();
        // A cloud with an earlier pose than a correction is put where it belongs.
        let missed = self.corrections.missed_at(*stamp);
        let corrected =
            missed.map(|missed| static_cloud.clone().transformed(&missed, frame_id).points_m);
        for point in corrected.as_ref().unwrap_or(points_m) {
            self.add_point(point, &mut addition);
        }
        self.end_adding(&mut addition);
        Ok(addition)
    }

    fn begin_cycle(&mut self) {
        self.cycles = self.cycles.wrapping_add(1);
        self.changed.clear();
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
        let is_full = self.voxels.len() >= self.max_voxels;
        let voxel = match self.voxels.entry(key) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(_) if is_full => {
                addition.refused_points += 1;
                return;
            }
            Entry::Vacant(entry) => {
                addition.new_voxels += 1;
                entry.insert(VoxelMean::new(self.anchor))
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

    /// Puts these points, in `frame_id`, in the place of the whole map: each voxel is the mean of its points, with
    /// [`LOADED_HITS`]. Points that are not finite are left out. The order of the points changes nothing. The
    /// stamp stays. Who follows the changes has to start with a new map, as after [`StaticMap::clear`].
    ///
    /// # Errors
    /// When the points need more than `max_voxels`; the map is then as it was.
    pub fn replace(
        &mut self,
        points_m: &[Point3<f32>],
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        let finite = points_m.iter().filter(|point| geometry::is_finite(point));
        let mut keyed: Vec<(VoxelKey, &Point3<f32>)> =
            finite.map(|point| (self.grid.key(point), point)).collect();
        keyed.sort_unstable_by_key(|(key, _)| *key);
        let (voxels, max_voxels) = (keyed.chunk_by(|a, b| a.0 == b.0).count(), self.max_voxels);
        if voxels > max_voxels {
            return Err(LoadError::TooManyVoxels { voxels, max_voxels });
        }
        self.clear();
        self.frame_id = Some(frame_id.to_owned());
        self.begin_cycle();
        let mut addition = Addition::default();
        for _ in 0..LOADED_HITS {
            keyed.iter().for_each(|(_, point)| self.add_point(point, &mut addition));
        }
        addition.added_points = keyed.len();
        addition.not_finite_points = points_m.len() - keyed.len();
        self.end_adding(&mut addition);
        Ok(addition)
    }

    /// Gives the frame of the map another name, as when its first cloud has the name in full. The points stay.
    pub fn rename_frame(&mut self, frame_id: &str) {
        self.frame_id = Some(frame_id.to_owned());
    }

    /// Empties the map, its frame included. Who follows the changes has to start with a new map.
    pub fn clear(&mut self) {
        self.voxels = HashMap::default();
        self.changed.clear();
        if let Some(changes) = &mut self.changes {
            *changes = Changes::default();
        }
        self.former_frame_id = self.frame_id.take().or(self.former_frame_id.take());
        self.cycles = 0;
        self.refused_points = 0;
        self.epoch = None;
        self.anchor = Anchor::default();
        self.corrections.clear();
    }

    /// The points of the map, one a voxel, in ascending order of the voxels' keys. Takes 24 bytes a voxel while it is made.
    #[must_use]
    pub fn points(&self) -> Vec<Point3<f32>> {
        let mut voxels: Vec<(VoxelKey, Point3<f32>)> =
            self.voxels.iter().map(|(key, voxel)| (*key, voxel.mean())).collect();
        voxels.sort_unstable_by_key(|(key, _)| *key);
        voxels.into_iter().map(|(_, mean)| mean).collect()
    }

    /// The same, as any map has them.
    #[must_use]
    pub fn whole(&self) -> WholeMap {
        let points = OrientedPoints { points_m: self.points(), ..OrientedPoints::default() };
        WholeMap { points, ..WholeMap::default() }
    }

    /// The occupancy grid of the points alone: [`crate::grid::grid_of_points`].
    ///
    /// # Errors
    /// When none was asked for, or there is none.
    pub fn occupancy_grid(&self) -> Result<OccupancyGrid, GridError> {
        if self.grid_config.grid == GridSource::None {
            return Err(GridError::Off);
        }
        let points = GridPoints { points_m: &self.points(), normals: &[] };
        grid_of_points(&self.grid_config, points, (self.frame_id().unwrap_or_default(), self.stamp))
    }

    /// The map as a cloud: [`StaticMap::points`] with the map's frame and the stamp of the latest cycle. An
    /// empty frame before the first cycle.
    #[must_use]
    pub fn cloud(&self) -> Cloud {
        self.cloud_of(self.points())
    }

    fn cloud_of(&self, points_m: Vec<Point3<f32>>) -> Cloud {
        let frame_id = self.frame_id.as_ref().or(self.former_frame_id.as_ref());
        Cloud { stamp: self.stamp, frame_id: frame_id.cloned().unwrap_or_default(), points_m }
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
        slots * (size_of::<(VoxelKey, VoxelMean)>() + 1) + waiting
    }
}
