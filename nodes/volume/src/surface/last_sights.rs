//! How a block was seen last, for a file, and of a map that was loaded: where nothing comes back any more, what has gone since the
//! map was saved goes as what goes within one run (`crate::no_return`).
//!
//! Points say where a surface is, and not from where it came back to the camera, nor for how long it had been there: a file of points alone
//! makes blocks that no direction without a return clears.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, LastSight};
use nalgebra::Point3;

use super::Surface;
use super::block::SurfaceBlock;
use crate::block::BlockKey;
use crate::descent::block_edge_m;
use crate::ticks::TICK_S;

/// A middle is that of a block where it is no farther from it than this, in edges of the block: single precision, 100 m from the origin.
const SAME_MIDDLE_IN_EDGES: f64 = 1e-3;

/// How the blocks that were loaded were seen last. An entry counts as long as no image has shown a surface in its block since then.
#[derive(Clone, Debug, Default)]
pub(super) struct LoadedSights(HashMap<BlockKey, LoadedSight, BuildVoxelHasher>);

/// See [`LoadedSights`].
#[derive(Clone, Copy, Debug)]
pub(super) struct LoadedSight {
    from_m: [f32; 3],
    lasted_s: f32,
    /// The tick of the first image that showed nothing there; 0 before.
    missed_since: u32,
}

/// What a block is judged by where nothing comes back from its direction.
pub(super) struct Sighted {
    /// From where a surface was seen in it last, in the map.
    pub(super) from_m: Point3<f64>,
    /// From the first image that showed one to the last.
    pub(super) lasted_s: f64,
    /// Since the last image that showed one, or, of one that was loaded, the first that showed none: nobody looked in between.
    pub(super) missed_s: f64,
}

impl LoadedSights {
    /// That of a block in which no image has shown a surface since it was loaded.
    fn of(&self, key: BlockKey, block: &SurfaceBlock) -> Option<&LoadedSight> {
        (block.last_hit == 0).then(|| self.0.get(&key)).flatten()
    }

    /// What a block is judged by at a tick.
    pub(super) fn sighted(&self, key: BlockKey, block: &SurfaceBlock, now: u32) -> Sighted {
        let loaded = self.of(key, block);
        let since = |since: u32| f64::from(now.saturating_sub(since)) * TICK_S;
        let missed_since = |loaded: &LoadedSight| match loaded.missed_since {
            0 => 0.0,
            tick => since(tick),
        };
        Sighted {
            from_m: Point3::from(loaded.map_or(block.hit_from_m, |loaded| loaded.from_m)).cast(),
            lasted_s: loaded.map_or_else(|| block.lasted_s(), |loaded| loaded.lasted_s.into()),
            missed_s: loaded.map_or_else(|| block.missed_s(now), missed_since),
        }
    }

    /// An image shows nothing where a block is.
    pub(super) fn miss(&mut self, key: BlockKey, now: u32) {
        if let Some(loaded) = self.0.get_mut(&key).filter(|loaded| loaded.missed_since == 0) {
            loaded.missed_since = now;
        }
    }

    /// A block has gone.
    pub(super) fn forget(&mut self, key: BlockKey) {
        self.0.remove(&key);
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.0.capacity() * size_of::<(BlockKey, LoadedSight)>()
    }
}

impl Surface {
    /// Takes how the blocks of a map that is loaded were seen last; those of other blocks than this surface has, as of another edge, are
    /// left out. No more than [`SurfaceConfig::max_blocks`](super::SurfaceConfig::max_blocks) are kept.
    pub fn take_last_sights(&mut self, sights: impl IntoIterator<Item = LastSight>) {
        let most = self.config.max_blocks;
        for LastSight { middle_m, from_m, lasted_s } in sights {
            if self.loaded.0.len() >= most {
                return;
            }
            if let Some(key) = self.block_with_middle(&middle_m) {
                let loaded = LoadedSight { from_m: from_m.into(), lasted_s, missed_since: 0 };
                self.loaded.0.insert(key, loaded);
            }
        }
    }

    fn block_with_middle(&self, middle_m: &Point3<f32>) -> Option<BlockKey> {
        let edge_m = block_edge_m(self.config.edge_m);
        let in_edges = middle_m.coords.cast::<f64>() / edge_m;
        let key = in_edges.map(f64::floor);
        let is_middle =
            (in_edges - key).iter().all(|&along| (along - 0.5).abs() <= SAME_MIDDLE_IN_EDGES);
        let is_key = key.iter().all(|along| along.abs() < f64::from(i32::MAX));
        // The casts are exact.
        (is_middle && is_key).then(|| BlockKey {
            x: key.x as i32,
            y: key.y as i32,
            z: key.z as i32,
        })
    }

    /// How a block was seen last, of this surface or of another one of the same voxels that has a part of it; `None` where there is no
    /// surface in it, or no image has shown one and no file has said it.
    #[must_use]
    pub fn last_sight(&self, other: Option<&Self>, key: BlockKey) -> Option<LastSight> {
        let block = self.block(key).or_else(|| other?.block(key))?;
        let loaded = self.loaded.of(key, block);
        // One without a surface, as before one, does not come back from a file.
        if block.near_nodes == 0 || (block.last_hit == 0 && loaded.is_none()) {
            return None;
        }
        let middle_m = super::middle_m(key, block_edge_m(self.config.edge_m)).cast();
        Some(LastSight {
            middle_m,
            from_m: loaded.map_or(block.hit_from_m, |loaded| loaded.from_m).into(),
            lasted_s: loaded.map_or(block.lasted_s() as f32, |loaded| loaded.lasted_s),
        })
    }
}
