//! The surface as triangles, where `--mesh` asks for it.

use std::time::SystemTime;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use geometry::{PipelineConfig, TriangleMesh};
use reconstruction::{MeshError, MeshForm};

use super::output::OutputFolder;
use crate::failure::Failure;

/// Over DDS the node of the map says why.
const NO_MESH: &str = "reconstruction has saved no mesh: its log says why";

/// Reads the form of a mesh off the command line.
pub(super) fn form_parser() -> impl TypedValueParser<Value = MeshForm> {
    PossibleValuesParser::new(MeshForm::ALL.map(MeshForm::extension))
        .map(|text| MeshForm::of_extension(&text).unwrap_or(MeshForm::Glb))
}

/// Whether the map will have what a mesh is made of.
pub(super) fn check(form: Option<MeshForm>, pipeline: &PipelineConfig) -> Result<(), Failure> {
    if form.is_some() && !pipeline.needs_depth() {
        return Err(Failure::unusable(format!("--mesh: {}", MeshError::NoDistances))
            .fix("run with --method free_space"));
    }
    Ok(())
}

/// Writes the mesh, if it was made in this process, and removes those of an earlier run. Returns why there is none, though it was asked for.
pub(super) fn settle(
    folder: &OutputFolder,
    form: Option<MeshForm>,
    mesh: Option<Result<&TriangleMesh, MeshError>>,
    saved_before: Option<SystemTime>,
) -> Result<Option<Failure>, Failure> {
    let missing = match (form, mesh) {
        (None, _) => None,
        (Some(form), Some(Ok(mesh))) => {
            folder.write_mesh(mesh, form)?;
            None
        }
        (Some(_), Some(Err(error))) => Some(Failure::new(error.to_string())),
        (Some(form), None) => {
            (folder.mesh_saved_at(form) == saved_before).then(|| Failure::new(NO_MESH))
        }
    };
    folder.remove_meshes_but(form.filter(|_| missing.is_none()))?;
    Ok(missing)
}
