//! Places whose content is known by now to have moved, though no image shows it.

use std::collections::{BTreeSet, HashSet};

use nalgebra::Point3;

use super::Surface;
use super::block::SurfaceBlock;
use crate::block::{BLOCK_EDGE, BLOCK_VOXELS, BlockBox, BlockKey};

impl Surface {
    /// Sets what is within `reach_m` of a place along each axis to unknown, for each place: as if no image had shown it. After an
    /// image, before what it changed is followed: the blocks are among [`Surface::changed`] or [`Surface::removed`] then. Blocks
    /// that are not in memory stay as they are. Returns how many were removed.
    pub fn forget_around(&mut self, places_m: &[Point3<f32>], reach_m: f64) -> usize {
        let (mut touched, mut found) = (BTreeSet::new(), Vec::new());
        for place_m in places_m {
            let Some([least, most]) = self.nodes_around(place_m, reach_m) else { continue };
            let block = |node: [i32; 3]| node.map(|along| along.div_euclid(BLOCK_EDGE as i32));
            let blocks = BlockBox { least: block(least).into(), most: block(most).into() };
            found.clear();
            self.layer.for_each_in(blocks, |key, slot| found.push((key, slot)));
            for &(key, slot) in &found {
                let Some(block) = self.layer.at_mut(slot).and_then(Option::as_mut) else {
                    continue;
                };
                if forget_nodes(key, block, [least, most]) {
                    touched.insert(key);
                }
            }
        }
        let removed = self.removed.len();
        self.settle(touched);
        self.removed.len() - removed
    }

    /// The first and the last node within reach of a place; where a cell is larger than the reach, the corners of the cell of the
    /// place. `None` of a place that is none.
    fn nodes_around(&self, place_m: &Point3<f32>, reach_m: f64) -> Option<[[i32; 3]; 2]> {
        /// No node has a coordinate as large as this: blocks beside it have their own.
        const MOST: f64 = (i32::MAX / 2) as f64;
        let mut ends = [[0; 3]; 2];
        for axis in 0..3 {
            let along = f64::from(place_m[axis]) / self.config.edge_m;
            let reach = reach_m / self.config.edge_m;
            // A coordinate that is not a number is in no range.
            if !(-MOST..MOST).contains(&along) || !(0.0..MOST).contains(&reach) {
                return None;
            }
            let (least, most) = ((along - reach).ceil(), (along + reach).floor());
            ends[0][axis] = least.min(along.floor()) as i32;
            ends[1][axis] = most.max(along.floor() + 1.0) as i32;
        }
        Some(ends)
    }

    /// Counts blocks that have lost nodes anew, and removes those that have no surface any more.
    fn settle(&mut self, touched: BTreeSet<BlockKey>) {
        let changed: HashSet<BlockKey> = self.changed.iter().copied().collect();
        let mut gone = HashSet::new();
        for key in touched {
            self.count_near_of(key);
            if !self.block(key).is_some_and(SurfaceBlock::has_surface) {
                gone.insert(key);
                self.remove(key, &mut super::SurfaceUpdate::default());
            } else if !changed.contains(&key) {
                self.changed.push(key);
            }
        }
        self.changed.retain(|changed| !gone.contains(changed));
    }
}

/// Sets the nodes between two, these included, to unknown. Returns whether something was known of one.
fn forget_nodes(key: BlockKey, block: &mut SurfaceBlock, [least, most]: [[i32; 3]; 2]) -> bool {
    let mut was_known = false;
    for index in 0..BLOCK_VOXELS {
        let node = key.voxel(index);
        let node = [node.x, node.y, node.z];
        if (0..3).any(|axis| node[axis] < least[axis] || node[axis] > most[axis]) {
            continue;
        }
        was_known |= block.weight[index] != 0;
        (block.distance[index], block.weight[index]) = (0, 0);
        if let Some(colour) = &mut block.colour {
            colour[index] = geometry::NO_COLOUR;
        }
    }
    was_known
}
