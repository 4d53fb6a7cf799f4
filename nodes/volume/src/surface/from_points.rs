//! A surface out of points with normals, as a map that was saved has them.

use std::collections::BTreeSet;

use geometry::VoxelKey;
use nalgebra::{Point3, Vector3};

use super::Surface;
use super::block::{FULL, SurfaceBlock};
use crate::block::{BlockBox, BlockKey, voxel_index};

/// A point says where the surface is so many edges around it: at the nodes of its own voxel and of those beside.
const REACH_IN_EDGES: f32 = 2.0;
/// The weight of a node in the middle of the plane of its point: that of a depth at 1.7 m, so that what is seen anew counts.
const MOST_WEIGHT: f32 = 64.0;
/// A block counts as one that so many images have shown.
const HITS: usize = 2;

impl Surface {
    /// Joins points of a surface, each with the normal of its plane there, to the blocks within a box; those with a number that
    /// is not finite, or a normal without a direction, are left out. What they give has been seen at no moment: corrections
    /// leave it where it is. A block depends on the points of [`Surface::point_box`] alone. Returns how many nodes there was no
    /// room for.
    pub fn put_points(
        &mut self,
        points: impl IntoIterator<Item = (Point3<f32>, Vector3<f32>)>,
        within: BlockBox,
    ) -> usize {
        let mut refused = 0;
        let mut joined = BTreeSet::new();
        for (point, normal) in points {
            let normal =
                normal.try_normalize(f32::EPSILON).filter(|n| n.iter().all(|x| x.is_finite()));
            if let Some(normal) = normal.filter(|_| geometry::is_finite(&point)) {
                refused += self.put_point(&point, &normal, within, &mut joined);
            }
        }
        joined.into_iter().for_each(|key| self.count_near_of(key));
        refused
    }

    /// The blocks that [`Surface::put_points`] joins a point to.
    #[must_use]
    pub fn point_box(&self, point: &Point3<f32>) -> BlockBox {
        let voxel = self.grid.key(point);
        let beside = |cells: i32| {
            let along = |cell: i32| cell.saturating_add(cells);
            BlockKey::of(VoxelKey { x: along(voxel.x), y: along(voxel.y), z: along(voxel.z) })
        };
        BlockBox { least: beside(-1), most: beside(2) }
    }

    fn put_point(
        &mut self,
        point: &Point3<f32>,
        normal: &Vector3<f32>,
        within: BlockBox,
        joined: &mut BTreeSet<BlockKey>,
    ) -> usize {
        let edge_m = self.config.edge_m;
        let first = self.grid.key(point);
        let (mut refused, mut last) = (0, None);
        for step in 0..64 {
            let along = |axis: i32| (step >> (2 * axis) & 3) - 1;
            let voxel = VoxelKey {
                x: first.x.saturating_add(along(0)),
                y: first.y.saturating_add(along(1)),
                z: first.z.saturating_add(along(2)),
            };
            let key = BlockKey::of(voxel);
            if !within.contains(key) {
                continue;
            }
            let node = Point3::new(voxel.x, voxel.y, voxel.z).map(|cell| f64::from(cell) * edge_m);
            // In edges.
            let from_point = ((node - point.cast::<f64>()) / edge_m).cast::<f32>();
            let before = from_point.dot(normal);
            let aside = (from_point - before * normal).norm();
            let share = 1.0 - (aside / REACH_IN_EDGES).powi(2);
            let distance = before / self.config.truncation_in_edges as f32;
            if share > 0.0 && distance.abs() < 1.0 {
                let weight = (share * MOST_WEIGHT).max(1.0);
                if !self.join_plane(voxel, distance * FULL, weight) {
                    refused += 1;
                } else if last.replace(key) != Some(key) {
                    joined.insert(key);
                }
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
