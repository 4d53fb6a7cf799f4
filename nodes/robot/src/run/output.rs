//! The output folder of a run.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use geometry::{OccupancyGrid, OrientedPoints, TriangleMesh, pcd, ply};
use reconstruction::mesh::{self, MeshForm};
use report::{RunRecord, Summary};

use super::drawings::MapPng;
use crate::existing::refuse_to_replace;
use crate::failure::Failure;
use crate::unfinished::Unfinished;

/// The folder of the removed points, a cloud for each cycle.
const DYNAMIC_FOLDER: &str = "dynamic";

/// The parameters of the run, in the form that the nodes read.
const PARAMETERS: &str = "parameters.yaml";

/// The map as its node saves it in a run over DDS, until it is read.
const NODE_MAP: &str = "node_map.part.ply";

/// The page of the run.
pub(super) const REPORT: &str = "report.html";

/// The occupancy grid: the file that map_server is given, and its image.
const GRID: &str = "grid.yaml";
const GRID_IMAGE: &str = "grid.pgm";

/// The map.
const MAP_PLY: &str = "map.ply";
const MAP_PCD: &str = "map.pcd";

/// The files that a run writes to its folder, and its meshes: [`mesh_name`].
const RESULTS: [&str; 10] = [
    MAP_PLY,
    MAP_PCD,
    "summary.json",
    REPORT,
    PARAMETERS,
    "trajectory.txt",
    GRID_IMAGE,
    GRID,
    MAP_PICTURE,
    PAIR_PICTURE,
];

/// The pictures of the map: with what was removed, and without and with removal beside each other.
pub(super) const MAP_PICTURE: &str = "map.png";
pub(super) const PAIR_PICTURE: &str = "before_after.png";

/// The triangles.
fn mesh_name(form: MeshForm) -> String {
    format!("mesh.{}", form.extension())
}

/// Refuses a folder with the results of another run, unless `overwrite`.
///
/// # Errors
/// With the first of them.
pub(super) fn refuse_results(out: &Path, overwrite: bool) -> Result<(), Failure> {
    let results = RESULTS.map(|name| out.join(name));
    let meshes = MeshForm::ALL.map(|form| out.join(mesh_name(form)));
    let removed = fs::read_dir(out.join(DYNAMIC_FOLDER)).into_iter().flatten().flatten();
    let removed = removed.map(|entry| entry.path()).filter(|path| is_removed_cloud(path));
    let results = results.into_iter().chain(meshes).chain(removed);
    refuse_to_replace(results, overwrite, "--out")
}

/// The output folder of a run. It is removed if nothing is written to it.
pub(crate) struct OutputFolder {
    path: PathBuf,
    /// The parameter file under its temporary name; the nodes of the run read it.
    parameters: PathBuf,
    is_new: bool,
}

impl OutputFolder {
    /// Creates the folder before the work starts, so that a folder that cannot be written is an error at the start and not at
    /// the end. The results of an earlier run stay until this one has results.
    pub(crate) fn create(path: &Path, parameters_yaml: &str) -> Result<Self, Failure> {
        let parameters = path.join(format!("{PARAMETERS}.part"));
        let folder = Self { path: path.to_owned(), parameters, is_new: !path.exists() };
        let dynamic = path.join(DYNAMIC_FOLDER);
        fs::create_dir_all(&dynamic).map_err(|error| cannot_write(&dynamic, &error))?;
        let file = folder.parameters();
        fs::write(file, parameters_yaml).map_err(|error| cannot_write(file, &error))?;
        Ok(folder)
    }

    /// The file of the parameters while the run goes on.
    pub(crate) fn parameters(&self) -> &Path {
        &self.parameters
    }

    /// The removed clouds of an earlier run would mix with the new ones.
    fn clear_removed_clouds(&self) -> Result<(), Failure> {
        let dynamic = self.path.join(DYNAMIC_FOLDER);
        for entry in fs::read_dir(&dynamic).map_err(|error| cannot_write(&dynamic, &error))? {
            let path = entry.map_err(|error| cannot_write(&dynamic, &error))?.path();
            if is_removed_cloud(&path) {
                fs::remove_file(&path).map_err(|error| cannot_write(&path, &error))?;
            }
        }
        Ok(())
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the results of a run: the map, the removed clouds, the summary and the report.
    pub(crate) fn write(&self, record: &RunRecord, summary: &Summary) -> Result<(), Failure> {
        let parameters = self.path.join(PARAMETERS);
        fs::rename(&self.parameters, &parameters)
            .map_err(|error| cannot_write(&parameters, &error))?;
        let points = OrientedPoints {
            points_m: record.static_map.clone(),
            normals: record.map_normals.clone(),
            colours: record.map_colours.clone(),
        };
        self.write_map(&points, record)?;
        self.clear_removed_clouds()?;
        for cycle in record.cycles.iter().filter(|cycle| !cycle.dynamic_points_m.is_empty()) {
            let name = format!("{DYNAMIC_FOLDER}/cycle_{:06}.ply", cycle.index);
            self.write_file(&name, &ply::encode(&cycle.dynamic_points_m))?;
        }
        let json = summary
            .to_json()
            .map_err(|error| Failure::new(format!("cannot write summary.json: {error}")))?;
        self.write_file("summary.json", json.as_bytes())?;
        let report = report::report_html(record, summary)
            .map_err(|error| Failure::new(format!("cannot draw the report: {error}")))?;
        self.write_file(REPORT, report.as_bytes())
    }

    /// Writes the map. One without a point is no file: the map of an earlier run is removed.
    fn write_map(&self, points: &OrientedPoints, record: &RunRecord) -> Result<(), Failure> {
        let OrientedPoints { points_m, normals, colours } = points;
        if points_m.is_empty() {
            return [MAP_PLY, MAP_PCD].iter().try_for_each(|name| self.remove_file(name));
        }
        self.write_file(MAP_PLY, &ply::encode_map(points, &record.map_views))?;
        self.write_file(MAP_PCD, &pcd::encode_with_colours(points_m, normals, colours))
    }

    /// Where the node of the map saves it, for another process: a file that does not exist.
    pub(super) fn node_map_file(&self) -> Result<PathBuf, Failure> {
        self.remove_file(NODE_MAP)?;
        let file = self.path.join(NODE_MAP);
        std::path::absolute(&file).map_err(|error| cannot_write(&file, &error))
    }

    /// Where the occupancy grid goes, for another process.
    pub(super) fn grid_file(&self) -> Result<PathBuf, Failure> {
        let file = self.path.join(GRID);
        std::path::absolute(&file).map_err(|error| cannot_write(&file, &error))
    }

    /// When the grid that is there was saved.
    pub(super) fn grid_saved_at(&self) -> Option<SystemTime> {
        fs::metadata(self.path.join(GRID)).and_then(|file| file.modified()).ok()
    }

    /// Removes the grid of an earlier run: it is none of this one's map.
    pub(super) fn remove_grid(&self) -> Result<(), Failure> {
        [GRID, GRID_IMAGE].iter().try_for_each(|name| self.remove_file(name))
    }

    fn remove_file(&self, name: &str) -> Result<(), Failure> {
        let path = self.path.join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(cannot_write(&path, &error)),
            _ => Ok(()),
        }
    }

    /// Where the triangles go, for another process.
    pub(super) fn mesh_file(&self, form: MeshForm) -> Result<PathBuf, Failure> {
        let file = self.path.join(mesh_name(form));
        std::path::absolute(&file).map_err(|error| cannot_write(&file, &error))
    }

    /// When the triangles that are there were saved.
    pub(super) fn mesh_saved_at(&self, form: MeshForm) -> Option<SystemTime> {
        fs::metadata(self.path.join(mesh_name(form))).and_then(|file| file.modified()).ok()
    }

    /// Writes the triangles.
    pub(super) fn write_mesh(&self, mesh: &TriangleMesh, form: MeshForm) -> Result<(), Failure> {
        let bytes =
            mesh::encode(mesh, form).map_err(|error| Failure::new(format!("--mesh: {error}")))?;
        self.write_file(&mesh_name(form), &bytes)
    }

    /// Removes the triangles of an earlier run: they are none of this one's map.
    pub(super) fn remove_meshes_but(&self, written: Option<MeshForm>) -> Result<(), Failure> {
        let former = MeshForm::ALL.into_iter().filter(|form| Some(*form) != written);
        former.map(mesh_name).try_for_each(|name| self.remove_file(&name))
    }

    /// Writes the occupancy grid; the file that names the image last.
    pub(super) fn write_grid(&self, grid: &OccupancyGrid) -> Result<(), Failure> {
        self.write_file(GRID_IMAGE, &grid.pgm())?;
        self.write_file(GRID, grid.map_yaml(GRID_IMAGE).as_bytes())
    }

    /// Writes the pictures of the map, or removes those of an earlier run.
    pub(super) fn write_pictures(&self, pictures: Option<&MapPng>) -> Result<(), Failure> {
        let Some(MapPng { map, before_after }) = pictures else {
            return [MAP_PICTURE, PAIR_PICTURE].iter().try_for_each(|name| self.remove_file(name));
        };
        self.write_file(MAP_PICTURE, map)?;
        self.write_file(PAIR_PICTURE, before_after)
    }

    /// Writes under a temporary name first: a reader never finds half a file.
    fn write_file(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        let path = self.path.join(name);
        let temporary = Unfinished::beside(&path);
        fs::write(temporary.path(), bytes)
            .and_then(|()| temporary.becomes(&path))
            .map_err(|error| cannot_write(&path, &error))
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // If there are results, these do not exist or are not empty, and stay.
        let _ = fs::remove_file(&self.parameters);
        let _ = fs::remove_file(self.path.join(NODE_MAP));
        let _ = fs::remove_dir(self.path.join(DYNAMIC_FOLDER));
        if self.is_new {
            let _ = fs::remove_dir(&self.path);
        }
    }
}

fn is_removed_cloud(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.starts_with("cycle_") && name.ends_with(".ply")
}

fn cannot_write(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(format!("cannot write {}: {error}", path.display()))
        .fix("give a folder that can be written with --out")
}
