//! What is written at one time, by another thread.

use geometry::{OccupancyGrid, TriangleMesh};
use node_shell::NodeFailure;

use crate::shell::grid_output::GridFile;
use crate::shell::map_file::{MapFile, Saved, Snapshot};
use crate::shell::mesh_file::MeshFile;

/// What is to be written, as it was at one time.
pub(super) struct Job {
    /// The map, and whether its former file is kept.
    pub(super) map: Option<(MapFile, Snapshot, bool)>,
    /// The grid, and whether its former file is kept, or the reason why there is none.
    pub(super) grid: Option<Result<(GridFile, OccupancyGrid, bool), NodeFailure>>,
    /// The triangles, or the reason why there are none.
    pub(super) mesh: Option<Result<(MeshFile, TriangleMesh), NodeFailure>>,
}

/// What was written, or why not: none depends on the others.
pub(in crate::shell) struct Done {
    pub(super) map: Option<Result<Saved, NodeFailure>>,
    pub(super) grid: Option<Result<String, NodeFailure>>,
    pub(super) mesh: Option<Result<String, NodeFailure>>,
}

#[cfg(test)]
impl Done {
    pub(in crate::shell) fn map_failed(&self) -> bool {
        matches!(self.map, Some(Err(_)))
    }
}

impl Job {
    pub(super) fn write(self) -> Done {
        let map = self.map.map(|(file, snapshot, keeps)| file.write(snapshot, keeps));
        let grid = self.grid.map(|grid| {
            let (file, grid, keeps) = grid?;
            let former = file.write(&grid, keeps)?;
            let (width, height, path) = (grid.width, grid.height, file.path().display());
            let done = format!("a grid of {width} x {height} cells to {path}");
            let Some(former) = former else { return Ok(done) };
            tracing::info!(
                "the grid of scans begins anew; the former one is kept as {}",
                former.display()
            );
            Ok(format!("{done}; the former one is kept as {}", former.display()))
        });
        let mesh = self.mesh.map(|mesh| {
            let (file, mesh) = mesh?;
            file.write(&mesh)?;
            Ok(format!("a mesh of {} triangles to {}", mesh.triangles.len(), file.path().display()))
        });
        Done { map, grid, mesh }
    }
}
