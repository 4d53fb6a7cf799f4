//! Squares of the map, seen from above, and how they go to a store.

use std::collections::HashMap;
use std::fmt;

use geometry::{BuildVoxelHasher, VoxelKey};
use nalgebra::Point3;

use super::RoadPoint;

/// A tile's place: counted in edges from the map's origin.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct RoadTileKey {
    /// Along x.
    pub x: i32,
    /// Along y.
    pub y: i32,
}

impl fmt::Display for RoadTileKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "({}, {})", self.x, self.y)
    }
}

/// Where tiles go.
pub trait RoadTileStore: fmt::Debug + Send {
    /// Puts bytes behind those that were kept of a tile.
    ///
    /// # Errors
    /// When they are not kept.
    fn append(&mut self, tile: RoadTileKey, bytes: &[u8]) -> Result<(), TileStoreFailure>;

    /// All bytes that were kept of a tile, in their order.
    ///
    /// # Errors
    /// When they cannot be had.
    fn read(&self, tile: RoadTileKey) -> Result<Vec<u8>, TileStoreFailure>;
}

/// A store cannot keep a tile, or not give it back.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("tile {tile} of the map: {reason}")]
pub struct TileStoreFailure {
    /// Which.
    pub tile: RoadTileKey,
    /// Why.
    pub reason: String,
}

/// The voxels of a tile in memory.
#[derive(Debug, Default)]
pub(super) struct Tile {
    /// Never read in the table's order but to be sorted, or summed as whole numbers.
    pub(super) voxels: HashMap<VoxelKey, Voxel, BuildVoxelHasher>,
    pub(super) reached: u64,
}

/// Sums over the points of a voxel. Whole numbers: their order does not matter.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Voxel {
    sums: [i64; 3],
    intensity: i64,
    points: u32,
}

/// Sums of places are in steps of 2^-20 m: a micrometre.
const STEPS_PER_M: f64 = 1_048_576.0;
/// Those of intensities in steps of 2^-16 of the scanner's unit: KITTI's are 0 to 1.
const STEPS_PER_INTENSITY: f64 = 65_536.0;
/// Places are nearer to the origin than this, so that four thousand million points of one voxel have a sum.
const FARTHEST_M: f64 = 2_000.0 * 1_000.0;
/// Brighter is nothing.
const BRIGHTEST: f32 = 100_000.0;

/// Whether a place can be one of the map.
pub(super) fn is_within(place_m: &Point3<f64>) -> bool {
    place_m.iter().all(|value_m| value_m.abs() < FARTHEST_M)
}

/// Bytes of a voxel: its key, its sums, its points.
const VOXEL_BYTES: usize = 3 * 4 + 4 * 8 + 4;

impl Voxel {
    pub(super) fn add(&mut self, place_m: &Point3<f64>, intensity: f32) {
        // When it has so many points that one more changes nothing, it is left as it is.
        let Some(points) = self.points.checked_add(1) else { return };
        self.points = points;
        for (sum, value_m) in self.sums.iter_mut().zip(place_m.iter()) {
            *sum = sum.saturating_add((value_m * STEPS_PER_M).round() as i64);
        }
        let bright = if intensity.is_nan() { 0.0 } else { intensity.clamp(-BRIGHTEST, BRIGHTEST) };
        let steps = (f64::from(bright) * STEPS_PER_INTENSITY).round() as i64;
        self.intensity = self.intensity.saturating_add(steps);
    }

    pub(super) fn join(&mut self, other: &Self) {
        self.points = self.points.saturating_add(other.points);
        for (sum, more) in self.sums.iter_mut().zip(other.sums) {
            *sum = sum.saturating_add(more);
        }
        self.intensity = self.intensity.saturating_add(other.intensity);
    }

    pub(super) fn point(&self) -> Option<RoadPoint> {
        let share = (self.points > 0).then(|| f64::from(self.points).recip())?;
        Some(RoadPoint {
            position_m: Point3::from(self.sums.map(|sum| sum as f64 * share / STEPS_PER_M)),
            intensity: (self.intensity as f64 * share / STEPS_PER_INTENSITY) as f32,
            points: self.points,
        })
    }
}

impl Tile {
    /// In the order of the voxels.
    pub(super) fn encoded(&self) -> Vec<u8> {
        let mut voxels: Vec<(&VoxelKey, &Voxel)> = self.voxels.iter().collect();
        voxels.sort_unstable_by_key(|(key, _)| **key);
        let mut bytes = Vec::with_capacity(voxels.len() * VOXEL_BYTES);
        for (key, voxel) in voxels {
            for cell in [key.x, key.y, key.z] {
                bytes.extend(cell.to_le_bytes());
            }
            for sum in voxel.sums.into_iter().chain([voxel.intensity]) {
                bytes.extend(sum.to_le_bytes());
            }
            bytes.extend(voxel.points.to_le_bytes());
        }
        bytes
    }
}

/// The voxels of the parts of a tile.
pub(super) fn decoded(bytes: &[u8]) -> impl Iterator<Item = (VoxelKey, Voxel)> {
    bytes.as_chunks::<VOXEL_BYTES>().0.iter().map(|record| {
        let (cells, rest) = record.as_chunks::<4>();
        debug_assert!(rest.is_empty());
        let word = |index: usize| cells.get(index).copied().unwrap_or_default();
        let cell = |index: usize| i32::from_le_bytes(word(index));
        let sum = |index: usize| {
            let (low, high) = (word(3 + 2 * index), word(4 + 2 * index));
            (i64::from(i32::from_le_bytes(high)) << 32) | i64::from(u32::from_le_bytes(low))
        };
        let key = VoxelKey { x: cell(0), y: cell(1), z: cell(2) };
        let voxel = Voxel {
            sums: [sum(0), sum(1), sum(2)],
            intensity: sum(3),
            points: u32::from_le_bytes(word(11)),
        };
        (key, voxel)
    })
}
