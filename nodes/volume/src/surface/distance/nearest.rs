//! The distances at the nodes of a block: exact, by branch and bound over the blocks of the map.
//!
//! A block of obstacles is looked into for a node only if its box is nearer than the nearest point that was found so far. Which
//! boxes can be is decided for the whole block first, then for cubes of 3 nodes an axis: none that is farther away from all of a
//! cube than another one's farthest point is. Neighbouring nodes bound each other: their distances differ by no more than they
//! are apart.
//!
//! The transform of Felzenszwalb and Huttenlocher ("Distance transforms of sampled functions", Theory of Computing 8, 2012) and the
//! propagation of voxblox (Oleynikova et al., IROS 2017) and FIESTA (Han et al., IROS 2019) take obstacles to be in the middle of
//! voxels: by up to half a voxel's diagonal in the wrong place, as much as is to be the whole error here.

use multiversion::multiversion;

use super::bounds::Bounds;
use super::obstacles::{BlockPoints, Obstacles};
use crate::block::{BLOCK_EDGE, BlockBox, BlockKey};
use crate::surface::nodes::NODES;

/// Nodes of a block with the first ones of the next blocks.
pub(super) const BLOCK_NODES: usize = NODES * NODES * NODES;
/// Nodes along the edge of a cube that is decided on as a whole.
const CUBE: usize = 3;
/// The distances of two neighbouring nodes differ by no more than they are apart: an edge; so much more for the rounding of
/// distances,
const ROUNDED_UP: f32 = 1.01;
/// and so many units in the last place for that of the nodes' coordinates, half a unit each, and as much again.
const ROUNDED_COORDINATES: f32 = 2.0;

/// The distances at the nodes of a block.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct NodeDistances {
    /// Infinite where they are beyond the reach; `None` where all are. x runs fastest, then y, then z.
    pub(super) nodes_m: Option<Box<[f32; BLOCK_NODES]>>,
    /// The greatest, or the reach.
    pub(super) most_m: f32,
}

/// Where the nodes of a block are.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeGrid {
    pub(super) edge_m: f64,
    /// Points that are farther away do not count.
    pub(super) reach_m: f32,
    /// The edge of the map's blocks.
    pub(super) map_block_m: f64,
}

impl NodeGrid {
    fn along_m(&self, block: i32, node: usize) -> f32 {
        ((f64::from(block) * BLOCK_EDGE as f64 + node as f64) * self.edge_m) as f32
    }

    fn cube_of(&self, key: BlockKey, [x, y, z]: [usize; 3], nodes: usize) -> Bounds {
        let place_m = |[x, y, z]: [usize; 3]| {
            [self.along_m(key.x, x), self.along_m(key.y, y), self.along_m(key.z, z)]
        };
        let beyond = nodes - 1;
        Bounds {
            least_m: place_m([x, y, z]),
            most_m: place_m([x + beyond, y + beyond, z + beyond]),
        }
    }

    /// Around all nodes of a block.
    pub(super) fn bounds(&self, key: BlockKey) -> Bounds {
        self.cube_of(key, [0; 3], NODES)
    }

    /// The blocks of the map that have a point within reach of a block's nodes.
    pub(super) fn map_blocks(&self, key: BlockKey) -> BlockBox {
        let Bounds { least_m, most_m } = self.bounds(key);
        let block =
            |along_m: f32| (f64::from(along_m) / self.map_block_m).floor().clamp(-1e9, 1e9) as i32;
        BlockBox {
            least: least_m.map(|m| block(m - self.reach_m)).into(),
            most: most_m.map(|m| block(m + self.reach_m)).into(),
        }
    }

    /// The distances at the nodes of a block.
    pub(super) fn distances(&self, obstacles: &Obstacles, key: BlockKey) -> NodeDistances {
        let mut near = Vec::new();
        obstacles.for_each_in(self.map_blocks(key), |points| near.push(points));
        let bounds = self.bounds(key);
        let near = nearest_of(near.into_iter(), &bounds, self.reach_m * self.reach_m);
        if near.is_empty() {
            return NodeDistances { nodes_m: None, most_m: self.reach_m };
        }
        let mut nodes_m = Box::new([f32::INFINITY; BLOCK_NODES]);
        for z in (0..NODES).step_by(CUBE) {
            for y in (0..NODES).step_by(CUBE) {
                for x in (0..NODES).step_by(CUBE) {
                    fill_cube(self, &near, (key, [x, y, z]), &mut nodes_m);
                }
            }
        }
        let most_m = nodes_m.iter().copied().fold(0.0, f32::max).min(self.reach_m);
        let is_any = nodes_m.iter().any(|node_m| node_m.is_finite());
        NodeDistances { nodes_m: is_any.then_some(nodes_m), most_m }
    }
}

/// The blocks that may have the nearest point of a place in the cube.
fn nearest_of<'a>(
    blocks: impl Iterator<Item = &'a BlockPoints> + Clone,
    cube: &Bounds,
    reach_m2: f32,
) -> Vec<&'a BlockPoints> {
    let farthest_m2 = blocks.clone().map(|points| points.bounds.farthest_m2(cube));
    let within_m2 = farthest_m2.fold(reach_m2, f32::min);
    blocks.filter(|points| points.bounds.nearest_m2(cube) <= within_m2).collect()
}

#[multiversion(targets("x86_64+avx2"))]
fn fill_cube(
    grid: &NodeGrid,
    near: &[&BlockPoints],
    (key, first): (BlockKey, [usize; 3]),
    nodes_m: &mut [f32; BLOCK_NODES],
) {
    let cube = grid.cube_of(key, first, CUBE);
    let reach_m2 = grid.reach_m * grid.reach_m;
    let near = nearest_of(near.iter().copied(), &cube, reach_m2);
    if near.is_empty() {
        return;
    }
    let farthest_m = cube.least_m[0].abs().max(cube.most_m[0].abs());
    let apart_m = ROUNDED_UP * grid.edge_m as f32 + ROUNDED_COORDINATES * f32::EPSILON * farthest_m;
    let [x, y, z] = first;
    for z in z..z + CUBE {
        for y in y..y + CUBE {
            let mut before_m = f32::INFINITY;
            for x in x..x + CUBE {
                let place_m =
                    [grid.along_m(key.x, x), grid.along_m(key.y, y), grid.along_m(key.z, z)];
                let node = Bounds::of_point(place_m);
                let below_m = (before_m + apart_m).min(grid.reach_m);
                let below_m2 = below_m * below_m;
                let mut nearest_m2 = below_m2;
                for points in &near {
                    if points.bounds.nearest_m2(&node) < nearest_m2 {
                        nearest_m2 = points.nearest_m2(place_m, nearest_m2);
                    }
                }
                // None is below the bound where none is within reach.
                before_m = if nearest_m2 < below_m2 { nearest_m2.sqrt() } else { f32::INFINITY };
                nodes_m[(z * NODES + y) * NODES + x] = before_m;
            }
        }
    }
}
