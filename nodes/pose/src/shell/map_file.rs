//! The map of keyframes as a file.

use std::fs;
use std::io;
use std::path::PathBuf;

use node_shell::{NodeFailure, keep_version, output_file, write_whole_file};

use crate::saved_map::SavedMap;

/// Where the map is saved, or loaded from.
#[derive(Clone, Debug)]
pub(super) struct MapFile {
    path: PathBuf,
}

impl MapFile {
    /// The file at the path that `parameter` has; none for an empty path ([`output_file`]).
    pub(super) fn new(parameter: &str, path: &str) -> Result<Option<Self>, NodeFailure> {
        Ok(output_file(parameter, path)?.map(Self::at))
    }

    pub(super) fn at(path: PathBuf) -> Self {
        Self { path }
    }

    /// Saves the map whole or not at all. A file that has more keyframes, or is no map, is kept as a numbered version
    /// ([`keep_version`]). Returns what was done.
    pub(super) fn save(&self, saved: &SavedMap) -> Result<String, NodeFailure> {
        let failed = |reason: &dyn std::fmt::Display| {
            format!("the map could not be saved to {}: {reason}", self.path.display())
        };
        let bytes = saved.encode().map_err(|error| failed(&error))?;
        let former = self.keep_former(saved).map_err(|error| failed(&error))?;
        write_whole_file(&self.path, &bytes).map_err(|error| failed(&error))?;
        let done = format!(
            "saved a map of {} to {} ({:.1} MB)",
            contents(saved),
            self.path.display(),
            1e-6 * bytes.len() as f64
        );
        let Some(former) = former else {
            tracing::info!("{done}");
            return Ok(done);
        };
        let done = format!("{done}; {former}");
        tracing::warn!("{done}");
        Ok(done)
    }

    /// Keeps the file as a version, where this map is less than what is in it. Returns what was done.
    fn keep_former(&self, saved: &SavedMap) -> io::Result<Option<String>> {
        if !self.path.exists() {
            return Ok(None);
        }
        let before = self.load().ok();
        let keyframes = |saved: &SavedMap| saved.map.keyframes().len();
        if before.as_ref().is_some_and(|before| keyframes(before) <= keyframes(saved)) {
            return Ok(None);
        }
        let before = before.as_ref().map_or("no map".to_owned(), contents);
        let kept = keep_version(&self.path)?;
        Ok(kept
            .map(|version| format!("the file had {before}, and is kept as {}", version.display())))
    }

    /// Loads the saved map.
    pub(super) fn load(&self) -> Result<SavedMap, NodeFailure> {
        let failed = |reason: &dyn std::fmt::Display| {
            format!("the map could not be loaded from {}: {reason}", self.path.display())
        };
        let bytes = fs::read(&self.path).map_err(|error| failed(&error))?;
        Ok(SavedMap::decode(&bytes).map_err(|error| failed(&error))?)
    }

    /// The report of loading.
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
