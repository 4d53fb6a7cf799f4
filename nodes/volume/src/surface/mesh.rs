//! The surface as triangles, block by block, by marching cubes on the signed distances (module `cases`).
//!
//! The vertices are on the edges of the grid between a node before and one behind the surface, where the distance, interpolated
//! linearly, is 0. A vertex depends on the two nodes of its edge alone: two blocks that share the edge have it in the same place to
//! the bit. A cell with a node of which nothing is known has no triangles, so the mesh ends where the known ends.
//!
//! This is derived here and not taken from a package: those that are kept (`isosurface`, `fast-surface-nets`) want a dense field
//! in which all is known, and do not say by which edge of the grid the vertices of two blocks are the same.

mod cases;
mod follower;
mod joined;
#[cfg(test)]
mod tests;

use geometry::{TriangleMesh, VoxelKey};
use nalgebra::{Point3, Vector3};

use super::block::SurfaceBlock;
use super::nodes::{NODES, Nodes, next_blocks, node_of};
use super::{PointRules, Surface};
use crate::block::{BLOCK_EDGE, BlockKey};
use cases::{CASES, Case, EDGES, STARTS};
pub use follower::{MeshChange, MeshFollower};
pub use joined::MeshJoiner;

/// A vertex stays so far away from the nodes of its edge, in edges: where a distance is 0, triangles would have no area.
const FROM_NODES: f32 = 1e-3;
/// No vertex has been made for an edge of the grid yet.
const NO_VERTEX: u16 = u16::MAX;
/// The edges of the grid along the three axes from each node of a block and its neighbours.
const GRID_EDGES: usize = 3 * NODES * NODES * NODES;

/// An edge of the grid, counted within a block: it goes from a node along an axis.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct GridEdge(u16);

impl GridEdge {
    fn of([x, y, z]: [usize; 3], axis: usize) -> Self {
        Self((((axis * NODES + z) * NODES + y) * NODES + x) as u16)
    }

    /// The node, from 0 to 8 along each axis.
    fn node(self) -> [usize; 3] {
        let index = usize::from(self.0);
        [index % NODES, index / NODES % NODES, index / (NODES * NODES) % NODES]
    }

    fn axis(self) -> usize {
        usize::from(self.0) / (NODES * NODES * NODES)
    }

    /// Whether other blocks have it, too.
    fn is_on_border(self) -> bool {
        let axis = self.axis();
        (0..3).any(|across| across != axis && self.node()[across].is_multiple_of(BLOCK_EDGE))
    }

    /// The node, in the grid of all blocks.
    fn node_in(self, key: BlockKey) -> VoxelKey {
        let first = key.voxel(0);
        let [x, y, z] = self.node().map(|along| along as i32);
        VoxelKey {
            x: first.x.saturating_add(x),
            y: first.y.saturating_add(y),
            z: first.z.saturating_add(z),
        }
    }
}

/// A corner of triangles of one block.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MeshVertex {
    /// Where it is, in the map.
    pub position_m: Point3<f32>,
    /// The gradient of the distance, summed over the cells of the block that meet there: to the side from which the surface was
    /// seen, of any length.
    pub gradient: Vector3<f32>,
    /// Red, green, blue, where colours are kept and were seen.
    pub colour: Option<[u8; 3]>,
    /// The edge of the grid that it is on,
    edge: GridEdge,
    /// and the share of it before the vertex.
    along: f32,
}

/// The triangles of one block.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct BlockMesh {
    /// Each once.
    pub vertices: Vec<MeshVertex>,
    /// Indices of vertices, counterclockwise as seen from free space.
    pub triangles: Vec<[u16; 3]>,
}

impl BlockMesh {
    /// Forgets everything but the memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.triangles.clear();
    }

    /// Whether there is no triangle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The triangles by themselves: the normals at the border of the block are those of its own cells.
    #[must_use]
    pub fn alone(&self) -> TriangleMesh {
        let mut joiner = MeshJoiner::default();
        joiner.add(BlockKey::default(), self);
        joiner.finish()
    }

    /// The corners of each triangle.
    pub fn corners(&self) -> impl Iterator<Item = [&MeshVertex; 3]> {
        let vertex = |index: u16| self.vertices.get(usize::from(index));
        self.triangles
            .iter()
            .filter_map(move |&[a, b, c]| Some([vertex(a)?, vertex(b)?, vertex(c)?]))
    }
}

impl Surface {
    /// The triangles of all blocks, joined, in ascending order of the blocks.
    #[must_use]
    pub fn mesh(&self, rules: PointRules) -> TriangleMesh {
        let (mut joiner, mut mesh) = (MeshJoiner::default(), BlockMesh::default());
        for key in self.block_keys() {
            self.mesh_of(key, rules, &mut mesh);
            joiner.add(key, &mesh);
        }
        joiner.finish()
    }

    /// Puts the triangles of one block, in ascending order of the cells' indices, in the place of what `mesh` has: those of the
    /// cells between its nodes, and between these and the first ones of the next block along each axis. A block that does not
    /// exist has none.
    pub fn mesh_of(&self, key: BlockKey, rules: PointRules, mesh: &mut BlockMesh) {
        self.mesh_among(|key| self.block(key), key, rules, mesh);
    }

    /// [`Surface::mesh_of`] a surface of which a part is in another one of the same voxels.
    pub fn mesh_of_both(
        &self,
        other: &Self,
        key: BlockKey,
        rules: PointRules,
        mesh: &mut BlockMesh,
    ) {
        self.mesh_among(|key| self.block(key).or_else(|| other.block(key)), key, rules, mesh);
    }

    fn mesh_among<'a>(
        &self,
        block_at: impl Fn(BlockKey) -> Option<&'a SurfaceBlock>,
        key: BlockKey,
        rules: PointRules,
        mesh: &mut BlockMesh,
    ) {
        mesh.clear();
        let Some(block) = block_at(key) else { return };
        let next = next_blocks(block_at, key, block);
        let nodes = Nodes::of(&next, rules.least_weight);
        let edge_m = self.config.edge_m;
        let mut making =
            Making { key, edge_m, nodes: &nodes, next: &next, made: [NO_VERTEX; GRID_EDGES], mesh };
        for z in 0..BLOCK_EDGE {
            for y in 0..BLOCK_EDGE {
                let mut cells = nodes.crossed_cells(y, z) & nodes.known_cells(y, z);
                while cells != 0 {
                    let x = cells.trailing_zeros() as usize;
                    cells &= cells - 1;
                    making.add_cell([x, y, z]);
                }
            }
        }
    }
}

/// The mesh of a block while it is made.
struct Making<'a> {
    key: BlockKey,
    edge_m: f64,
    nodes: &'a Nodes,
    next: &'a [Option<&'a SurfaceBlock>; 8],
    /// By edge of the grid.
    made: [u16; GRID_EDGES],
    mesh: &'a mut BlockMesh,
}

impl Making<'_> {
    fn add_cell(&mut self, [x, y, z]: [usize; 3]) {
        let Some(case) = CASES.get(self.nodes.behind_corners([x, y, z])) else { return };
        let values: [f32; 8] = [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: usize| {
            let (x, y, z) = (x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
            f32::from(self.nodes.distance[z][y][x])
        });
        let gradient = Vector3::new(
            values[1] - values[0] + values[3] - values[2] + values[5] - values[4] + values[7]
                - values[6],
            values[2] - values[0] + values[3] - values[1] + values[6] - values[4] + values[7]
                - values[5],
            values[4] - values[0] + values[5] - values[1] + values[6] - values[2] + values[7]
                - values[3],
        );
        let vertices = self.vertices_of(case, [x, y, z], &values, &gradient);
        for triangle in case.triangles() {
            self.mesh.triangles.push(triangle.map(|edge| vertices[usize::from(edge)]));
        }
    }

    /// The vertices of a cell by its edges.
    fn vertices_of(
        &mut self,
        case: &Case,
        [x, y, z]: [usize; 3],
        values: &[f32; 8],
        gradient: &Vector3<f32>,
    ) -> [u16; EDGES] {
        let mut vertices = [NO_VERTEX; EDGES];
        let mut crossed = case.crossed;
        while crossed != 0 {
            let edge = crossed.trailing_zeros() as usize;
            crossed &= crossed - 1;
            let (axis, start) = (edge / 4, usize::from(STARTS[edge]));
            let node = [x + (start & 1), y + (start >> 1 & 1), z + (start >> 2)];
            let grid_edge = GridEdge::of(node, axis);
            let made = &mut self.made[usize::from(grid_edge.0)];
            if *made == NO_VERTEX {
                *made = self.mesh.vertices.len() as u16;
                let (from, to) = (values[start], values[start | 1 << axis]);
                self.add_vertex(grid_edge, from, to);
            }
            let made = self.made[usize::from(grid_edge.0)];
            if let Some(vertex) = self.mesh.vertices.get_mut(usize::from(made)) {
                vertex.gradient += gradient;
            }
            vertices[edge] = made;
        }
        vertices
    }

    /// Adds the vertex of an edge of the grid between two nodes with these distances.
    fn add_vertex(&mut self, edge: GridEdge, from: f32, to: f32) {
        let along = (from / (from - to)).clamp(FROM_NODES, 1.0 - FROM_NODES);
        let node = edge.node_in(self.key);
        let mut place = [node.x, node.y, node.z].map(f64::from);
        place[edge.axis()] += f64::from(along);
        let position_m = place.map(|along| (along * self.edge_m) as f32).into();
        let colour = self.colour_at(edge, along);
        let gradient = Vector3::zeros();
        self.mesh.vertices.push(MeshVertex { position_m, gradient, colour, edge, along });
    }

    /// That of the two nodes, the nearer one with more weight; of one alone where the other has none.
    fn colour_at(&self, edge: GridEdge, along: f32) -> Option<[u8; 3]> {
        let colour_of = |[x, y, z]: [usize; 3]| {
            let (step, index) = node_of(x, y, z);
            let colours = self.next[step].and_then(|block| block.colour.as_ref())?;
            Some(colours[index]).filter(|colour| *colour != geometry::NO_COLOUR)
        };
        let (start, mut end) = (edge.node(), edge.node());
        end[edge.axis()] += 1;
        match (colour_of(start), colour_of(end)) {
            (Some(start), Some(end)) => Some([0, 1, 2].map(|part: usize| {
                let (start, end) = (f32::from(start[part]), f32::from(end[part]));
                // The cast saturates.
                (start + (end - start) * along).round() as u8
            })),
            (start, end) => start.or(end),
        }
    }
}
