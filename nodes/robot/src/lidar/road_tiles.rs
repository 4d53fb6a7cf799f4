//! The tiles of a road map as files.

use std::path::Path;

use lidar_odometry::road_map::{RoadTileKey, RoadTileStore, TileStoreFailure};
use node_shell::{SpillFolder, SpillFolderError};

use crate::failure::Failure;

/// Tiles in a folder of this run, a file each: `X_Y.tile`, the tile's key in its name. The folder is removed with it.
#[derive(Debug)]
pub struct RoadTiles {
    folder: SpillFolder,
}

impl RoadTiles {
    /// No tiles, in a folder of this run below `parent`, which is created if it does not exist.
    ///
    /// # Errors
    /// When nothing can be written there. The caller knows which option names the folder, and adds the fix.
    pub fn below(parent: &Path) -> Result<Self, Failure> {
        let folder = SpillFolder::below(parent).map_err(|error| Failure::new(error.to_string()))?;
        Ok(Self { folder })
    }
}

impl RoadTileStore for RoadTiles {
    fn append(&mut self, tile: RoadTileKey, bytes: &[u8]) -> Result<(), TileStoreFailure> {
        self.folder.append(&file_name(tile), bytes).map_err(failed(tile))
    }

    fn read(&self, tile: RoadTileKey) -> Result<Vec<u8>, TileStoreFailure> {
        let bytes = self.folder.read(&file_name(tile)).map_err(failed(tile))?;
        bytes.ok_or_else(|| {
            let path = self.folder.path().join(file_name(tile));
            TileStoreFailure { tile, reason: format!("{} is missing", path.display()) }
        })
    }
}

fn file_name(tile: RoadTileKey) -> String {
    format!("{}_{}.tile", tile.x, tile.y)
}

fn failed(tile: RoadTileKey) -> impl FnOnce(SpillFolderError) -> TileStoreFailure {
    move |error| TileStoreFailure { tile, reason: error.to_string() }
}
