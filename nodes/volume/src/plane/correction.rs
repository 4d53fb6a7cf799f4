//! The plane after a correction of the map.

use std::collections::BTreeMap;

use geometry::{Stamp, VoxelKey};
use nalgebra::{Isometry3, Point3};

use super::{PlaneBlock, PlaneOccupancy, index_of};
use crate::block::{BLOCK_EDGE, BlockKey};
use crate::cell::Cell;

/// How much came to each block at most from one block of before.
type Heaviest = BTreeMap<BlockKey, u32>;

impl PlaneOccupancy {
    /// Moves each block by the correction of the moment at which it was seen first; see [`geometry::PathCorrection::at`]. A cell
    /// takes the counts of the cell that comes to its middle; what comes there from several blocks is summed. The moment of a
    /// block is then that of the part with most evidence, the earliest of equal ones. Blocks beyond the bound are left out.
    pub fn correct(&mut self, now_from_before: impl Fn(Stamp) -> Isometry3<f64>) {
        let before = std::mem::take(&mut self.layer);
        self.last = None;
        let mut heaviest = Heaviest::new();
        for key in before.sorted_keys() {
            let Some(block) = before.get(key) else { continue };
            let seen = self.ticks.stamp(block.first_seen);
            let motion = seen.map_or_else(Isometry3::identity, &now_from_before);
            if motion == Isometry3::identity() {
                let weight = self.join(key, block);
                self.take_moment(key, block.first_seen, weight, &mut heaviest);
            } else if geometry::check_pose(&motion).is_ok() {
                for (to, weight) in self.join_moved(key, block, &motion) {
                    self.take_moment(to, block.first_seen, weight, &mut heaviest);
                }
            }
        }
    }

    /// Returns how much evidence came.
    fn join(&mut self, key: BlockKey, block: &PlaneBlock) -> u32 {
        let Some(joined) = self.block_seen_at(key, block.first_seen) else { return 0 };
        for (cell, other) in joined.cells.iter_mut().zip(&block.cells) {
            *cell = cell.joined(*other);
        }
        block.cells.iter().map(evidence_of).sum()
    }

    /// Returns how much evidence came, by blocks.
    fn join_moved(
        &mut self,
        key: BlockKey,
        block: &PlaneBlock,
        motion: &Isometry3<f64>,
    ) -> BTreeMap<BlockKey, u32> {
        let mut weights = BTreeMap::new();
        let edge_m = self.config.edge_m;
        let corner = key.voxel(0);
        let size = BLOCK_EDGE as f64;
        let corners = [[0.0, 0.0], [size, 0.0], [0.0, size], [size, size]].map(|[x, y]| {
            let corner_m =
                Point3::new(f64::from(corner.x) + x, f64::from(corner.y) + y, 0.0) * edge_m;
            motion * corner_m / edge_m
        });
        // The casts saturate.
        let range = |axis: usize| {
            let along = corners.map(|corner| corner[axis]);
            let least = along.into_iter().fold(f64::INFINITY, f64::min).floor() as i32;
            let most = along.into_iter().fold(f64::NEG_INFINITY, f64::max).ceil() as i32;
            least..most
        };
        let before_from_now = motion.inverse();
        // Where the motion takes the plane up or down, a place is found straight below.
        let [least_m, ..] = corners.map(|corner| corner * edge_m);
        let height_m = least_m.z;
        for y in range(1) {
            for x in range(0) {
                let middle_m = Point3::new(
                    (f64::from(x) + 0.5) * edge_m,
                    (f64::from(y) + 0.5) * edge_m,
                    height_m,
                );
                let from = before_from_now * middle_m;
                let Some(source) = self.cell_of(&from.xy()) else { continue };
                let source_key = BlockKey::of(VoxelKey { x: source[0], y: source[1], z: 0 });
                let Some(other) = block.cells.get(index_of(source)) else { continue };
                if source_key != key || (other.hits(), other.passes()) == (0, 0) {
                    continue;
                }
                let target = [x, y];
                let target_key = BlockKey::of(VoxelKey { x, y, z: 0 });
                if let Some(joined) = self.block_seen_at(target_key, block.first_seen)
                    && let Some(cell) = joined.cells.get_mut(index_of(target))
                {
                    *cell = cell.joined(*other);
                    *weights.entry(target_key).or_default() += evidence_of(other);
                }
            }
        }
        weights
    }

    fn take_moment(&mut self, key: BlockKey, first_seen: u32, weight: u32, most: &mut Heaviest) {
        let Some(block) = self.layer.slot(key).and_then(|slot| self.layer.at_mut(slot)) else {
            return;
        };
        let most = most.entry(key).or_default();
        if (weight, block.first_seen) > (*most, first_seen) {
            (block.first_seen, *most) = (first_seen, weight);
        }
    }

    /// The block of a key; a new one is seen first at a moment.
    fn block_seen_at(&mut self, key: BlockKey, first_seen: u32) -> Option<&mut PlaneBlock> {
        let now = std::mem::replace(&mut self.now, first_seen);
        let is_there = self.block_or_new(key).is_some();
        self.now = now;
        let slot = self.layer.slot(key).filter(|_| is_there)?;
        self.layer.at_mut(slot).map(|block| &mut **block)
    }
}

fn evidence_of(cell: &Cell) -> u32 {
    u32::from(cell.hits()) + u32::from(cell.passes())
}
