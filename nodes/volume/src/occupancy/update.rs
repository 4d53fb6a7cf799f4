//! Update of the evidence by an image.

use geometry::VoxelKey;
use nalgebra::{Point3, Vector3};

use super::block::{Bits, OccupancyBlock};
use super::{Occupancy, OccupancyUpdate};
use crate::block::{BLOCK_EDGE, BlockKey, voxel_index};
use crate::depth_view::{DepthView, with_projection};
use crate::descent::{Behind, Descent, Judge, Margins, Verdict, block_edge_m};
use crate::projection::{LANES, Project};

/// Space is free if it is nearer than all depths by this many edges: a margin for the noise of depth and of poses, and for the
/// surface's own voxels.
const FREE_BEFORE_IN_EDGES: f64 = 1.0;
/// One in this many blocks is dropped when there is no room, so that dropping is rare.
const DROPPED_SHARE: usize = 4;

impl Occupancy {
    /// Adds a cycle: the voxels of its static points in reach of the camera, each point the mean of a voxel's depths, and the image that
    /// they were computed from. An empty view marks nothing as free.
    pub fn integrate(
        &mut self,
        view: &DepthView,
        hits: impl IntoIterator<Item = VoxelKey>,
    ) -> OccupancyUpdate {
        let mut update = OccupancyUpdate::default();
        self.image = self.image.wrapping_add(1);
        self.hit(hits, &mut update);
        if !view.is_empty() {
            with_projection!(view.kind, projection => self.pass(view, projection, &mut update));
        }
        update
    }

    fn hit(&mut self, hits: impl IntoIterator<Item = VoxelKey>, update: &mut OccupancyUpdate) {
        let (image, now) = (self.image, self.now);
        for voxel in hits {
            let slot = self.slot_or_new(BlockKey::of(voxel), update);
            if let Some(block) = slot.and_then(|slot| self.layer.at_mut(slot)) {
                block.hit(voxel_index(voxel), image, now);
            }
        }
    }

    fn pass<P: Project>(&mut self, view: &DepthView, projection: P, update: &mut OccupancyUpdate) {
        let edge_m = self.config.edge_m;
        let margins = Margins {
            before_m: (FREE_BEFORE_IN_EDGES * edge_m) as f32,
            behind: Behind::default(),
            reach_m: self.config.reach_m as f32,
        };
        let judge = Judge::new(view, projection, margins, 0.0);
        let most = self.config.max_blocks_per_image;
        let descent = Descent {
            judge: &judge,
            block_edge_m: block_edge_m(edge_m),
            most_judged: most.saturating_mul(4),
        };
        let (image, now) = (self.image, self.now);
        let is_whole_view = descent.run(|least, level, verdict| {
            if verdict == Verdict::Blank {
                return;
            }
            if verdict == Verdict::Mixed {
                update.seen_blocks += 1;
                if update.seen_blocks <= most {
                    self.pass_some(least, &judge, update);
                }
                return;
            }
            let edge = 1_i32 << level;
            for index in 0..edge.saturating_mul(edge).saturating_mul(edge) {
                update.seen_blocks += 1;
                if update.seen_blocks > most {
                    return;
                }
                let key = least.offset(index % edge, index / edge % edge, index / (edge * edge));
                let slot = self.slot_or_new(key, update);
                if let Some(block) = slot.and_then(|slot| self.layer.at_mut(slot)) {
                    block.pass_all(image, now);
                }
            }
        });
        update.is_incomplete |= !is_whole_view || update.seen_blocks > most;
        update.seen_blocks = update.seen_blocks.min(most);
    }

    fn pass_some<P: Project>(
        &mut self,
        key: BlockKey,
        judge: &Judge<'_, P>,
        update: &mut OccupancyUpdate,
    ) {
        let mut free = Bits::default();
        self.find_free(key, judge, [0; 3], BLOCK_EDGE, &mut free);
        if free == Bits::default() {
            return;
        }
        let (image, now) = (self.image, self.now);
        let slot = self.slot_or_new(key, update);
        if let Some(block) = slot.and_then(|slot| self.layer.at_mut(slot)) {
            block.pass(&free, image, now);
        }
    }

    /// Sets the bits of the voxels that are free, within a mixed cube of a block.
    fn find_free<P: Project>(
        &self,
        key: BlockKey,
        judge: &Judge<'_, P>,
        least: [usize; 3],
        voxels: usize,
        free: &mut Bits,
    ) {
        let half = voxels / 2;
        if half == 0 {
            return;
        }
        let edge_m = self.config.edge_m;
        let block_m = Vector3::from(key.coordinates()).map(f64::from) * block_edge_m(edge_m);
        let eighths: [[usize; 3]; LANES] = std::array::from_fn(|eighth| {
            [0, 1, 2].map(|axis: usize| least[axis] + half * (eighth >> axis & 1))
        });
        let middles_m = eighths.map(|least| {
            let middle = Vector3::from(least).map(|along| along as f64 + 0.5 * half as f64);
            Point3::from(block_m + middle * edge_m)
        });
        let verdicts = judge.judge_all(&middles_m, (half as f64 * edge_m) as f32);
        for (least, verdict) in eighths.into_iter().zip(verdicts) {
            match verdict {
                Verdict::Unseen | Verdict::Blank | Verdict::Hidden => {}
                Verdict::Mixed => self.find_free(key, judge, least, half, free),
                Verdict::Free => {
                    for index in 0..half * half * half {
                        let [x, y, z] = [index % half, index / half % half, index / (half * half)];
                        let [x, y, z] = [least[0] + x, least[1] + y, least[2] + z];
                        let index = (z * BLOCK_EDGE + y) * BLOCK_EDGE + x;
                        free[index / 64] |= 1 << (index % 64);
                    }
                }
            }
        }
    }

    pub(super) fn slot_or_new(
        &mut self,
        key: BlockKey,
        update: &mut OccupancyUpdate,
    ) -> Option<crate::layer::Slot> {
        if let Some(slot) = self.layer.slot(key) {
            return Some(slot);
        }
        if self.layer.len() >= self.config.max_blocks && !self.drop_oldest(update) {
            update.is_incomplete = true;
            return None;
        }
        self.layer.insert(key, OccupancyBlock::default());
        self.layer.slot(key)
    }

    /// Drops the blocks that were not seen for the longest time, but none in the view of this image. Returns whether there is room.
    fn drop_oldest(&mut self, update: &mut OccupancyUpdate) -> bool {
        if update.is_incomplete {
            return false;
        }
        let others = self.layer.unordered().filter(|(_, block)| block.seen_by != self.image);
        let mut others: Vec<(u32, BlockKey)> =
            others.map(|(key, block)| (block.seen_by, key)).collect();
        others.sort_unstable();
        others.truncate((self.config.max_blocks / DROPPED_SHARE).max(1));
        for (_, key) in &others {
            self.layer.remove(*key);
        }
        update.dropped_blocks += others.len();
        !others.is_empty()
    }
}
