mod fields;
mod listeners;
mod scenes;

use std::collections::BTreeMap;

use geometry::VoxelKey;

use super::super::block::FULL;
use super::super::*;
use super::{BlockMesh, GridEdge};

/// A vertex by the edge of the grid that it is on.
type Vertex = (VoxelKey, usize);

fn config(edge_m: f64) -> SurfaceConfig {
    SurfaceConfig { edge_m, ..SurfaceConfig::default() }
}

/// A surface of the blocks from `-half` to `half` an axis, this one not included. `distance` says how many edges a node is before
/// the surface; nothing is known where it says `None`.
fn field(edge_m: f64, half: i32, distance: impl Fn([i32; 3]) -> Option<f32>) -> Surface {
    let mut surface = Surface::new(config(edge_m)).unwrap();
    let truncation = surface.config().truncation_in_edges as f32;
    let range = -half..half;
    for (x, (y, z)) in range
        .clone()
        .flat_map(|x| range.clone().flat_map(move |y| (-half..half).map(move |z| (x, (y, z)))))
    {
        let key = BlockKey { x, y, z };
        let mut block = SurfaceBlock::default();
        for index in 0..512 {
            let VoxelKey { x, y, z } = key.voxel(index);
            if let Some(distance) = distance([x, y, z]) {
                block.distance[index] = ((distance / truncation).clamp(-1.0, 1.0) * FULL) as i16;
                block.weight[index] = 1;
            }
        }
        surface.layer.insert(key, Some(Box::new(block)));
    }
    surface
}

fn mesh_of(surface: &Surface, key: BlockKey) -> BlockMesh {
    let mut mesh = BlockMesh::default();
    surface.mesh_of(key, PointRules::default(), &mut mesh);
    mesh
}

fn whole(surface: &Surface) -> geometry::TriangleMesh {
    surface.mesh(PointRules::default())
}

/// The triangles of all blocks, by the edges of the grid; each vertex is in one place to the bit.
fn keyed_triangles(surface: &Surface) -> Vec<[Vertex; 3]> {
    let mut places = BTreeMap::new();
    let mut triangles = Vec::new();
    for key in surface.block_keys() {
        let mesh = mesh_of(surface, key);
        let vertex = |edge: GridEdge| (edge.node_in(key), edge.axis());
        for of_block in &mesh.vertices {
            let bits = of_block.position_m.coords.map(f32::to_bits);
            let known = *places.entry(vertex(of_block.edge)).or_insert(bits);
            assert_eq!(known, bits, "{of_block:?} of {key:?}");
        }
        triangles.extend(mesh.corners().map(|corners| corners.map(|corner| vertex(corner.edge))));
    }
    triangles
}
