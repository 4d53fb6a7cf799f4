//! The 3D map of a road (Road LiDAR, sections 3.1.2 and 4.4): for each voxel the mean of the points that fell into it, and of
//! their intensities. Memory is bounded, and what it has no room for goes to a store and is not lost.
//!
//! The thesis keeps at most 500,000 points, since its viewer takes no more. Here tiles, squares seen from above, leave memory
//! when it is full, the one that was reached longest ago first. A tile that is reached again begins anew in memory, and its parts
//! are put together when the map is read, tile by tile: while driving nothing is read back. Sums are whole numbers, so that the map
//! does not depend on the order of the points, nor on when a tile left memory.

#[cfg(test)]
mod tests;
mod tile;

use std::collections::BTreeMap;

use geometry::VoxelKey;
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

use crate::registration::{ParameterError, check, check_positive};
pub use tile::{RoadTileKey, RoadTileStore, TileStoreFailure};
use tile::{Tile, Voxel};

/// The parameters of [`RoadMap`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RoadMapConfig {
    /// The edge of a voxel.
    pub voxel_edge_m: f64,
    /// This many voxels are in memory at most; 100 to 200 bytes each.
    pub max_voxels: usize,
    /// The edge of a tile.
    pub tile_edge_m: f64,
    /// Points farther from the scanner are left out: they are few, and a small error of a turn moves them far.
    pub max_range_m: f64,
    /// Nearer ones are of the vehicle itself.
    pub min_range_m: f64,
}

impl Default for RoadMapConfig {
    fn default() -> Self {
        Self {
            // Kerbs and posts are still seen.
            voxel_edge_m: 0.2,
            // 400 MB. Two minutes of an HDL-64E in a town have some three million voxels.
            max_voxels: 2_000_000,
            // A dozen within reach of a scanner.
            tile_edge_m: 40.0,
            // Half of the reach of an HDL-64E (its data sheet).
            max_range_m: 60.0,
            // The car of KITTI-360 sees itself up to 2.3 m.
            min_range_m: 2.5,
        }
    }
}

impl RoadMapConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        check_positive(&[
            ("voxel_edge_m", self.voxel_edge_m),
            ("tile_edge_m", self.tile_edge_m),
            ("max_range_m", self.max_range_m),
        ])?;
        let (least, most) = (self.min_range_m, self.max_range_m);
        check("min_range_m", "in [0, max_range_m)", least, (0.0..most).contains(&least))?;
        let edge = self.voxel_edge_m;
        check(
            "voxel_edge_m",
            "in 0.01 .. tile_edge_m",
            edge,
            (0.01..=self.tile_edge_m).contains(&edge),
        )?;
        let voxels = self.max_voxels;
        check("max_voxels", "at least 1000", voxels as f64, voxels >= 1000)
    }
}

/// A point of the map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RoadPoint {
    /// The mean of its voxel's points, in the map's frame.
    pub position_m: Point3<f64>,
    /// The mean of their intensities, in the scanner's unit.
    pub intensity: f32,
    /// How many they are.
    pub points: u32,
}

/// The map of a road.
#[derive(Debug)]
pub struct RoadMap {
    config: RoadMapConfig,
    tiles: BTreeMap<RoadTileKey, Tile>,
    voxels: usize,
    store: Box<dyn RoadTileStore>,
    /// Tiles of which parts are in the store.
    stored: BTreeMap<RoadTileKey, usize>,
    round: u64,
    counts: RoadMapCounts,
}

/// Counts of the points by outcome so far.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct RoadMapCounts {
    /// Points that were taken in.
    pub points: u64,
    /// Those that were too near, too far, or not finite.
    pub left_out: u64,
    /// Parts of tiles that went to the store.
    pub spilled_tiles: u64,
}

impl RoadMap {
    /// An empty map, which puts into the store what it has no room for.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(
        config: RoadMapConfig,
        store: Box<dyn RoadTileStore>,
    ) -> Result<Self, ParameterError> {
        config.validate()?;
        Ok(Self {
            config,
            tiles: BTreeMap::new(),
            voxels: 0,
            store,
            stored: BTreeMap::new(),
            round: 0,
            counts: RoadMapCounts::default(),
        })
    }

    /// Takes in the points of a scan (in the scanner's frame, as if measured at once), with their intensities as far as there are
    /// any.
    ///
    /// # Errors
    /// When the store takes no tile: what was in memory stays there, and the rest of the scan is not taken in.
    pub fn add(
        &mut self,
        points_m: &[Point3<f32>],
        intensities: Option<&[f32]>,
        map_from_lidar: &Isometry3<f64>,
    ) -> Result<(), TileStoreFailure> {
        self.round += 1;
        let square_m2 = self.config.min_range_m.powi(2)..=self.config.max_range_m.powi(2);
        let rotation = map_from_lidar.rotation.to_rotation_matrix();
        for (index, point_m) in points_m.iter().enumerate() {
            let seen: Point3<f64> = point_m.cast();
            let place_m = rotation * seen + map_from_lidar.translation.vector;
            // A number that is none is in no range.
            if !square_m2.contains(&seen.coords.norm_squared()) || !tile::is_within(&place_m) {
                self.counts.left_out += 1;
                continue;
            }
            let intensity = intensities.and_then(|all| all.get(index)).copied().unwrap_or(0.0);
            self.add_point(&place_m, intensity)?;
        }
        Ok(())
    }

    fn add_point(&mut self, place_m: &Point3<f64>, intensity: f32) -> Result<(), TileStoreFailure> {
        let cell = |value_m: f64, edge_m: f64| (value_m / edge_m).floor() as i32;
        let edge_m = self.config.voxel_edge_m;
        let key = VoxelKey {
            x: cell(place_m.x, edge_m),
            y: cell(place_m.y, edge_m),
            z: cell(place_m.z, edge_m),
        };
        // By the voxel, so that none lies in two.
        let corner_m = [key.x, key.y].map(|cell| f64::from(cell) * edge_m);
        let tile_m = self.config.tile_edge_m;
        let tile_key = RoadTileKey { x: cell(corner_m[0], tile_m), y: cell(corner_m[1], tile_m) };
        let is_new = self.tiles.get(&tile_key).is_none_or(|tile| !tile.voxels.contains_key(&key));
        if is_new && self.voxels >= self.config.max_voxels {
            self.spill(tile_key)?;
        }
        let tile = self.tiles.entry(tile_key).or_default();
        tile.reached = self.round;
        self.voxels += usize::from(!tile.voxels.contains_key(&key));
        tile.voxels.entry(key).or_default().add(place_m, intensity);
        self.counts.points += 1;
        Ok(())
    }

    /// The tile that was reached longest ago goes; the one that is reached now only if it is alone.
    fn spill(&mut self, reached: RoadTileKey) -> Result<(), TileStoreFailure> {
        let others = self.tiles.iter().filter(|(key, _)| **key != reached);
        let oldest = others.min_by_key(|(_, tile)| tile.reached).map(|(key, _)| *key);
        let key = oldest.unwrap_or(reached);
        let Some(tile) = self.tiles.get(&key) else { return Ok(()) };
        let bytes = tile.encoded();
        self.store.append(key, &bytes)?;
        *self.stored.entry(key).or_default() += bytes.len();
        self.voxels = self.voxels.saturating_sub(tile.voxels.len());
        self.tiles.remove(&key);
        self.counts.spilled_tiles += 1;
        Ok(())
    }

    /// Voxels in memory.
    #[must_use]
    pub fn voxels_in_memory(&self) -> usize {
        self.voxels
    }

    /// The counts so far.
    #[must_use]
    pub fn counts(&self) -> RoadMapCounts {
        self.counts
    }

    /// The tiles of the map, those of the store included, in their order.
    #[must_use]
    pub fn tiles(&self) -> Vec<RoadTileKey> {
        let mut keys: Vec<RoadTileKey> =
            self.tiles.keys().chain(self.stored.keys()).copied().collect();
        keys.sort_unstable();
        keys.dedup();
        keys
    }

    /// The points of a tile, in the order of their voxels: all that ever fell into it.
    ///
    /// # Errors
    /// When the store does not give back what it was given.
    pub fn points(&self, tile: RoadTileKey) -> Result<Vec<RoadPoint>, TileStoreFailure> {
        let mut voxels: BTreeMap<VoxelKey, Voxel> = BTreeMap::new();
        if let Some(expected) = self.stored.get(&tile) {
            let bytes = self.store.read(tile)?;
            if bytes.len() != *expected {
                let reason = format!("it has {} bytes in place of {expected}", bytes.len());
                return Err(TileStoreFailure { tile, reason });
            }
            for (key, voxel) in tile::decoded(&bytes) {
                voxels.entry(key).or_default().join(&voxel);
            }
        }
        for (key, voxel) in self.tiles.get(&tile).into_iter().flat_map(|tile| &tile.voxels) {
            voxels.entry(*key).or_default().join(voxel);
        }
        Ok(voxels.values().filter_map(Voxel::point).collect())
    }
}
