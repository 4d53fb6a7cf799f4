//! A surface out of points with normals, as a map that was saved has them.

use geometry::VoxelKey;
use nalgebra::{Point3, Vector3};

use super::Surface;
use super::block::{FULL, SurfaceBlock};
use crate::block::{BlockKey, voxel_index};

/// A point says so many edges around it where the surface is: the nodes of its own voxel and of those beside.
const REACH_IN_EDGES: f32 = 2.0;
/// The weight of a node in the middle of the plane of its point: that of a depth at 1.7 m, so that what is seen anew counts.
const MOST_WEIGHT: f32 = 64.0;
/// A block counts as one that so many images have shown.
const HITS: usize = 2;

impl Surface {
    /// Joins points of a surface, each with the normal of its plane there; those with a number that is not finite, or a normal
    /// without a direction, are left out. What they give has been seen at no moment: corrections leave it where it is. Returns
    /// how many blocks there was no room for.
    pub fn put_points(
        &mut self,
        points: impl IntoIterator<Item = (Point3<f32>, Vector3<f32>)>,
    ) -> usize {
        let mut refused = 0;
        for (point, normal) in points {
            let normal =
                normal.try_normalize(f32::EPSILON).filter(|n| n.iter().all(|x| x.is_finite()));
            if let Some(normal) = normal.filter(|_| geometry::is_finite(&point)) {
                refused += self.put_point(&point, &normal);
            }
        }
        for key in self.block_keys() {
            if let Some(mut block) = self.layer.get_mut(key).and_then(Option::take) {
                self.count_near(&mut block);
                self.layer.insert(key, Some(block));
            }
        }
        refused
    }

    fn put_point(&mut self, point: &Point3<f32>, normal: &Vector3<f32>) -> usize {
        let edge_m = self.config.edge_m;
        let first = self.grid.key(point);
        let mut refused = 0;
        for step in 0..64 {
            let along = |axis: i32| (step >> (2 * axis) & 3) - 1;
            let voxel = VoxelKey {
                x: first.x.saturating_add(along(0)),
                y: first.y.saturating_add(along(1)),
                z: first.z.saturating_add(along(2)),
            };
            let node = Point3::new(voxel.x, voxel.y, voxel.z).map(|cell| f64::from(cell) * edge_m);
            // In edges.
            let from_point = ((node - point.cast::<f64>()) / edge_m).cast::<f32>();
            let before = from_point.dot(normal);
            let aside = (from_point - before * normal).norm();
            let share = 1.0 - (aside / REACH_IN_EDGES).powi(2);
            let distance = before / self.config.truncation_in_edges as f32;
            if share > 0.0 && distance.abs() < 1.0 {
                let weight = (share * MOST_WEIGHT).max(1.0);
                refused += usize::from(!self.join_plane(voxel, distance * FULL, weight));
            }
        }
        refused
    }

    /// Returns whether there was room.
    fn join_plane(&mut self, voxel: VoxelKey, distance: f32, weight: f32) -> bool {
        let key = BlockKey::of(voxel);
        if self.layer.get(key).is_none() {
            if self.layer.len() >= self.config.max_blocks {
                return false;
            }
            let mut block = Box::new(SurfaceBlock::default());
            (0..HITS).for_each(|_| block.evidence.hit());
            // From no farther away than this was it seen: nothing that comes back from there says that it has gone.
            let edge_m = super::block_edge_m(self.config.edge_m);
            block.hit_from_m = super::middle_m(key, edge_m).cast::<f32>().into();
            self.layer.insert(key, Some(block));
        }
        if let Some(block) = self.layer.get_mut(key).and_then(Option::as_mut) {
            let index = voxel_index(voxel);
            let known = f32::from(block.weight[index]);
            let mean =
                (f32::from(block.distance[index]) * known + distance * weight) / (known + weight);
            block.distance[index] = mean.round() as i16;
            block.weight[index] = (known + weight).min(MOST_WEIGHT) as u16;
        }
        true
    }
}
