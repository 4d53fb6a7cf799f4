//! How an image is joined to the evidence.

use geometry::VoxelKey;
use nalgebra::{Matrix3, Point3, Vector3};

use super::block::{Bits, OccupancyBlock};
use super::{Occupancy, OccupancyUpdate};
use crate::block::{BLOCK_EDGE, BlockKey, voxel_index};
use crate::depth_view::{DepthView, with_projection};
use crate::descent::{Descent, Judge, Margins, Verdict, block_edge_m};
use crate::projection::Project;

/// What is nearer than all that is seen by so many edges is free: the noise of depth and of poses, and the surface's own
/// voxels.
const FREE_BEFORE_IN_EDGES: f64 = 1.0;
/// A voxel at the end of the reach has so many of the pixels that are looked at along each axis.
const PIXELS_A_VOXEL: f64 = 2.0;
/// More pixels are not passed over.
const MOST_STEP: usize = 4;
/// The share of the blocks that is dropped when there is no room, so that dropping is rare.
const DROPPED_SHARE: usize = 4;

/// Calls `visit` with each `step`-th pixel of each `step`-th row that shows something static or moving: its index, its depth,
/// negative where it moves, and its point in the camera's frame.
pub(super) fn for_each_depth<P: Project>(
    view: &DepthView,
    projection: &P,
    step: usize,
    mut visit: impl FnMut(usize, f32, Point3<f32>),
) {
    let (width_px, height_px) = view.levels.size();
    let depths_m = view.levels.finest();
    for row in (0..height_px).step_by(step.max(1)) {
        for column in (0..width_px).step_by(step.max(1)) {
            let pixel = row * width_px + column;
            let depth_m = depths_m.get(pixel).copied().unwrap_or(0.0);
            if depth_m != 0.0 {
                let point_m = projection.point_m(column, row, depth_m.abs());
                visit(pixel, depth_m, point_m.into());
            }
        }
    }
}

/// Takes points of the camera's frame to voxels: twelve products, in place of a quaternion's and three divisions.
pub(super) struct ToVoxels {
    rotation: Matrix3<f64>,
    origin: Vector3<f64>,
    edge_m: f64,
}

impl ToVoxels {
    pub(super) fn of(view: &DepthView, edge_m: f64) -> Self {
        let rotation = view.map_from_camera.rotation.to_rotation_matrix().into_inner() / edge_m;
        Self { rotation, origin: view.map_from_camera.translation.vector / edge_m, edge_m }
    }

    #[inline]
    fn in_edges(&self, point_m: &Point3<f32>) -> Vector3<f64> {
        self.rotation * point_m.coords.cast::<f64>() + self.origin
    }

    #[inline]
    pub(super) fn voxel(&self, point_m: &Point3<f32>) -> VoxelKey {
        let along = self.in_edges(point_m).map(|along| {
            // `floor` without the call that some targets make of it. The cast saturates, and takes NaN to 0.
            let toward_zero = along as i32;
            toward_zero.saturating_sub(i32::from(along < f64::from(toward_zero)))
        });
        VoxelKey { x: along.x, y: along.y, z: along.z }
    }

    pub(super) fn in_map_m(&self, point_m: &Point3<f32>) -> Point3<f64> {
        (self.in_edges(point_m) * self.edge_m).into()
    }
}

impl Occupancy {
    /// Joins an image. An empty view changes nothing.
    pub fn integrate(&mut self, view: &DepthView) -> OccupancyUpdate {
        let mut update = OccupancyUpdate::default();
        if view.is_empty() {
            return update;
        }
        self.now = self.ticks.at(view.stamp);
        self.image = self.image.wrapping_add(1);
        with_projection!(view.kind, projection => {
            self.hit(view, &projection, &mut update);
            self.pass(view, projection, &mut update);
        });
        update
    }

    fn hit<P: Project>(&mut self, view: &DepthView, projection: &P, update: &mut OccupancyUpdate) {
        let (image, now) = (self.image, self.now);
        let step = self.pixel_step(view);
        let reach_m = self.config.reach_m as f32;
        let to_voxels = ToVoxels::of(view, self.config.edge_m);
        let mut blocks: Vec<BlockKey> = Vec::new();
        let mut last = None;
        for_each_depth(view, projection, step, |_, depth_m, point_m| {
            if depth_m < 0.0 || depth_m > reach_m {
                return;
            }
            let voxel = to_voxels.voxel(&point_m);
            let key = BlockKey::of(voxel);
            let slot = match last {
                Some((last_key, slot)) if last_key == key => slot,
                _ => self.slot_or_new(key, update),
            };
            last = Some((key, slot));
            let Some(block) = slot.and_then(|slot| self.layer.at_mut(slot)) else { return };
            if block.seen_by != image {
                block.seen_by = image;
                blocks.push(key);
            }
            block.mark_hit(voxel_index(voxel), image);
        });
        for key in blocks {
            if let Some(block) = self.layer.get_mut(key) {
                block.join_hits(image, now);
            }
        }
    }

    /// So many pixels may be passed over that a voxel at the end of the reach is not.
    pub(super) fn pixel_step(&self, view: &DepthView) -> usize {
        let pixel_m = f64::from(view.pixel_slope()) * self.config.reach_m;
        // The cast saturates.
        ((self.config.edge_m / (PIXELS_A_VOXEL * pixel_m)) as usize).clamp(1, MOST_STEP)
    }

    fn pass<P: Project>(&mut self, view: &DepthView, projection: P, update: &mut OccupancyUpdate) {
        let edge_m = self.config.edge_m;
        let margins = Margins {
            before_m: (FREE_BEFORE_IN_EDGES * edge_m) as f32,
            behind_m: 0.0,
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
        for eighth in 0..8 {
            let least = [0, 1, 2].map(|axis: usize| least[axis] + half * (eighth >> axis & 1));
            let middle = Vector3::from(least).map(|along| along as f64 + 0.5 * half as f64);
            let middle_m = Point3::from(block_m + middle * edge_m);
            match judge.judge(&middle_m, (half as f64 * edge_m) as f32) {
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

    fn slot_or_new(
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

    /// Drops the blocks that were seen longest ago, but none that this image saw. Returns whether there is room.
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
