//! The map as triangles: of a running map ([`crate::SurfaceMap::mesh`]), of a saved one ([`mesh_of_points`]), and as a file
//! ([`encode`]).
//!
//! | form | what |
//! |---|---|
//! | PLY | binary; vertices with normals and colours, for MeshLab, CloudCompare, Open3D |
//! | OBJ | text; a vertex's colour follows its coordinates, as MeshLab has it |
//! | GLB | binary glTF 2.0, for browsers, Blender and game engines |
//!
//! PLY and OBJ are in the map's frame. glTF's y axis points up: its node turns the map, whose z axis does (REP-103).

mod from_points;
mod glb;
mod obj;
#[cfg(test)]
mod tests;

use geometry::{TriangleMesh, ply};

use crate::tiles::TileError;
pub use from_points::{edge_of_map_points_m, mesh_of_points};

/// There is no mesh.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum MeshError {
    /// The map is one of means of points.
    #[error("there is no mesh: a map of the method rec_hv has no distances; free_space has them")]
    NoDistances,
    /// There are no triangles.
    #[error("there is no mesh: the map is empty")]
    NoTriangles,
    /// There are no triangles of points.
    #[error(
        "there is no mesh: the {points} points of the map join to no surface with voxels of {edge_m} m"
    )]
    NoSurface {
        /// The points.
        points: usize,
        /// The edge of the voxels.
        edge_m: f64,
    },
    /// The points are too far apart to be joined in voxels of this edge.
    #[error(
        "there is no mesh: the points are {spacing_m:.3} m apart, and with voxels of {edge_m} m nothing joins them; {least_m:.4} m \
         and more do"
    )]
    TooFine {
        /// The edge of the voxels.
        edge_m: f64,
        /// How far apart the points are.
        spacing_m: f64,
        /// The finest edge that joins them.
        least_m: f64,
    },
    /// There are too many blocks for the memory.
    #[error(
        "there is no mesh: with voxels of {edge_m} m it takes more than {max_blocks} blocks of 3.6 kB; a larger edge takes fewer"
    )]
    TooManyBlocks {
        /// The edge of the voxels.
        edge_m: f64,
        /// The bound.
        max_blocks: usize,
    },
    /// Points cannot be put into voxels of this edge.
    #[error(transparent)]
    Surface(#[from] volume::SurfaceConfigError),
    /// A tile of the map cannot be read.
    #[error("the mesh would be incomplete: {0}")]
    Unreadable(#[from] TileError),
    /// The form has no room for it.
    #[error(
        "a .glb has up to 4 GiB, and the mesh of {triangles} triangles needs more: write a .ply"
    )]
    TooLarge {
        /// Of the mesh.
        triangles: usize,
    },
    /// The JSON of glTF could not be written.
    #[error("the header of the .glb: {reason}")]
    Header {
        /// What the library says.
        reason: String,
    },
}

/// The form of a file of triangles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MeshForm {
    /// `.ply`
    Ply,
    /// `.obj`
    Obj,
    /// `.glb`
    Glb,
}

impl MeshForm {
    /// Each form.
    pub const ALL: [Self; 3] = [Self::Ply, Self::Obj, Self::Glb];

    /// How the name of such a file ends, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Obj => "obj",
            Self::Glb => "glb",
        }
    }

    /// The form of a file whose name ends so.
    #[must_use]
    pub fn of_extension(extension: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|form| form.extension().eq_ignore_ascii_case(extension))
    }
}

/// The bytes of a file of triangles.
///
/// # Errors
/// When there are none, or more than fit.
pub fn encode(mesh: &TriangleMesh, form: MeshForm) -> Result<Vec<u8>, MeshError> {
    if mesh.triangles.is_empty() {
        return Err(MeshError::NoTriangles);
    }
    match form {
        MeshForm::Ply => Ok(ply::encode_mesh(mesh)),
        MeshForm::Obj => Ok(obj::encode(mesh).into_bytes()),
        MeshForm::Glb => glb::encode(mesh),
    }
}
