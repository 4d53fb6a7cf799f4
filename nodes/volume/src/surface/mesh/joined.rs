//! Blocks' triangles as one mesh: vertices on one edge of the grid are one vertex.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, NO_COLOUR, TriangleMesh, VoxelKey};
use nalgebra::Vector3;

use super::{BlockMesh, MeshVertex};
use crate::block::BlockKey;

/// A colour reaches so many sides of triangles, a third of a metre at 2 cm: the strips beside image borders and behind edges that the
/// depth camera sees and the colour camera does not.
const COLOUR_REACH_SIDES: u32 = 16;
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

    /// The mesh. A vertex without a colour has that of one near to it; without colours where no vertex has one.
    #[must_use]
    pub fn finish(self) -> TriangleMesh {
        let mut mesh = self.mesh;
        if self.has_colour {
            spread_colours(&mut mesh);
        } else {
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

/// Gives vertices without a colour that of the nearest one that has one, by the number of sides of triangles between them.
fn spread_colours(mesh: &mut TriangleMesh) {
    let TriangleMesh { triangles, colours, .. } = mesh;
    let has_colour = |colours: &[[u8; 3]], corner: u32| colours[corner as usize] != NO_COLOUR;
    let lacks_one = |colours: &[[u8; 3]], corners: &[u32; 3]| {
        corners.iter().any(|corner| !has_colour(colours, *corner))
    };
    let mut waiting: Vec<[u32; 3]> =
        triangles.iter().copied().filter(|corners| lacks_one(colours, corners)).collect();
    for _ in 0..COLOUR_REACH_SIDES {
        // All of a round see the colours before it, so that a colour goes one side further.
        let mut given: Vec<(u32, [u8; 3])> = Vec::new();
        for corners in &waiting {
            if let Some(from) = corners.iter().find(|corner| has_colour(colours, **corner)) {
                let without = corners.iter().filter(|corner| !has_colour(colours, **corner));
                given.extend(without.map(|corner| (*corner, colours[*from as usize])));
            }
        }
        if given.is_empty() {
            break;
        }
        // Of several the first triangle's.
        for (corner, colour) in given.into_iter().rev() {
            colours[corner as usize] = colour;
        }
        waiting.retain(|corners| lacks_one(colours, corners));
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// A strip of triangles along x, 1 m apart, with the colours of its pairs of vertices.
    fn strip(colours: &[[u8; 3]]) -> TriangleMesh {
        let pairs = colours.len() as u32;
        let triangles = (0..pairs - 1).flat_map(|pair| {
            let first = 2 * pair;
            [[first, first + 2, first + 1], [first + 1, first + 2, first + 3]]
        });
        TriangleMesh {
            points_m: (0..2 * pairs)
                .map(|index| Point3::new((index / 2) as f32, (index % 2) as f32, 0.0))
                .collect(),
            normals: vec![Vector3::z(); 2 * colours.len()],
            colours: colours.iter().flat_map(|colour| [*colour; 2]).collect(),
            triangles: triangles.collect(),
        }
    }

    #[test]
    fn a_vertex_without_a_colour_has_that_of_the_nearest_one() {
        let (red, blue, none) = ([200, 0, 0], [0, 0, 200], NO_COLOUR);
        let mut mesh = strip(&[red, none, none, none, none, blue]);
        spread_colours(&mut mesh);
        assert_eq!(mesh.colours, strip(&[red, red, red, blue, blue, blue]).colours);
        // Far from all that was seen in colour there is none.
        let mut given = vec![none; 40];
        given[0] = red;
        let mut mesh = strip(&given);
        spread_colours(&mut mesh);
        let coloured = mesh.colours.iter().filter(|colour| **colour == red).count();
        assert!((2 * 16..=2 * 18).contains(&coloured), "{coloured}");
        assert_eq!(mesh.colours[79], none);
    }
}
