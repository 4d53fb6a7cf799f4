//! The YAML form of a mesh.

use serde::{Deserialize, Serialize};

use super::{Mesh, MeshError};

/// A file, or vertices and triangles.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenMesh {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    #[serde(default = "one")]
    scale: f64,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    vertices_m: Vec<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    triangles: Vec<[u32; 3]>,
}

fn one() -> f64 {
    1.0
}

impl TryFrom<WrittenMesh> for Mesh {
    type Error = MeshError;

    fn try_from(written: WrittenMesh) -> Result<Self, MeshError> {
        Self::build(written.file, written.scale, written.vertices_m, written.triangles)
    }
}

impl From<Mesh> for WrittenMesh {
    fn from(Mesh(surface): Mesh) -> Self {
        Self {
            file: surface.file.clone(),
            scale: surface.scale,
            vertices_m: surface.vertices_m.clone(),
            triangles: surface.triangles.clone(),
        }
    }
}
