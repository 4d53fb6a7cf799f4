//! How far a place is from the nearest point of the surface, for planners: a product of the surface that is computed where it is
//! asked for, and again where the surface has changed.
//!
//! **Distances** are kept at nodes, in blocks of their own, at an edge that need not be the map's. At a node the distance is that of
//! the nearest point of the surface ([`super::points`]), exactly (module `nearest`). Between nodes it is interpolated linearly along
//! the three axes. Along no way does a distance grow faster than the way is long; so at a place the error is at most the mean
//! distance to the eight nodes around it, weighted as they are: half a voxel's diagonal in the middle of the voxel, and 0 at
//! nodes.
//!
//! **Changes.** The blocks of the map that have changed wait until somebody asks. Then their points are compared with those before,
//! and the distances of those blocks are forgotten whose greatest one reaches to what has come or gone. What is asked for and not
//! there is computed: the work is bounded by what was asked.

mod bounds;
mod config;
mod nearest;
mod obstacles;
#[cfg(test)]
mod tests;

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, DistanceAt, NearestObstacle, PlaceState, VoxelKey};
use nalgebra::{Point3, Vector3};

use super::nodes::NODES;
use super::waiting::WaitingBlocks;
use super::{PointRules, Surface, SurfacePoint, block_edge_m};
use crate::block::{BlockBox, BlockKey, voxel_index};
use crate::layer::Layer;
use bounds::Bounds;
pub use config::{DistanceConfig, DistanceConfigError};
use nearest::{BLOCK_NODES, NodeDistances, NodeGrid};
use obstacles::Obstacles;

/// Less steep than this, in metres a metre, the distance grows in no direction.
const LEAST_SLOPE: f32 = 1e-3;
/// The square of a root may be less than what the root was taken of, by rounding: the change of a point at the greatest distance
/// counts.
const ROUNDED_UP: f32 = 1.0 + 1e-6;

/// The distances from the points of a surface. See the module.
#[derive(Clone, Debug)]
pub struct DistanceField {
    config: DistanceConfig,
    grid: NodeGrid,
    /// Blocks of the map that have changed.
    waiting: WaitingBlocks,
    obstacles: Obstacles,
    /// What was asked for so far, and holds still.
    blocks: Layer<NodeDistances>,
    points: Vec<SurfacePoint>,
}

/// The nodes of a box.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LatticeBox {
    /// The first node along each axis.
    pub first: VoxelKey,
    /// How many there are along x, y and z: at least one.
    pub size: [u32; 3],
}

impl LatticeBox {
    /// How many nodes there are.
    #[must_use]
    pub fn nodes(&self) -> u64 {
        self.size.into_iter().fold(1, |nodes: u64, along| nodes.saturating_mul(u64::from(along)))
    }

    /// The nodes: x runs fastest, then y, then z.
    pub fn keys(self) -> impl Iterator<Item = VoxelKey> {
        let VoxelKey { x, y, z } = self.first;
        let along =
            |first: i32, size: u32| (0..size).map(move |step| first.saturating_add_unsigned(step));
        let [size_x, size_y, size_z] = self.size;
        along(z, size_z).flat_map(move |z| {
            along(y, size_y).flat_map(move |y| along(x, size_x).map(move |x| VoxelKey { x, y, z }))
        })
    }
}

impl DistanceField {
    /// The distances from a surface as it is now. Nothing is computed yet.
    ///
    /// # Errors
    /// When a parameter means nothing.
    pub fn of(surface: &Surface, config: DistanceConfig) -> Result<Self, DistanceConfigError> {
        config.validate()?;
        let DistanceConfig { edge_m, max_distance_m, .. } = config;
        // A place within the bound has all nodes around it within a diagonal more; the second one is for the rounding.
        let reach_m = max_distance_m + 2.0 * 3.0_f64.sqrt() * edge_m;
        let map_block_m = block_edge_m(surface.config().edge_m);
        let mut waiting = WaitingBlocks::default();
        surface.block_keys().into_iter().for_each(|key| waiting.wait(key));
        Ok(Self {
            config,
            grid: NodeGrid { edge_m, reach_m: reach_m as f32, map_block_m },
            waiting,
            obstacles: Obstacles::default(),
            blocks: Layer::default(),
            points: Vec::new(),
        })
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &DistanceConfig {
        &self.config
    }

    /// Takes in what the latest image changed. To be called after each.
    pub fn follow(&mut self, surface: &Surface) {
        self.waiting.follow(surface);
    }

    /// A block was removed, or put there, by hand.
    pub fn follow_block(&mut self, key: BlockKey) {
        self.waiting.has_changed(key);
    }

    /// A block has left for a store: what is in it stays an obstacle where distances were computed already. It has to come back,
    /// with [`DistanceField::follow_block`], before others are computed around it.
    pub fn left(&mut self, key: BlockKey) {
        self.obstacles.forget(key);
    }

    /// The blocks of the surface that must be in memory for the distance at a place, and have been taken in by
    /// [`DistanceField::update`]; `None` where that is computed already.
    #[must_use]
    pub fn needed_for(&self, place_in_map: &Point3<f64>) -> Option<BlockBox> {
        let (key, ..) = self.cell_of(place_in_map);
        let is_there = self.blocks.get(key).is_some();
        // The points of a block depend on the next blocks, too.
        (!is_there).then(|| self.grid.map_blocks(key).grown(1))
    }

    /// Takes in what has changed: compares the points of the blocks that wait, and forgets the distances that may be others now.
    /// Returns how many blocks of distances are forgotten.
    pub fn update(&mut self, surface: &Surface) -> usize {
        let mut points = std::mem::take(&mut self.points);
        // By blocks of distances: there are fewer.
        let mut changed: HashMap<BlockKey, Bounds, BuildVoxelHasher> = HashMap::default();
        while let Some(key) = self.waiting.next() {
            self.waiting.done();
            points.clear();
            surface.points_of(key, PointRules::default(), &mut points);
            if let Some(bounds) = self.obstacles.put(key, &points) {
                let (around, ..) = self.cell_of(&Point3::from(bounds.least_m).cast());
                let of_block = changed.entry(around).or_insert(Bounds::EMPTY);
                *of_block = of_block.with(&bounds);
            }
        }
        self.points = points;
        changed.into_values().map(|changed| self.forget_around(&changed)).sum()
    }

    /// Forgets the distances that what has changed may have an influence on.
    fn forget_around(&mut self, changed: &Bounds) -> usize {
        let reach_m = self.grid.reach_m;
        let corner = |corner_m: [f32; 3], more_m: f32| {
            let (key, ..) = self.cell_of(&Point3::from(corner_m.map(|m| m + more_m)).cast());
            key
        };
        let (least, most) = (corner(changed.least_m, -reach_m), corner(changed.most_m, reach_m));
        let mut influenced = Vec::new();
        // A block has the first nodes of the next ones, too.
        self.blocks.for_each_in(BlockBox { least, most }.grown(1), |key, slot| {
            let most_m = self.blocks.at(slot).map_or(0.0, |block| block.most_m) * ROUNDED_UP;
            if self.grid.bounds(key).nearest_m2(changed) <= most_m * most_m {
                influenced.push(key);
            }
        });
        influenced.iter().for_each(|key| drop(self.blocks.remove(*key)));
        influenced.len()
    }

    /// How far a place is from the nearest point of the surface, and what is recorded of it. What is not finite is nowhere: beyond
    /// the bound, and unknown.
    pub fn at(&mut self, surface: &Surface, place_in_map: &Point3<f64>) -> DistanceAt {
        if !place_in_map.iter().all(|along| along.is_finite()) {
            return DistanceAt::default();
        }
        if self.waiting.next().is_some() {
            self.update(surface);
        }
        DistanceAt { nearest: self.nearest(place_in_map), place: surface.place_state(place_in_map) }
    }

    fn nearest(&mut self, place_in_map: &Point3<f64>) -> Option<NearestObstacle> {
        let (key, cell, within) = self.cell_of(place_in_map);
        if self.blocks.get(key).is_none() {
            if self.blocks.len() >= self.config.max_blocks {
                self.blocks = Layer::default();
            }
            self.blocks.insert(key, self.grid.distances(&self.obstacles, key));
        }
        let nodes_m = self.blocks.get(key)?.nodes_m.as_deref()?;
        let (distance_m, slope) = interpolated(nodes_m, cell, within)?;
        (f64::from(distance_m) <= self.config.max_distance_m).then(|| NearestObstacle {
            distance_m,
            away: (slope / self.config.edge_m as f32).try_normalize(LEAST_SLOPE),
        })
    }

    /// The block of a place, its cell in it, and where in the cell it is, from 0 to 1 along each axis.
    fn cell_of(&self, place_in_map: &Point3<f64>) -> (BlockKey, usize, [f32; 3]) {
        let in_edges = place_in_map.coords / self.config.edge_m;
        let least = in_edges.map(f64::floor);
        // The casts saturate.
        let cell = VoxelKey { x: least.x as i32, y: least.y as i32, z: least.z as i32 };
        let within = (in_edges - least).map(|along| along as f32);
        (BlockKey::of(cell), voxel_index(cell), within.into())
    }

    /// The nodes of a box, in the map: those within it, or along an axis where none is the one nearest to its middle.
    #[must_use]
    pub fn lattice(&self, least_m: &Point3<f64>, most_m: &Point3<f64>) -> LatticeBox {
        let along = |axis: usize| {
            let [least, most] = [least_m, most_m].map(|corner| corner[axis] / self.config.edge_m);
            let (first, last) = (least.ceil(), most.floor());
            // The casts saturate.
            if first <= last {
                (first as i32, ((last - first) as u32).saturating_add(1))
            } else {
                ((0.5 * (least + most)).round() as i32, 1)
            }
        };
        let [(x, size_x), (y, size_y), (z, size_z)] = [0, 1, 2].map(along);
        LatticeBox { first: VoxelKey { x, y, z }, size: [size_x, size_y, size_z] }
    }

    /// Where a node is, in the map.
    #[must_use]
    pub fn node_m(&self, VoxelKey { x, y, z }: VoxelKey) -> Point3<f64> {
        [x, y, z].map(|along| f64::from(along) * self.config.edge_m).into()
    }

    /// How many blocks of distances there are.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// The memory taken, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let nodes = self.blocks.unordered().filter(|(_, block)| block.nodes_m.is_some()).count();
        nodes * size_of::<[f32; BLOCK_NODES]>()
            + self.blocks.table_bytes()
            + self.obstacles.memory_bytes()
            + self.waiting.memory_bytes()
            + self.points.capacity() * size_of::<SurfacePoint>()
    }
}

/// The distance in a cell, and by how much it grows along each axis in an edge; `None` where a node around it is beyond the reach.
#[inline]
fn interpolated(
    nodes_m: &[f32; BLOCK_NODES],
    cell: usize,
    [x, y, z]: [f32; 3],
) -> Option<(f32, Vector3<f32>)> {
    let edge = crate::block::BLOCK_EDGE;
    let first = (cell / (edge * edge) * NODES + cell / edge % edge) * NODES + cell % edge;
    let at = |corner: usize| {
        let step = (corner & 1) + (corner >> 1 & 1) * NODES + (corner >> 2) * NODES * NODES;
        nodes_m[first + step]
    };
    let corners: [f32; 8] = [at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)];
    let [a, b, c, d, e, f, g, h] = corners;
    let mix = |from: f32, to: f32, share: f32| from + (to - from) * share;
    let along_x = [mix(a, b, x), mix(c, d, x), mix(e, f, x), mix(g, h, x)];
    let along_y = [mix(along_x[0], along_x[1], y), mix(along_x[2], along_x[3], y)];
    let distance_m = mix(along_y[0], along_y[1], z);
    let slope = Vector3::new(
        mix(mix(b - a, d - c, y), mix(f - e, h - g, y), z),
        mix(along_x[1] - along_x[0], along_x[3] - along_x[2], z),
        along_y[1] - along_y[0],
    );
    corners.iter().all(|corner_m| corner_m.is_finite()).then_some((distance_m, slope))
}

impl Surface {
    /// What is recorded of a place: at the node nearest to it.
    #[must_use]
    pub fn place_state(&self, place_in_map: &Point3<f64>) -> PlaceState {
        let node = self.node_nearest_to(place_in_map);
        let Some(block) = self.block(BlockKey::of(node)) else { return PlaceState::Unknown };
        let index = voxel_index(node);
        match (block.weight[index], block.distance[index]) {
            (0, _) => PlaceState::Unknown,
            (_, distance) if distance < 0 => PlaceState::Behind,
            _ => PlaceState::Free,
        }
    }

    /// The block that says what is recorded of a place.
    #[must_use]
    pub fn block_of(&self, place_in_map: &Point3<f64>) -> BlockKey {
        BlockKey::of(self.node_nearest_to(place_in_map))
    }

    fn node_nearest_to(&self, place_in_map: &Point3<f64>) -> VoxelKey {
        // The cast saturates.
        let along = |axis: usize| (place_in_map[axis] / self.config.edge_m).round() as i32;
        VoxelKey { x: along(0), y: along(1), z: along(2) }
    }
}
