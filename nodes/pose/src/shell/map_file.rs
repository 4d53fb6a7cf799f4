//! The map of keyframes as a file.

use std::fs;
use std::path::PathBuf;

use node_shell::{NodeFailure, folder_of, write_whole_file};

use crate::saved_map::SavedMap;

/// Where the map is saved, or loaded from.
#[derive(Clone, Debug)]
pub(super) struct MapFile {
    path: PathBuf,
}

impl MapFile {
    /// The file at the path that `parameter` has; none for an empty path. What cannot be written is found out now, not when
    /// there is a map to lose.
    pub(super) fn new(parameter: &str, path: &str) -> Result<Option<Self>, NodeFailure> {
        if path.is_empty() {
            return Ok(None);
        }
        let path = PathBuf::from(path);
        if !folder_of(&path).is_dir() {
            return Err(format!(
                "parameter {parameter}: the folder of {} does not exist",
                path.display()
            )
            .into());
        }
        Ok(Some(Self::at(path)))
    }

    pub(super) fn at(path: PathBuf) -> Self {
        Self { path }
    }

    /// Saves the map whole or not at all. Returns what was done.
    pub(super) fn save(&self, saved: &SavedMap) -> Result<String, NodeFailure> {
        let failed = |reason: &dyn std::fmt::Display| {
            format!("the map could not be saved to {}: {reason}", self.path.display())
        };
        let bytes = saved.encode().map_err(|error| failed(&error))?;
        write_whole_file(&self.path, &bytes).map_err(|error| failed(&error))?;
        let done = format!(
            "saved a map of {} to {} ({:.1} MB)",
            contents(saved),
            self.path.display(),
            1e-6 * bytes.len() as f64
        );
        tracing::info!("{done}");
        Ok(done)
    }

    /// What was saved.
    pub(super) fn load(&self) -> Result<SavedMap, NodeFailure> {
        let failed = |reason: &dyn std::fmt::Display| {
            format!("the map could not be loaded from {}: {reason}", self.path.display())
        };
        let bytes = fs::read(&self.path).map_err(|error| failed(&error))?;
        Ok(SavedMap::decode(&bytes).map_err(|error| failed(&error))?)
    }

    /// What was done, when it was loaded.
    pub(super) fn loaded(&self, saved: &SavedMap) -> String {
        format!("loaded a map of {} from {}", contents(saved), self.path.display())
    }
}

fn contents(saved: &SavedMap) -> String {
    let map = &saved.map;
    format!(
        "{} keyframes, {} points and {} lines",
        map.keyframes().len(),
        map.points().len(),
        map.lines().len()
    )
}
