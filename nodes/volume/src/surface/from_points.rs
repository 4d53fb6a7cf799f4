//! A surface out of points with normals, as a map that was saved has them.

use std::collections::BTreeSet;

use geometry::{NO_COLOUR, VoxelKey};
use nalgebra::{Point3, Vector3};

use super::Surface;
use super::block::{FULL, SurfaceBlock};
use super::node_box::NodeBox;
use crate::block::{BLOCK_VOXELS, BlockBox, BlockKey, voxel_index};

/// Points that are no farther apart than this are one in each voxel of the surface, as a map of this edge has them. Each says
/// where the surface is at the corners of its own voxel and nowhere else: otherwise each reload would add a rim to the map.
const ONE_A_VOXEL_IN_EDGES: f64 = 1.2;
/// Points that are farther apart say where the surface is so many edges around them at least: also in the voxels beside theirs.
const LEAST_REACH_IN_EDGES: f64 = 2.0;
/// Farther apart points are not joined: it bounds what a point costs.
const MOST_REACH_IN_EDGES: f64 = 16.0;
/// Before and behind its plane it says so many edges far: nodes on both sides of each cell that the plane crosses.
const THICKNESS_IN_EDGES: f64 = 2.0;
/// A point that is so near to a face of its voxel, in edges, counts as so far from it: more than a step of the distances.
const INSIDE: f64 = 1e-3;
/// The weight of a node in the middle of the plane of its point: that of a depth at 1.7 m, so that what is seen anew counts.
const MOST_WEIGHT: f32 = 64.0;
/// A block counts as one that so many images have shown.
const HITS: usize = 2;

impl Surface {
    /// Joins points of a surface, each with the normal of its plane there, to the blocks within a box; those with a number that
    /// is not finite, or a normal without a direction, are left out. A point says where the surface is up to `reach_m` around it,
    /// in bounds: as far as the points are apart, they join to a surface without gaps. Where that is no farther than the voxels are
    /// wide, it says so of its own voxel alone: the points of a surface give that surface again. What they give has been seen at no moment:
    /// corrections leave it where it is. A block depends on the points of [`Surface::point_box`] alone. Returns for how many
    /// blocks there was no room.
    pub fn put_points(
        &mut self,
        points: impl IntoIterator<Item = (Point3<f32>, Vector3<f32>)>,
        reach_m: f64,
        within: BlockBox,
    ) -> usize {
        let points = points.into_iter().map(|(point, normal)| (point, normal, NO_COLOUR));
        self.put_coloured_points(points, reach_m, within)
    }

    /// The same with a colour for each point: red, green, blue, or [`geometry::NO_COLOUR`].
    pub fn put_coloured_points(
        &mut self,
        points: impl IntoIterator<Item = (Point3<f32>, Vector3<f32>, [u8; 3])>,
        reach_m: f64,
        within: BlockBox,
    ) -> usize {
        let reach = self.reach(reach_m);
        let (mut joined, mut refused) = (BTreeSet::new(), BTreeSet::new());
        for (point, normal, colour) in points {
            let normal =
                normal.try_normalize(f32::EPSILON).filter(|n| n.iter().all(|x| x.is_finite()));
            if let Some(normal) = normal.filter(|_| geometry::is_finite(&point)) {
                let plane =
                    Plane { colour, ..Plane::of(&point, normal, reach, self.config.edge_m) };
                self.put_plane(&plane, within, (&mut joined, &mut refused));
            }
        }
        joined.into_iter().for_each(|key| self.count_near_of(key));
        refused.len()
    }

    /// The blocks that [`Surface::put_points`] joins a point to.
    #[must_use]
    pub fn point_box(&self, point: &Point3<f32>, reach_m: f64) -> BlockBox {
        let in_edges = point.coords.cast::<f64>() / self.config.edge_m;
        let nodes = match self.reach(reach_m) {
            Reach::OwnVoxel => NodeBox::of_voxel(&in_edges),
            Reach::Around { in_edges: reach } => {
                NodeBox::around(&in_edges, &Vector3::repeat(reach.hypot(THICKNESS_IN_EDGES)))
            }
        };
        nodes.blocks()
    }

    fn reach(&self, reach_m: f64) -> Reach {
        let in_edges = reach_m / self.config.edge_m;
        if in_edges <= ONE_A_VOXEL_IN_EDGES {
            Reach::OwnVoxel
        } else {
            Reach::Around { in_edges: in_edges.clamp(LEAST_REACH_IN_EDGES, MOST_REACH_IN_EDGES) }
        }
    }

    fn put_plane(
        &mut self,
        plane: &Plane,
        within: BlockBox,
        (joined, refused): (&mut BTreeSet<BlockKey>, &mut BTreeSet<BlockKey>),
    ) {
        for key in plane.nodes.blocks().intersection(&within).keys() {
            match self.join_plane(key, plane) {
                Joined::Nothing => {}
                Joined::Nodes => drop(joined.insert(key)),
                Joined::NoRoom => drop(refused.insert(key)),
            }
        }
    }

    fn join_plane(&mut self, key: BlockKey, plane: &Plane) -> Joined {
        let truncation = self.config.truncation_in_edges as f32;
        let mut is_joined = false;
        for node in plane.nodes.of_block(key) {
            let Some((before, share)) = plane.at(node) else { continue };
            let distance = before / truncation;
            if distance.abs() >= 1.0 {
                continue;
            }
            if !is_joined && !self.has_or_adds(key) {
                return Joined::NoRoom;
            }
            is_joined = true;
            if let Some(block) = self.layer.get_mut(key).and_then(Option::as_mut) {
                let index = voxel_index(node);
                let weight = (share * MOST_WEIGHT).max(1.0);
                let known = f32::from(block.weight[index]);
                let mean = (f32::from(block.distance[index]) * known + distance * FULL * weight)
                    / (known + weight);
                block.distance[index] = mean.round() as i16;
                block.weight[index] = (known + weight).min(MOST_WEIGHT) as u16;
                if plane.colour != NO_COLOUR {
                    let kept =
                        block.colour.get_or_insert_with(|| Box::new([NO_COLOUR; BLOCK_VOXELS]));
                    join_colour(&mut kept[index], plane.colour, weight / (known + weight));
                }
            }
        }
        if is_joined { Joined::Nodes } else { Joined::Nothing }
    }

    /// Returns whether there was room.
    fn has_or_adds(&mut self, key: BlockKey) -> bool {
        if self.layer.get(key).is_some() {
            return true;
        }
        if self.layer.len() >= self.config.max_blocks {
            return false;
        }
        let mut block = Box::new(SurfaceBlock::default());
        (0..HITS).for_each(|_| block.evidence.hit());
        // From no farther away than this was it seen: nothing that comes back from there says that it has gone.
        let edge_m = super::block_edge_m(self.config.edge_m);
        block.hit_from_m = super::middle_m(key, edge_m).cast::<f32>().into();
        self.layer.insert(key, Some(block));
        true
    }
}

/// Joins a share of a colour to the mean.
fn join_colour(kept: &mut [u8; 3], colour: [u8; 3], share: f32) {
    let share = if *kept == NO_COLOUR { 1.0 } else { share };
    for (kept, new) in kept.iter_mut().zip(colour) {
        let mean = f32::from(*kept) + (f32::from(new) - f32::from(*kept)) * share;
        *kept = mean.round() as u8;
    }
}

enum Joined {
    Nothing,
    Nodes,
    NoRoom,
}

/// Of which nodes a point says where the surface is.
#[derive(Clone, Copy)]
enum Reach {
    /// The corners of its voxel.
    OwnVoxel,
    /// Those so far around it along its plane, and some before and behind.
    Around {
        /// How far.
        in_edges: f64,
    },
}

/// The part of the plane of a point that it is known by; lengths in edges.
struct Plane {
    point: Vector3<f64>,
    normal: Vector3<f32>,
    reach: f32,
    nodes: NodeBox,
    colour: [u8; 3],
}

impl Plane {
    fn of(point: &Point3<f32>, normal: Vector3<f32>, reach: Reach, edge_m: f64) -> Self {
        let reach = match reach {
            Reach::OwnVoxel => {
                let point = point.coords.cast::<f64>() / edge_m;
                let nodes = NodeBox::of_voxel(&point);
                // A plane through its corners would not cross the voxel.
                let point = point.map(|along| {
                    let cell = along.floor();
                    along.clamp(cell + INSIDE, cell + 1.0 - INSIDE)
                });
                let reach = LEAST_REACH_IN_EDGES as f32;
                return Self { point, normal, reach, nodes, colour: NO_COLOUR };
            }
            Reach::Around { in_edges } => in_edges,
        };
        // No wider than a box around the point: an oblique plane would reach farther, beyond the border of what was there.
        let most = reach.max(THICKNESS_IN_EDGES);
        let half = normal.cast::<f64>().map(|along| {
            let aside = reach * (1.0 - along * along).max(0.0).sqrt();
            (aside + THICKNESS_IN_EDGES * along.abs()).min(most)
        });
        let point = point.coords.cast::<f64>() / edge_m;
        let nodes = NodeBox::around(&point, &half);
        Self { point, normal, reach: reach as f32, nodes, colour: NO_COLOUR }
    }

    /// How far a node is before the plane, and how much it counts there; `None` where the point says nothing of it.
    fn at(&self, node: VoxelKey) -> Option<(f32, f32)> {
        let node = Vector3::new(node.x, node.y, node.z).cast::<f64>();
        let from_point = (node - self.point).cast::<f32>();
        let before = from_point.dot(&self.normal);
        let aside = (from_point - before * self.normal).norm();
        let share = 1.0 - (aside / self.reach).powi(2);
        (share > 0.0 && before.abs() <= THICKNESS_IN_EDGES as f32).then_some((before, share))
    }
}
