//! The folder that a run leaves behind.

use std::fs;
use std::path::{Path, PathBuf};

use geometry::{pcd, ply};
use report::{RunRecord, Summary};

use crate::failure::Failure;

/// Clouds of what was removed, one a cycle.
const DYNAMIC_FOLDER: &str = "dynamic";

/// The output folder of a run.
pub(crate) struct OutputFolder {
    path: PathBuf,
}

impl OutputFolder {
    /// Makes the folder before the work starts, so that a place that cannot be written is found out
    /// first and not last. What an earlier run left there stays until this one has results.
    pub(crate) fn create(path: &Path) -> Result<Self, Failure> {
        let folder = Self { path: path.to_owned() };
        let dynamic = path.join(DYNAMIC_FOLDER);
        fs::create_dir_all(&dynamic).map_err(|error| cannot_write(&dynamic, &error))?;
        Ok(folder)
    }

    /// The removed clouds of an earlier run would mix with the new ones.
    fn clear_removed_clouds(&self) -> Result<(), Failure> {
        let dynamic = self.path.join(DYNAMIC_FOLDER);
        for entry in fs::read_dir(&dynamic).map_err(|error| cannot_write(&dynamic, &error))? {
            let path = entry.map_err(|error| cannot_write(&dynamic, &error))?.path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            if name.starts_with("cycle_") && name.ends_with(".ply") {
                fs::remove_file(&path).map_err(|error| cannot_write(&path, &error))?;
            }
        }
        Ok(())
    }

    /// Writes the parameters of a run, in the form that the nodes read; returns the file's path.
    pub(crate) fn write_parameters(&self, yaml: &str) -> Result<PathBuf, Failure> {
        const NAME: &str = "parameters.yaml";
        self.write_file(NAME, yaml.as_bytes())?;
        Ok(self.path.join(NAME))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes all that a run found out: the map, the removed clouds, the summary and the report.
    pub(crate) fn write(&self, record: &RunRecord, summary: &Summary) -> Result<(), Failure> {
        self.write_file("map.ply", &ply::encode(&record.static_map))?;
        self.write_file("map.pcd", &pcd::encode(&record.static_map))?;
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
        self.write_file("report.html", report.as_bytes())
    }

    /// Under a temporary name first: a reader never finds half a file.
    fn write_file(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        let path = self.path.join(name);
        let temporary = self.path.join(format!("{name}.part"));
        fs::write(&temporary, bytes)
            .and_then(|()| fs::rename(&temporary, &path))
            .map_err(|error| cannot_write(&path, &error))
    }
}

fn cannot_write(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(format!("cannot write {}: {error}", path.display()))
        .fix("give a folder that can be written with --out")
}
