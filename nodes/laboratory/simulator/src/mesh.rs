//! Triangle meshes.

mod written;

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::bvh::{Aabb, Bvh};
use crate::{Hit, Ray};
use written::WrittenMesh;

/// A triangle mesh in its own frame, visible from both sides.
///
/// A scenario contains its vertices and triangles, or the name of a file; the reader of the scenario also reads that
/// file, and passes its triangles to [`crate::Scenario::with_meshes`].
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(try_from = "WrittenMesh", into = "WrittenMesh")]
pub struct Mesh(Arc<Surface>);

/// The data of a mesh; shared, since solids are made of it for every moment.
#[derive(PartialEq, Debug)]
struct Surface {
    file: Option<String>,
    scale: f64,
    vertices_m: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// The corners of each triangle, scaled.
    corners_m: Vec<[Point3<f64>; 3]>,
    tree: Bvh,
}

/// Invalid triangles.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum MeshError {
    /// A triangle refers to a missing vertex.
    #[error("triangle {triangle} has the corner {vertex}, but there are {vertices} vertices")]
    Vertex {
        /// The index of the triangle.
        triangle: usize,
        /// The index of the vertex.
        vertex: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A vertex is not finite or too far away.
    #[error("vertex {vertex} is at {coordinate}, which is not a finite number of metres below 1e6")]
    Coordinate {
        /// The index of the vertex.
        vertex: usize,
        /// Its coordinate.
        coordinate: f64,
    },
    /// The scale is not positive.
    #[error("the scale is {scale}, but must be positive")]
    Scale {
        /// Its value.
        scale: f64,
    },
    /// More triangles than this simulator accepts.
    #[error("{triangles} triangles are more than {MAX_TRIANGLES}")]
    TooMany {
        /// Their number.
        triangles: usize,
    },
}

/// The largest mesh: a detailed scan of a room.
const MAX_TRIANGLES: usize = 1 << 22;
/// The largest coordinate.
const MAX_LENGTH_M: f64 = 1e6;
/// Triangles are enlarged by this share, so that no ray passes between two of them.
const EDGE_MARGIN: f64 = 1e-9;

impl Mesh {
    /// A mesh of these triangles; corners are indices of vertices.
    ///
    /// # Errors
    /// When a corner is not a vertex, a vertex is invalid, or there are too many triangles.
    pub fn new(vertices_m: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        Self::build(None, 1.0, vertices_m, triangles)
    }

    /// The file whose triangles are not loaded yet.
    #[must_use]
    pub fn missing_file(&self) -> Option<&str> {
        self.0.file.as_deref().filter(|_| self.0.triangles.is_empty())
    }

    /// The same mesh with the triangles of its file.
    ///
    /// # Errors
    /// As [`Mesh::new`].
    pub fn filled(
        &self,
        vertices_m: Vec<[f64; 3]>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        Self::build(self.0.file.clone(), self.0.scale, vertices_m, triangles)
    }

    /// The number of triangles.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.0.triangles.len()
    }

    fn build(
        file: Option<String>,
        scale: f64,
        vertices_m: Vec<[f64; 3]>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(MeshError::Scale { scale });
        }
        if triangles.len() > MAX_TRIANGLES {
            return Err(MeshError::TooMany { triangles: triangles.len() });
        }
        for (vertex, place_m) in vertices_m.iter().enumerate() {
            let within = |coordinate: f64| (coordinate * scale).abs() <= MAX_LENGTH_M;
            if let Some(&coordinate) = place_m.iter().find(|coordinate| !within(**coordinate)) {
                return Err(MeshError::Coordinate { vertex, coordinate });
            }
        }
        let corner = |triangle: usize, vertex: u32| {
            let place_m = vertices_m.get(vertex as usize).copied();
            let vertices = vertices_m.len();
            place_m.map(|place_m| Point3::from(place_m) * scale).ok_or(MeshError::Vertex {
                triangle,
                vertex,
                vertices,
            })
        };
        let corners_m = triangles
            .iter()
            .enumerate()
            .map(|(at, [a, b, c])| Ok([corner(at, *a)?, corner(at, *b)?, corner(at, *c)?]))
            .collect::<Result<Vec<_>, MeshError>>()?;
        let boxes: Vec<Aabb> = corners_m.iter().map(bounds).collect();
        let tree = Bvh::new(&boxes);
        Ok(Self(Arc::new(Surface { file, scale, vertices_m, triangles, corners_m, tree })))
    }

    /// Half the extent along each axis of the smallest cuboid around the origin that contains it.
    pub(crate) fn half_extent_m(&self) -> Vector3<f64> {
        let corners = self.0.corners_m.iter().flatten();
        corners.fold(Vector3::zeros(), |half, corner| half.sup(&corner.coords.abs()))
    }

    /// The first hit of a ray; the normal points to the side that the ray comes from.
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let triangle = |index: usize| self.0.corners_m.get(index);
        let (index, parameter) =
            self.0.tree.nearest(ray, |index| intersect_triangle(triangle(index)?, ray))?;
        let [a, b, c] = triangle(index)?;
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
        let towards_ray = if normal.dot(&ray.direction) > 0.0 { -normal } else { normal };
        Some(Hit { parameter, normal: towards_ray })
    }
}

fn bounds(corners: &[Point3<f64>; 3]) -> Aabb {
    corners
        .iter()
        .fold(Aabb::NONE, |all, corner| all.joined(&Aabb { least: *corner, most: *corner }))
}

/// The parameter at which a ray crosses a triangle (Moeller and Trumbore 1997).
fn intersect_triangle([a, b, c]: &[Point3<f64>; 3], ray: &Ray) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let across = ray.direction.cross(&ac);
    let determinant = ab.dot(&across);
    let from_a = ray.origin - a;
    let u = from_a.dot(&across) / determinant;
    let turned = from_a.cross(&ab);
    let v = ray.direction.dot(&turned) / determinant;
    let parameter = ac.dot(&turned) / determinant;
    // A ray in the triangle's plane gives NaN, and no hit.
    let within = u >= -EDGE_MARGIN && v >= -EDGE_MARGIN && u + v <= 1.0 + EDGE_MARGIN;
    (within && parameter > 0.0 && parameter.is_finite()).then_some(parameter)
}

#[cfg(test)]
mod tests;
