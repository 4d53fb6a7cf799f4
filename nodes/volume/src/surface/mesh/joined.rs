//! Blocks' triangles as one mesh: vertices on one edge of the grid are one vertex.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, NO_COLOUR, TriangleMesh, VoxelKey};
use nalgebra::Vector3;

use super::{BlockMesh, MeshVertex};
use crate::block::BlockKey;

/// No vertex on this axis' edge of a node.
const NONE: u32 = u32::MAX;

/// Joins the triangles of blocks, each of which is added once. The mesh depends on their order.
#[derive(Debug, Default)]
pub struct MeshJoiner {
    mesh: TriangleMesh,
    has_colour: bool,
    /// The vertices on the borders of blocks by node and axis. Looked up by key alone.
    on_borders: HashMap<VoxelKey, [u32; 3], BuildVoxelHasher>,
    indices: Vec<u32>,
}

impl MeshJoiner {
    /// Adds the triangles of a block.
    pub fn add(&mut self, key: BlockKey, mesh: &BlockMesh) {
        let mut indices = std::mem::take(&mut self.indices);
        indices.clear();
        indices.extend(mesh.vertices.iter().map(|vertex| self.index_of(key, vertex)));
        let of_mesh = |index: u16| indices.get(usize::from(index)).copied().unwrap_or_default();
        self.mesh.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(of_mesh)));
        self.indices = indices;
    }

    fn index_of(&mut self, key: BlockKey, vertex: &MeshVertex) -> u32 {
        let edge = vertex.edge;
        let new = self.mesh.points_m.len() as u32;
        if edge.is_on_border() {
            let known = self.on_borders.entry(edge.node_in(key)).or_insert([NONE; 3]);
            let known = &mut known[edge.axis()];
            if *known != NONE {
                if let Some(normal) = self.mesh.normals.get_mut(*known as usize) {
                    *normal += vertex.gradient;
                }
                return *known;
            }
            *known = new;
        }
        self.mesh.points_m.push(vertex.position_m);
        self.mesh.normals.push(vertex.gradient);
        self.has_colour |= vertex.colour.is_some();
        self.mesh.colours.push(vertex.colour.unwrap_or(NO_COLOUR));
        new
    }

    /// The mesh. Without colours where no vertex has one.
    #[must_use]
    pub fn finish(self) -> TriangleMesh {
        let mut mesh = self.mesh;
        if !self.has_colour {
            mesh.colours = Vec::new();
        }
        let mut flat = Vec::new();
        for (index, normal) in mesh.normals.iter_mut().enumerate() {
            match normal.try_normalize(f32::EPSILON) {
                Some(unit) => *normal = unit,
                None => flat.push(index),
            }
        }
        // The gradients cancel out where the surface is thin: there the triangles themselves say how it lies.
        if !flat.is_empty() {
            let mut of_triangles = vec![Vector3::zeros(); mesh.points_m.len()];
            for index in 0..mesh.triangles.len() {
                let normal = mesh.area_normal(index);
                for corner in mesh.triangles[index] {
                    of_triangles[corner as usize] += normal;
                }
            }
            for index in flat {
                let normal: Vector3<f32> = of_triangles[index];
                mesh.normals[index] = normal.try_normalize(0.0).unwrap_or_else(Vector3::z);
            }
        }
        mesh
    }
}
