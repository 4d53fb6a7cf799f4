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
use super::nodes::{Nodes, face_edges, next_blocks, node_of};
use crate::block::{BLOCK_EDGE, BlockKey};

/// The edges of each face of a cell.
const FACES: [u16; 6] = face_edges();
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
        let next = next_blocks(block_at, key, block);
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
