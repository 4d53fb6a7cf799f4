//! The checks of the node's parameters, and the settings of its shell.

use std::time::Duration;

use node_shell::NodeFailure;
use node_shell::parameters::NodeParameters;

use super::ReconstructionParameters;
use super::grid_output::GridFile;
use super::map_file::MapFile;
use super::mesh_file::MeshFile;
use super::schedule::Periods;
use crate::{GridSource, MeshError};

impl NodeParameters for ReconstructionParameters {
    fn validate_node(&self) -> Result<(), NodeFailure> {
        Settings::of(self)?;
        Ok(())
    }
}

/// The parameters of the shell, checked.
pub(super) struct Settings {
    pub(super) periods: Periods,
    pub(super) most_update_points: usize,
    /// The file that the map is loaded from at the start, and saved to.
    pub(super) file: Option<MapFile>,
    pub(super) save_period: Duration,
    pub(super) grid_period: Duration,
    /// The files of the occupancy grid, where one is made.
    pub(super) grid_file: Option<GridFile>,
    pub(super) mesh_period: Duration,
    pub(super) most_mesh_triangles: usize,
    /// The file of the triangles.
    pub(super) mesh_file: Option<MeshFile>,
}

impl Settings {
    /// # Errors
    /// When a parameter is out of its range.
    pub(super) fn of(parameters: &ReconstructionParameters) -> Result<Self, NodeFailure> {
        parameters.validate()?;
        super::spilling::check(parameters)?;
        let grid_file = GridFile::new("grid_file", &parameters.grid_file)?;
        let has_grid = parameters.config.grid.grid != GridSource::None;
        let mesh_file = MeshFile::new("mesh_file", &parameters.mesh_file)?;
        if mesh_file.is_some() && !parameters.config.pipeline.needs_depth() {
            return Err(format!("parameter mesh_file: {}", MeshError::NoDistances).into());
        }
        let file = MapFile::new("map_file", &parameters.map_file)?;
        let path = mesh_file.as_ref().map(MeshFile::path);
        if path.is_some() && path == file.as_ref().map(MapFile::path) {
            return Err("parameters map_file and mesh_file name one file".into());
        }
        Ok(Self {
            periods: Periods {
                map: Duration::try_from_secs_f64(parameters.map_publish_period_s)?,
                updates: Duration::try_from_secs_f64(parameters.map_update_period_s)?,
            },
            most_update_points: parameters.map_update_max_points,
            file,
            save_period: Duration::try_from_secs_f64(parameters.map_save_period_s)?,
            grid_period: Duration::try_from_secs_f64(parameters.grid_period_s)?,
            grid_file: grid_file.filter(|_| has_grid),
            mesh_period: Duration::try_from_secs_f64(parameters.mesh_update_period_s)?,
            most_mesh_triangles: parameters.mesh_update_max_triangles,
            mesh_file,
        })
    }
}
