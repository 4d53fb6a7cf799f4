//! The file of the map as triangles.

use std::path::{Path, PathBuf};

use geometry::TriangleMesh;
use node_shell::{NodeFailure, output_file, write_whole_file};

use crate::mesh::{self, MeshForm};

/// The path of the file, and its form.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct MeshFile {
    path: PathBuf,
    form: MeshForm,
}

impl MeshFile {
    /// The file at the path of `parameter`, none for an empty path. A path that cannot be written is an error now.
    pub(super) fn new(parameter: &str, path: &str) -> Result<Option<Self>, NodeFailure> {
        let Some(path) = output_file(parameter, path)? else { return Ok(None) };
        let shown = path.display();
        let extension = path.extension().and_then(|extension| extension.to_str());
        let Some(form) = extension.and_then(MeshForm::of_extension) else {
            return Err(format!(
                "parameter {parameter} must end in .ply, .obj or .glb, not {shown}"
            )
            .into());
        };
        Ok(Some(Self { path, form }))
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the triangles under a temporary name first.
    ///
    /// # Errors
    /// When the folder cannot be written or is full; the file is then unchanged.
    pub(super) fn write(&self, mesh: &TriangleMesh) -> Result<(), NodeFailure> {
        let failed = |reason: &dyn std::fmt::Display| {
            format!("the mesh could not be saved to {}: {reason}", self.path.display())
        };
        let bytes = mesh::encode(mesh, self.form).map_err(|error| failed(&error))?;
        write_whole_file(&self.path, &bytes).map_err(|error| failed(&error))?;
        Ok(())
    }
}
