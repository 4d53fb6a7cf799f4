//! The surface as points: one for each voxel that the surface crosses.
//!
//! A voxel is the cell between eight nodes. Where some of them are before the surface and others behind it, the surface
//! crosses edges between them; the point is the mean of the crossings, each found by linear interpolation (surface nets:
//! Gibson, "Constrained elastic surface nets", MICCAI 1998, section 2). It lies in its voxel, and on the surface where that
//! is flat. The normal is the gradient of the distance. A cell of which too little is known to say where the surface leaves it
//! has no point.

use geometry::VoxelKey;
use nalgebra::{Point3, Vector3};

use super::Surface;
use super::block::SurfaceBlock;
use crate::block::{BLOCK_EDGE, BlockKey};

/// Nodes along the edge of a block with those of its neighbours.
const NODES: usize = BLOCK_EDGE + 1;
/// The edges of each face of a cell, as bits: edge `4 axis + n` is the `n`th of those along that axis, in the order of the corner
/// that it starts from.
const FACES: [u16; 6] = faces();

const fn faces() -> [u16; 6] {
    let mut faces = [0; 6];
    let mut axis = 0;
    while axis < 3 {
        let (mut corner, mut edge) = (0, 0);
        while corner < 8 {
            if corner >> axis & 1 == 0 {
                let mut across = 0;
                while across < 3 {
                    if across != axis {
                        faces[2 * across + (corner >> across & 1)] |= 1 << (4 * axis + edge);
                    }
                    across += 1;
                }
                edge += 1;
            }
            corner += 1;
        }
        axis += 1;
    }
    faces
}
/// A point stays so far within its voxel, in edges: the voxel of its coordinates is its own, rounded to single precision.
const INSIDE: f32 = 1e-3;

/// A point of the surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SurfacePoint {
    /// The voxel that it stands for.
    pub voxel: VoxelKey,
    /// Where it is, in the map: within that voxel.
    pub position_m: Point3<f32>,
    /// Of length 1, to the side from which the surface was seen.
    pub normal: Vector3<f32>,
    /// How sure it is: the mean weight of the nodes, in depths of the least noise (see `update`).
    pub weight: f32,
    /// Red, green, blue, where colours are kept and were seen.
    pub colour: Option<[u8; 3]>,
}

/// The nodes that the cells of a block lie between.
struct Nodes {
    distance: [[[i16; NODES]; NODES]; NODES],
    /// Bits by x of the nodes of a row: those that are sure enough, and those of them that are behind the surface.
    known: [[u16; NODES]; NODES],
    behind: [[u16; NODES]; NODES],
    weight: [[[u16; NODES]; NODES]; NODES],
}

/// What is used of a surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PointRules {
    /// Nodes of less weight do not count; 1 counts all. A depth at 1 m weighs some 150, at 3 m 10, at 5 m 2.
    pub least_weight: u16,
}

impl Default for PointRules {
    fn default() -> Self {
        Self { least_weight: 1 }
    }
}

impl Surface {
    /// The points of all blocks, in ascending order of the blocks.
    #[must_use]
    pub fn points(&self, rules: PointRules) -> Vec<SurfacePoint> {
        let mut points = Vec::new();
        for key in self.block_keys() {
            self.points_of(key, rules, &mut points);
        }
        points
    }

    /// Appends the points of one block, in ascending order of the voxels' indices.
    pub fn points_of(&self, key: BlockKey, rules: PointRules, points: &mut Vec<SurfacePoint>) {
        self.points_among(|key| self.block(key), key, rules, points);
    }

    /// [`Surface::points_of`] a surface of which a part is in another one of the same voxels.
    pub fn points_of_both(
        &self,
        other: &Self,
        key: BlockKey,
        rules: PointRules,
        points: &mut Vec<SurfacePoint>,
    ) {
        self.points_among(|key| self.block(key).or_else(|| other.block(key)), key, rules, points);
    }

    fn points_among<'a>(
        &self,
        block_at: impl Fn(BlockKey) -> Option<&'a SurfaceBlock>,
        key: BlockKey,
        rules: PointRules,
        points: &mut Vec<SurfacePoint>,
    ) {
        let Some(block) = block_at(key) else { return };
        // The next blocks, by the bits of their steps.
        let next: [Option<&SurfaceBlock>; 8] = [0, 1, 2, 3, 4, 5, 6, 7].map(|step: i32| {
            let beside = key.offset(step & 1, step >> 1 & 1, step >> 2);
            if step == 0 { Some(block) } else { block_at(beside) }
        });
        let nodes = Nodes::of(&next, rules.least_weight);
        for z in 0..BLOCK_EDGE {
            for y in 0..BLOCK_EDGE {
                let mut cells = nodes.crossed_cells(y, z);
                while cells != 0 {
                    let x = cells.trailing_zeros() as usize;
                    cells &= cells - 1;
                    if let Some(point) = self.point_of_cell(key, &nodes, &next, [x, y, z]) {
                        points.push(point);
                    }
                }
            }
        }
    }

    fn point_of_cell(
        &self,
        key: BlockKey,
        nodes: &Nodes,
        next: &[Option<&SurfaceBlock>; 8],
        [x, y, z]: [usize; 3],
    ) -> Option<SurfacePoint> {
        let mut values = [0.0_f32; 8];
        let mut is_known = [false; 8];
        let mut weight = 0.0;
        for corner in 0..8 {
            let (x, y, z) = (x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
            values[corner] = f32::from(nodes.distance[z][y][x]);
            is_known[corner] = nodes.known[z][y] >> x & 1 == 1;
            weight += f32::from(if is_known[corner] { nodes.weight[z][y][x] } else { 0 });
        }
        let mut sum = Vector3::zeros();
        let mut gradient = Vector3::zeros();
        let mut crossed = 0_u16;
        for axis in 0..3 {
            let (mut rise, mut edges) = (0.0, 0.0);
            for (edge, from) in (0..8).filter(|corner| corner >> axis & 1 == 0).enumerate() {
                let to = from | 1 << axis;
                if !(is_known[from] && is_known[to]) {
                    continue;
                }
                rise += values[to] - values[from];
                edges += 1.0;
                if (values[from] < 0.0) != (values[to] < 0.0) {
                    let mut crossing =
                        Vector3::new(from & 1, from >> 1 & 1, from >> 2).map(|along| along as f32);
                    crossing[axis] = values[from] / (values[from] - values[to]);
                    sum += crossing;
                    crossed |= 1 << (4 * axis + edge);
                }
            }
            if edges == 0.0 {
                return None;
            }
            gradient[axis] = rise / edges;
        }
        // A surface that leaves a face at one edge enters it at another one: otherwise this is the border of what is known.
        let is_open = |face: &u16| (crossed & face).count_ones() % 2 == 1;
        if crossed == 0 || FACES.iter().any(is_open) {
            return None;
        }
        let crossings = crossed.count_ones();
        let normal = gradient.try_normalize(f32::EPSILON)?;
        let within = (sum / crossings as f32).map(|along| along.clamp(INSIDE, 1.0 - INSIDE));
        let voxel = key.voxel((z * BLOCK_EDGE + y) * BLOCK_EDGE + x);
        let place = |cell: i32, within: f32| {
            ((f64::from(cell) + f64::from(within)) * self.config.edge_m) as f32
        };
        let known = is_known.iter().filter(|known| **known).count() as f32;
        Some(SurfacePoint {
            voxel,
            position_m: Point3::new(
                place(voxel.x, within.x),
                place(voxel.y, within.y),
                place(voxel.z, within.z),
            ),
            normal,
            weight: weight / known,
            colour: colour_of_cell(next, [x, y, z], &values, &is_known),
        })
    }
}

/// The mean colour of the nodes, the nearer ones to the surface with more weight.
fn colour_of_cell(
    next: &[Option<&SurfaceBlock>; 8],
    [x, y, z]: [usize; 3],
    values: &[f32; 8],
    is_known: &[bool; 8],
) -> Option<[u8; 3]> {
    let (mut sum, mut shares) = (Vector3::zeros(), 0.0);
    for corner in (0..8).filter(|corner| is_known[*corner]) {
        let (x, y, z) = (x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
        let (step, index) = node_of(x, y, z);
        let colour = next[step].and_then(|block| block.colour.as_ref()).map(|colour| colour[index]);
        let Some(colour) = colour.filter(|colour| *colour != [0; 3]) else { continue };
        let share = 1.0 / (1.0 + values[corner].abs());
        sum += Vector3::from(colour.map(f32::from)) * share;
        shares += share;
    }
    // The cast saturates.
    (shares > 0.0).then(|| (sum / shares).map(|value| value.round() as u8).into())
}

/// The block, by the bits of its step, and the index in it of a node counted from the block's first.
fn node_of(x: usize, y: usize, z: usize) -> (usize, usize) {
    let step = (x / BLOCK_EDGE) | ((y / BLOCK_EDGE) << 1) | ((z / BLOCK_EDGE) << 2);
    let within = |along: usize| along % BLOCK_EDGE;
    (step, (within(z) * BLOCK_EDGE + within(y)) * BLOCK_EDGE + within(x))
}

impl Nodes {
    fn of(next: &[Option<&SurfaceBlock>; 8], least_weight: u16) -> Self {
        let mut nodes = Self {
            distance: [[[0; NODES]; NODES]; NODES],
            known: [[0; NODES]; NODES],
            behind: [[0; NODES]; NODES],
            weight: [[[0; NODES]; NODES]; NODES],
        };
        let least_weight = least_weight.max(1);
        for z in 0..NODES {
            for y in 0..NODES {
                let (step, first) = node_of(0, y, z);
                if let Some(block) = next[step] {
                    let row = first..first + BLOCK_EDGE;
                    nodes.distance[z][y][..BLOCK_EDGE]
                        .copy_from_slice(&block.distance[row.clone()]);
                    nodes.weight[z][y][..BLOCK_EDGE].copy_from_slice(&block.weight[row]);
                }
                if let Some(block) = next[step | 1] {
                    nodes.distance[z][y][BLOCK_EDGE] = block.distance[first];
                    nodes.weight[z][y][BLOCK_EDGE] = block.weight[first];
                }
                let (mut known, mut behind) = (0, 0);
                for x in 0..NODES {
                    let is_known = nodes.weight[z][y][x] >= least_weight;
                    known |= u16::from(is_known) << x;
                    behind |= u16::from(is_known && nodes.distance[z][y][x] < 0) << x;
                }
                (nodes.known[z][y], nodes.behind[z][y]) = (known, behind);
            }
        }
        nodes
    }

    /// The cells of a row, as bits by x, with nodes on both sides of the surface.
    fn crossed_cells(&self, y: usize, z: usize) -> u16 {
        let (mut behind, mut before) = (0, 0);
        for (y, z) in [(y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1)] {
            let (known_here, behind_here) = (self.known[z][y], self.behind[z][y]);
            behind |= behind_here | behind_here >> 1;
            let before_here = known_here & !behind_here;
            before |= before_here | before_here >> 1;
        }
        behind & before & ((1 << BLOCK_EDGE) - 1)
    }
}
