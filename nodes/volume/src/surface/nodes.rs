//! The nodes that the cells of a block lie between: its own, and the first ones of the next blocks. And the cells' edges.

use super::block::SurfaceBlock;
use crate::block::{BLOCK_EDGE, BlockKey};

/// Nodes along the edge of a block with those of its neighbours.
pub(super) const NODES: usize = BLOCK_EDGE + 1;

/// See the module.
pub(super) struct Nodes {
    pub(super) distance: [[[i16; NODES]; NODES]; NODES],
    /// Bits by x of the nodes of a row: those that are sure enough, and those of them that are behind the surface.
    pub(super) known: [[u16; NODES]; NODES],
    pub(super) behind: [[u16; NODES]; NODES],
    pub(super) weight: [[[u16; NODES]; NODES]; NODES],
}

/// The edges of each face of a cell, as bits: edge `4 axis + n` is the `n`th of those along that axis, in the order of the corner
/// that it starts from. The faces come by axis, that of the lesser coordinate first.
pub(super) const fn face_edges() -> [u16; 6] {
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

/// A block and the next ones, by the bits of their steps along x, y and z.
pub(super) fn next_blocks<'a>(
    block_at: impl Fn(BlockKey) -> Option<&'a SurfaceBlock>,
    key: BlockKey,
    block: &'a SurfaceBlock,
) -> [Option<&'a SurfaceBlock>; 8] {
    [0, 1, 2, 3, 4, 5, 6, 7].map(|step: i32| {
        let beside = key.offset(step & 1, step >> 1 & 1, step >> 2);
        if step == 0 { Some(block) } else { block_at(beside) }
    })
}

/// The block, by the bits of its step, and the index in it of a node counted from the block's first.
pub(super) fn node_of(x: usize, y: usize, z: usize) -> (usize, usize) {
    let step = (x / BLOCK_EDGE) | ((y / BLOCK_EDGE) << 1) | ((z / BLOCK_EDGE) << 2);
    let within = |along: usize| along % BLOCK_EDGE;
    (step, (within(z) * BLOCK_EDGE + within(y)) * BLOCK_EDGE + within(x))
}

impl Nodes {
    pub(super) fn of(next: &[Option<&SurfaceBlock>; 8], least_weight: u16) -> Self {
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
    pub(super) fn crossed_cells(&self, y: usize, z: usize) -> u16 {
        let (mut behind, mut before) = (0, 0);
        for (y, z) in [(y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1)] {
            let (known_here, behind_here) = (self.known[z][y], self.behind[z][y]);
            behind |= behind_here | behind_here >> 1;
            let before_here = known_here & !behind_here;
            before |= before_here | before_here >> 1;
        }
        behind & before & ((1 << BLOCK_EDGE) - 1)
    }

    /// The cells of a row, as bits by x, whose corners are all known.
    pub(super) fn known_cells(&self, y: usize, z: usize) -> u16 {
        let rows = [(y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1)];
        rows.iter()
            .fold(u16::MAX, |known, (y, z)| known & self.known[*z][*y] & self.known[*z][*y] >> 1)
    }

    /// The corners of a cell that are behind the surface, as bits: a corner's number has a bit for each axis.
    pub(super) fn behind_corners(&self, [x, y, z]: [usize; 3]) -> usize {
        let pair = |y: usize, z: usize| usize::from(self.behind[z][y] >> x & 0b11);
        pair(y, z) | pair(y + 1, z) << 2 | pair(y, z + 1) << 4 | pair(y + 1, z + 1) << 6
    }
}
