//! A surface of triangles that share their vertices.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use crate::Stamp;

/// A surface of triangles. See the fields.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct TriangleMesh {
    /// The vertices, in metres.
    pub points_m: Vec<Point3<f32>>,
    /// For each vertex, of length 1.
    pub normals: Vec<Vector3<f32>>,
    /// For each vertex red, green and blue, or [`crate::NO_COLOUR`]; none at all where no vertex has one.
    pub colours: Vec<[u8; 3]>,
    /// Indices of vertices, counterclockwise as seen from the side to which the normals point.
    pub triangles: Vec<[u32; 3]>,
}

/// The triangles of one block of a map, which take the place of those that a listener has of it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MeshPiece {
    /// The block, counted along x, y and z.
    pub block: [i32; 3],
    /// Its triangles; none where they have gone.
    pub mesh: TriangleMesh,
}

/// What a listener has to do to its copy of a mesh, in a frame at a moment.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MeshUpdate {
    /// The moment of the map.
    pub stamp: Stamp,
    /// The map's frame.
    pub frame_id: String,
    /// All that a listener has goes first: the map was emptied, replaced or corrected.
    pub is_anew: bool,
    /// What has changed.
    pub pieces: Vec<MeshPiece>,
}

/// How the triangles of a mesh share their edges.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MeshEdges {
    /// Edges of two triangles, which pass them in opposite directions.
    pub inner: usize,
    /// Edges of one triangle.
    pub border: usize,
    /// Edges of more triangles than two, or that two pass in one direction: the mesh is no manifold there.
    pub wrong: usize,
}

impl TriangleMesh {
    /// The corners of a triangle, by its index; `None` where there is none.
    #[must_use]
    pub fn corners_m(&self, triangle: usize) -> Option<[Point3<f32>; 3]> {
        let [a, b, c] = *self.triangles.get(triangle)?;
        let corner = |index: u32| self.points_m.get(index as usize).copied();
        Some([corner(a)?, corner(b)?, corner(c)?])
    }

    /// The normal of a triangle, twice as long as its area; 0 where there is none.
    #[must_use]
    pub fn area_normal(&self, triangle: usize) -> Vector3<f32> {
        self.corners_m(triangle).map_or_else(Vector3::zeros, |[a, b, c]| (b - a).cross(&(c - a)))
    }

    /// How the triangles share their edges.
    #[must_use]
    pub fn edges(&self) -> MeshEdges {
        // How often each edge is passed upwards and downwards.
        let mut passes: BTreeMap<(u32, u32), [usize; 2]> = BTreeMap::new();
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                passes.entry((from.min(to), from.max(to))).or_default()[usize::from(from > to)] +=
                    1;
            }
        }
        let mut edges = MeshEdges::default();
        for passes in passes.values() {
            match passes {
                [1, 1] => edges.inner += 1,
                [1, 0] | [0, 1] => edges.border += 1,
                _ => edges.wrong += 1,
            }
        }
        edges
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> TriangleMesh {
        let points_m = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        TriangleMesh {
            points_m: points_m.map(Point3::from).to_vec(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn a_closed_mesh_has_no_border() {
        let mut mesh = tetrahedron();
        assert_eq!(mesh.edges(), MeshEdges { inner: 6, ..MeshEdges::default() });
        assert_eq!(mesh.area_normal(0), -Vector3::z());
        mesh.triangles.pop();
        assert_eq!(mesh.edges(), MeshEdges { inner: 3, border: 3, wrong: 0 });
    }

    #[test]
    fn a_triangle_turned_over_or_twice_there_is_wrong() {
        let mut mesh = tetrahedron();
        mesh.triangles[3] = [1, 3, 2];
        assert_eq!(mesh.edges().wrong, 3);
        mesh = tetrahedron();
        mesh.triangles.push([0, 2, 1]);
        assert_eq!(mesh.edges().wrong, 3);
    }
}
