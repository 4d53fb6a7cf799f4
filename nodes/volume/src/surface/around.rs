//! What the nodes of a block and of those around it say of a place.
//!
//! Between eight known nodes it is interpolated with their gradients, exact to the second order: linear interpolation would smooth
//! edges away by some 20 corrections. At the border of what is known nodes that are not known are as the gradients of those
//! beside them say, so that a plane stays a plane. Along a surface as much is known as before: what is next to a known node. Across
//! it, it is a node more where the surface passes there: otherwise each correction would take one.

use std::ops::Range;

use geometry::VoxelKey;
use nalgebra::{Isometry3, Point3, Vector3};

use super::block::{FULL, SurfaceBlock};
use crate::block::{BLOCK_EDGE, BlockKey, voxel_index};

/// So many edges beside it along the surface a node says something, as it does where nothing moves.
const REACH_ALONG_IN_EDGES: f64 = 0.5;
const EDGE: i32 = BLOCK_EDGE as i32;
/// The block itself among those around it.
const ITSELF: usize = 13;
/// Nodes before a block's first that count: the corners of a cell before it, and the ones beside these.
const BEFORE: i32 = 2;
/// Nodes along an axis that count.
const NODES: usize = BLOCK_EDGE + 5;
/// How far apart the positions of nodes are that are next to each other along x, y and z.
const AXES: [usize; 3] = [1, NODES, NODES * NODES];
/// How far behind the position of a cell's first corner those of its corners are.
const CORNERS: [usize; 8] = {
    let [x, y, z] = AXES;
    [0, x, y, x + y, z, z + x, z + y, z + x + y]
};

/// What is known at a place.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Node {
    /// In 32767ths of the truncation.
    pub(super) distance: f64,
    pub(super) weight: f64,
    pub(super) colour: [u8; 3],
}

/// A known corner of a cell. All its numbers are whole or halves, which 32 bits hold.
#[derive(Clone, Copy)]
struct Corner {
    distance: f32,
    weight: f32,
    colour: [u8; 3],
    /// How the distance rises, in an edge along each axis.
    rise: Vector3<f32>,
}

/// A block and those around it.
pub(super) struct Around<'a> {
    /// By their steps along x, y and z, each with what takes it back to where it was.
    blocks: [Option<(&'a SurfaceBlock, Isometry3<f64>)>; 27],
    /// Whether all of them move alike.
    is_rigid: bool,
    /// x runs fastest, then y, then z.
    nodes: Vec<Option<Corner>>,
    first: Vector3<f64>,
    edge_m: f64,
}

impl<'a> Around<'a> {
    /// `block_at` has the blocks that are there, with how they move.
    pub(super) fn of(
        key: BlockKey,
        edge_m: f64,
        block_at: impl Fn(BlockKey) -> Option<(&'a SurfaceBlock, Isometry3<f64>)>,
    ) -> Self {
        let blocks = std::array::from_fn(|index| {
            let [x, y, z] = step_of(index);
            let (block, motion) = block_at(key.offset(x, y, z))?;
            Some((block, motion.inverse()))
        });
        let motions = || blocks.iter().flatten().map(|(_, motion)| motion);
        let is_rigid = motions().zip(motions().skip(1)).all(|(one, next)| one == next);
        let first =
            Vector3::from(key.coordinates()).map(|along| f64::from(along) * f64::from(EDGE));
        let nodes = vec![None; NODES.pow(3)];
        let mut around = Self { blocks, is_rigid, nodes, first, edge_m };
        around.read();
        around.find_rises();
        around
    }

    /// What the block says of a place of the map as it is after the motions; `None` where another block does, or none.
    pub(super) fn at(&self, now_m: &Point3<f64>) -> Option<Node> {
        let place = self.place_before(ITSELF, now_m)?;
        let cell = place.map(f64::floor);
        if cell.min() < -1.0 || cell.max() > f64::from(EDGE) {
            return None;
        }
        let within = place - cell;
        let cell = cell.map(|along| along as i32);
        let is_inside = index_of(&cell) == Some(ITSELF);
        if !is_inside && self.is_of_another(&cell, now_m) {
            return None;
        }
        let corners = self.corners(&cell);
        let node = between(&corners, &within)?;
        if is_inside && corners.iter().all(Option::is_some) {
            return Some(node);
        }
        let nearest = cell + nearest_of(&corners, &within, node.distance)?;
        (is_inside || index_of(&nearest) == Some(ITSELF)).then_some(node)
    }

    /// What is known of the corners of a cell.
    fn corners(&self, cell: &Vector3<i32>) -> [Option<&Corner>; 8] {
        let first = position_of(cell);
        let mut corners = [None; 8];
        for (corner, beside) in corners.iter_mut().zip(CORNERS) {
            *corner = self.nodes.get(first + beside).and_then(Option::as_ref);
        }
        corners
    }

    /// Where a place was, in edges from the first node of the block itself, by the motion of one of those around it.
    fn place_before(&self, index: usize, now_m: &Point3<f64>) -> Option<Vector3<f64>> {
        let (_, back) = self.blocks.get(index)?.as_ref()?;
        Some((back * now_m).coords / self.edge_m - self.first)
    }

    /// Whether a place beside the block is one of another block, as that one moves. Where neighbours move apart, it is of none.
    fn is_of_another(&self, cell: &Vector3<i32>, now_m: &Point3<f64>) -> bool {
        if self.is_rigid {
            return index_of(cell).and_then(|index| self.blocks.get(index)?.as_ref()).is_some();
        }
        (0..self.blocks.len()).filter(|index| *index != ITSELF).any(|index| {
            // The cast saturates.
            let place = self.place_before(index, now_m);
            place.is_some_and(|place| {
                index_of(&place.map(|along| along.floor() as i32)) == Some(index)
            })
        })
    }

    /// Reads the nodes out of the blocks.
    fn read(&mut self) {
        for (index, block) in self.blocks.iter().enumerate() {
            let Some((block, _)) = block else { continue };
            let [x, y, z] = step_of(index).map(nodes_of_step);
            for (z, y) in z.flat_map(|z| y.clone().map(move |y| (z, y))) {
                let row = Vector3::new(x.start, y, z);
                let voxels = voxel_index(VoxelKey { x: row.x, y, z })..;
                let nodes = self.nodes.iter_mut().skip(position_of(&row)).take(x.len());
                for (node, voxel) in nodes.zip(voxels) {
                    *node = Corner::of(block, voxel);
                }
            }
        }
    }

    /// Finds how the distance rises at each node but the outermost ones.
    fn find_rises(&mut self) {
        for index in 0..self.nodes.len() {
            let distance_at = |step: usize| self.nodes.get(step)?.map(|node| node.distance);
            let Some(known) = distance_at(index) else { continue };
            let rise = AXES.map(|step| {
                let after = distance_at(index + step).map(|after| after - known);
                let before = index.checked_sub(step).and_then(distance_at);
                match (before.map(|before| known - before), after) {
                    (Some(before), Some(after)) => 0.5 * (before + after),
                    (before, after) => before.or(after).unwrap_or(0.0),
                }
            });
            if let Some(Some(node)) = self.nodes.get_mut(index) {
                node.rise = rise.into();
            }
        }
    }
}

impl Corner {
    /// A node of a block; `None` where nothing is known.
    fn of(block: &SurfaceBlock, voxel: usize) -> Option<Self> {
        let weight = f32::from(block.weight[voxel]);
        (weight > 0.0).then(|| Self {
            distance: f32::from(block.distance[voxel]),
            weight,
            colour: block.colour.as_ref().map_or(geometry::NO_COLOUR, |colour| colour[voxel]),
            rise: Vector3::zeros(),
        })
    }

    /// How the distance changes by a way from the node, in edges.
    fn rise_by(&self, way: &Vector3<f64>) -> f64 {
        self.rise.cast::<f64>().dot(way)
    }
}

/// What the corners of a cell say of a place in it; `None` where none is known. A corner that is not known is as the nearest
/// known ones say. The weight is the mean of these, the colour that of the nearest.
fn between(corners: &[Option<&Corner>; 8], within: &Vector3<f64>) -> Option<Node> {
    let is_whole = corners.iter().all(Option::is_some);
    let (mut shares, mut nearest) = (0.0, 0.0);
    let mut mean = Node { distance: 0.0, weight: 0.0, colour: geometry::NO_COLOUR };
    for (index, corner) in corners.iter().enumerate() {
        let beside = within - corner_of(index).cast::<f64>();
        let share = beside.map(|along| 1.0 - along.abs()).product();
        let Some(known) = corner else {
            mean.distance += share * beyond(corners, index)?;
            continue;
        };
        // Half of what the gradients say is what the curvature takes away. At a border it would let errors grow.
        let bend = if is_whole { 0.5 * known.rise_by(&beside) } else { 0.0 };
        mean.distance += share * (f64::from(known.distance) + bend);
        mean.weight += share * f64::from(known.weight);
        shares += share;
        if share > nearest {
            (nearest, mean.colour) = (share, known.colour);
        }
    }
    let Node { distance, weight, colour } = mean;
    let distance = distance.clamp(-f64::from(FULL), f64::from(FULL));
    (shares > 0.0).then(|| Node { distance, weight: weight / shares, colour })
}

/// The distance at a corner that is not known: the mean of what the nearest known ones say.
fn beyond(corners: &[Option<&Corner>; 8], index: usize) -> Option<f64> {
    let steps = |known: usize| (known ^ index).count_ones();
    let known = || corners.iter().enumerate().filter_map(|(at, known)| Some((at, (*known)?)));
    let least = known().map(|(at, _)| steps(at)).min()?;
    let (mut sum, mut count) = (0.0, 0.0);
    for (at, known) in known().filter(|(at, _)| steps(*at) == least) {
        let way = corner_of(index) - corner_of(at);
        sum += f64::from(known.distance) + known.rise_by(&way.cast());
        count += 1.0;
    }
    Some(sum / count)
}

/// The step to the corner by which something is known at a place in a cell that is not known as a whole.
fn nearest_of(
    corners: &[Option<&Corner>; 8],
    within: &Vector3<f64>,
    distance: f64,
) -> Option<Vector3<i32>> {
    let mut nearest: Option<(f64, Vector3<i32>)> = None;
    for (index, corner) in corners.iter().enumerate() {
        let Some(rise) = corner.map(|corner| corner.rise.cast::<f64>()) else { continue };
        let step = corner_of(index);
        let beside = within - step.cast::<f64>();
        if beside.amax() <= REACH_ALONG_IN_EDGES {
            return Some(step);
        }
        // Only a cell that the surface passes needs a node more.
        let Some(across) = rise.try_normalize(0.0).filter(|_| distance.abs() <= rise.abs().sum())
        else {
            continue;
        };
        let along = (beside - across * across.dot(&beside)).norm();
        if along <= REACH_ALONG_IN_EDGES && nearest.is_none_or(|(least, _)| along < least) {
            nearest = Some((along, step));
        }
    }
    nearest.map(|(_, step)| step)
}

/// The nodes that count, along an axis, of a block at a step from the one that the others are around.
fn nodes_of_step(step: i32) -> Range<i32> {
    (step * EDGE).max(-BEFORE)..((step + 1) * EDGE).min(NODES as i32 - BEFORE)
}

/// The position of a node, from the first of the block itself, among those that count.
fn position_of(node: &Vector3<i32>) -> usize {
    let [x, y, z] = node.map(|along| (along + BEFORE) as usize).into();
    (z * NODES + y) * NODES + x
}

/// The step to a corner of a cell from its first: a corner's number has a bit for each axis.
fn corner_of(corner: usize) -> Vector3<i32> {
    Vector3::new(corner & 1, corner >> 1 & 1, corner >> 2).map(|step| step as i32)
}

/// The step to a block from the one that the others are around.
fn step_of(index: usize) -> [i32; 3] {
    [index % 3, index / 3 % 3, index / 9].map(|step| step as i32 - 1)
}

/// The block of a node or cell, among those around one; `None` of what is farther away.
fn index_of(node: &Vector3<i32>) -> Option<usize> {
    let [x, y, z] = node.map(|along| along.div_euclid(EDGE) + 1).into();
    let is_near = [x, y, z].iter().all(|step| (0..3).contains(step));
    is_near.then_some(((z * 3 + y) * 3 + x) as usize)
}
