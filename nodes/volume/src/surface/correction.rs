//! The surface after a correction of the map: each block moves with the moment at which it was seen first.
//!
//! A block that stays is kept to the bit. Of one that moves, the nodes of where it comes to are those that it says something of
//! (module `around`); those that come from several blocks are one, by their weights. The moment of a block is then that of the
//! heaviest part: by the earliest one each correction would take an early block's border, and with it its moment, a block farther.

use geometry::{NO_COLOUR, Stamp};
use nalgebra::{Isometry3, Point3, Vector3};

use super::Surface;
use super::around::{Around, Node};
use super::block::SurfaceBlock;
use super::node_box::NodeBox;
use crate::block::{BLOCK_EDGE, BLOCK_VOXELS, BlockBox, BlockKey, voxel_index};
use crate::evidence::Evidence;

/// Weights that are summed end here, as those of images.
const MOST_WEIGHT: f64 = 32.0 * 255.0;

/// When and from where a block was seen.
struct Seen {
    evidence: Evidence,
    first_seen: u32,
    last_seen: u32,
    last_hit: u32,
    hit_from_m: [f32; 3],
}

impl Seen {
    fn of(block: &SurfaceBlock, motion: &Isometry3<f64>) -> Self {
        let hit_from_m = motion * Point3::from(block.hit_from_m).cast::<f64>();
        let SurfaceBlock { evidence, first_seen, last_seen, last_hit, .. } = *block;
        Self { evidence, first_seen, last_seen, last_hit, hit_from_m: hit_from_m.cast().into() }
    }

    /// A block that was seen then, of which nothing is known.
    fn block(&self) -> SurfaceBlock {
        let Self { evidence, first_seen, last_seen, last_hit, hit_from_m } = *self;
        let nothing = SurfaceBlock::default();
        SurfaceBlock { evidence, first_seen, last_seen, last_hit, hit_from_m, ..nothing }
    }
}

impl Surface {
    /// The surface as it is after a correction. `now_from_before` takes a point that was seen at a moment to where it is now;
    /// see [`geometry::PathCorrection::at`].
    #[must_use]
    pub fn corrected(&self, now_from_before: impl Fn(Stamp) -> Isometry3<f64>) -> Self {
        // By direction it saw what it saw, wherever the map is.
        let seen_before = self.seen_before.clone();
        // What was loaded stays where it is.
        let (ticks, loaded) = (self.ticks.clone(), self.loaded.clone());
        let mut corrected = Self { ticks, seen_before, loaded, ..self.emptied() };
        for key in self.block_keys() {
            corrected.join_moved(self, key, &now_from_before, BlockBox::ALL);
        }
        corrected.settle_moved();
        corrected
    }

    /// How a block moves by a correction. What was seen at no moment was put there by hand, and stays.
    #[must_use]
    pub fn motion_of(
        &self,
        key: BlockKey,
        now_from_before: impl Fn(Stamp) -> Isometry3<f64>,
    ) -> Isometry3<f64> {
        let block = self.block(key);
        block.map_or_else(Isometry3::identity, |block| self.motion(block, now_from_before))
    }

    fn motion(
        &self,
        block: &SurfaceBlock,
        now_from_before: impl Fn(Stamp) -> Isometry3<f64>,
    ) -> Isometry3<f64> {
        let seen = self.ticks.stamp(block.first_seen);
        seen.map_or_else(Isometry3::identity, now_from_before)
    }

    /// Joins a block of another surface with the same voxels and times, moved, to the blocks of this one within a box:
    /// [`Surface::corrected`], block by block. All blocks around it in the other surface count, too. It needs
    /// [`Surface::settle_moved`] after it. Blocks beyond the bound are left out.
    pub fn join_moved(
        &mut self,
        before: &Self,
        key: BlockKey,
        now_from_before: impl Fn(Stamp) -> Isometry3<f64>,
        within: BlockBox,
    ) {
        let Some(block) = before.block(key) else { return };
        let motion = before.motion(block, &now_from_before);
        if motion == Isometry3::identity() {
            if within.contains(key) {
                self.join_block(key, block);
            }
        } else if geometry::check_pose(&motion).is_ok() {
            let around = Around::of(key, before.config.edge_m, |key| {
                let block = before.block(key)?;
                Some((block, before.motion(block, &now_from_before)))
            });
            let seen = Seen::of(block, &motion);
            self.join_nodes(&around, &seen, &before.moved_nodes(key, &motion), within);
        }
    }

    /// After [`Surface::join_moved`]: removes the blocks in which there is no surface, as an image does, and counts the nodes near
    /// the surface.
    pub fn settle_moved(&mut self) {
        for key in self.block_keys() {
            match self.layer.get_mut(key).and_then(Option::as_mut) {
                Some(block) if block.has_surface() => block.moment_weight = 0,
                _ => {
                    self.remove_block(key);
                }
            }
        }
        self.count_near_nodes();
    }

    /// The blocks that [`Surface::join_moved`] may join a block to.
    #[must_use]
    pub fn moved_box(&self, key: BlockKey, motion: &Isometry3<f64>) -> BlockBox {
        if *motion == Isometry3::identity() {
            return BlockBox { least: key, most: key };
        }
        self.moved_nodes(key, motion).blocks()
    }

    /// The nodes of where a block's cells and those next to them come to.
    fn moved_nodes(&self, key: BlockKey, motion: &Isometry3<f64>) -> NodeBox {
        let edge_m = self.config.edge_m;
        let half = 0.5 * BLOCK_EDGE as f64 + 1.0;
        let middle_m = super::middle_m(key, super::block_edge_m(edge_m));
        let middle = motion * middle_m / edge_m;
        let reach = motion.rotation.to_rotation_matrix().matrix().abs() * Vector3::repeat(half);
        NodeBox::of_cells(&middle.coords, &reach)
    }

    fn join_block(&mut self, key: BlockKey, block: &SurfaceBlock) {
        if self.layer.get(key).is_none() {
            if self.layer.len() < self.config.max_blocks {
                let moment_weight = block.weight();
                let block = SurfaceBlock { near_nodes: 0, moment_weight, ..block.clone() };
                self.layer.insert(key, Some(Box::new(block)));
            }
            return;
        }
        let colour = |index| block.colour.as_ref().map_or(NO_COLOUR, |colour| colour[index]);
        let nodes = block.distance.iter().zip(&block.weight).enumerate();
        let nodes = nodes.map(|(index, (distance, weight))| {
            let (distance, weight) = (f64::from(*distance), f64::from(*weight));
            (index, Node { distance, weight, colour: colour(index) })
        });
        self.join(key, &Seen::of(block, &Isometry3::identity()), &nodes.collect::<Vec<_>>());
    }

    fn join_nodes(&mut self, around: &Around<'_>, seen: &Seen, moved: &NodeBox, within: BlockBox) {
        let edge_m = self.config.edge_m;
        let mut nodes = Vec::with_capacity(BLOCK_VOXELS);
        for key in moved.blocks().intersection(&within).keys() {
            nodes.clear();
            for place in moved.of_block(key) {
                let place_m = Point3::from([place.x, place.y, place.z].map(f64::from)) * edge_m;
                nodes.extend(around.at(&place_m).map(|node| (voxel_index(place), node)));
            }
            self.join(key, seen, &nodes);
        }
    }

    /// Joins nodes of another block, by their index, to those of a block.
    fn join(&mut self, key: BlockKey, seen: &Seen, nodes: &[(usize, Node)]) {
        let is_known = |node: &Node| node.weight.round() >= 1.0;
        if !nodes.iter().any(|(_, node)| is_known(node)) {
            return;
        }
        if self.layer.get(key).is_none() {
            if self.layer.len() >= self.config.max_blocks {
                return;
            }
            self.layer.insert(key, Some(Box::new(seen.block())));
        }
        let Some(block) = self.layer.get_mut(key).and_then(Option::as_mut) else { return };
        if block.moment_weight == 0 {
            // It came back from a store meanwhile, and does not know what its moment weighs.
            block.moment_weight = block.weight();
        }
        block.evidence = block.evidence.max(seen.evidence);
        // Of several blocks in whatever order.
        block.last_seen = block.last_seen.max(seen.last_seen);
        if seen.last_hit > block.last_hit {
            (block.last_hit, block.hit_from_m) = (seen.last_hit, seen.hit_from_m);
        }
        let mut weight = 0_u32;
        for (index, node) in nodes.iter().filter(|(_, node)| is_known(node)) {
            block.join_node(*index, node);
            // The cast saturates.
            weight = weight.saturating_add(node.weight.round() as u32);
        }
        block.take_moment(seen.first_seen, weight);
    }
}

impl SurfaceBlock {
    /// Joins what another block says of a node.
    fn join_node(&mut self, index: usize, node: &Node) {
        let (known, weight) = (f64::from(self.weight[index]), node.weight.round());
        let mean =
            (f64::from(self.distance[index]) * known + node.distance * weight) / (known + weight);
        self.distance[index] = mean.round() as i16;
        self.weight[index] = (known + weight).min(MOST_WEIGHT) as u16;
        if node.colour != NO_COLOUR {
            let colour = self.colour.get_or_insert_with(|| Box::new([NO_COLOUR; BLOCK_VOXELS]));
            if weight > known || colour[index] == NO_COLOUR {
                colour[index] = node.colour;
            }
        }
    }
}
