//! The map as a file.

use std::path::{Path, PathBuf};

use geometry::{pcd, ply};
use node_shell::NodeFailure;

use crate::StaticMap;

/// Where the map is saved, and how.
pub(super) struct MapFile {
    path: PathBuf,
    format: Format,
}

enum Format {
    Ply,
    Pcd,
}

impl MapFile {
    /// The file at `path`, whose format is told by its extension; none for an empty path. What cannot
    /// be written is found out now, not when there is a map to lose.
    pub(super) fn new(path: &str) -> Result<Option<Self>, NodeFailure> {
        if path.is_empty() {
            return Ok(None);
        }
        let path = PathBuf::from(path);
        let extension = path.extension().and_then(|extension| extension.to_str());
        let format = match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("ply") => Format::Ply,
            Some("pcd") => Format::Pcd,
            _ => {
                return Err(format!(
                    "parameter save_map_on_exit must end in .ply or .pcd, not {}",
                    path.display()
                )
                .into());
            }
        };
        let folder = path.parent().filter(|folder| *folder != Path::new(""));
        if folder.is_some_and(|folder| !folder.is_dir()) {
            return Err(format!(
                "parameter save_map_on_exit: the folder of {} does not exist",
                path.display()
            )
            .into());
        }
        Ok(Some(Self { path, format }))
    }

    /// Saves the map under a temporary name first: a reader never finds half a file, and an earlier
    /// map is lost only to a whole one.
    pub(super) fn save(&self, map: &StaticMap) -> Result<(), NodeFailure> {
        let points_m = map.points();
        let bytes = match self.format {
            Format::Ply => ply::encode(&points_m),
            Format::Pcd => pcd::encode(&points_m),
        };
        let mut temporary = self.path.clone().into_os_string();
        temporary.push(".part");
        std::fs::write(&temporary, bytes)
            .and_then(|()| std::fs::rename(&temporary, &self.path))
            .map_err(|error| {
                format!("the map could not be saved to {}: {error}", self.path.display())
            })?;
        tracing::info!("saved a map of {} points to {}", points_m.len(), self.path.display());
        Ok(())
    }
}
