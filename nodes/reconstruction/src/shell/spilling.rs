//! A map that spills: its folder, what is told of its tiles.

#[cfg(test)]
mod tests;

use std::path::Path;
use std::time::Duration;

use node_shell::{Counters, NodeFailure, SpillFolder, SpillFolderError, Throttle};
use tokio::time::Instant;

use super::ReconstructionParameters;
use crate::tiles::{TileKey, TileStore, TileStoreError};
use crate::{AtMaxVoxels, Map};

/// The name of the tiles on `/diagnostics`.
const CONDITION: &str = "spilled tiles";

/// The empty map that the parameters ask for.
///
/// # Errors
/// When a parameter is out of its range, or the folder of the tiles cannot be had.
pub fn empty_map(parameters: &ReconstructionParameters) -> Result<Map, NodeFailure> {
    check(parameters)?;
    let store = match parameters.config.at_max_voxels {
        AtMaxVoxels::Spill => {
            Some(Box::new(store_in(&parameters.spill_folder)?) as Box<dyn TileStore>)
        }
        AtMaxVoxels::Refuse | AtMaxVoxels::DropOldest => None,
    };
    Ok(Map::new(parameters.config.clone(), store)?)
}

/// Whether a map can be made by the parameters, and its tiles have a folder.
pub(super) fn check(parameters: &ReconstructionParameters) -> Result<(), NodeFailure> {
    parameters.config.check_map()?;
    if parameters.config.at_max_voxels == AtMaxVoxels::Spill && parameters.spill_folder.is_empty() {
        return Err("parameter spill_folder is empty: with at_max_voxels spill it must name a folder, which is \
                    made if it is not there"
            .into());
    }
    Ok(())
}

/// The store of this run below the value of `spill_folder`.
fn store_in(spill_folder: &str) -> Result<SpillFolder, NodeFailure> {
    SpillFolder::below(Path::new(spill_folder))
        .map_err(|error| format!("parameter spill_folder: {error}").into())
}

/// Tiles as files: `X_Y_Z.tile`, the tile's key in its name.
impl TileStore for SpillFolder {
    fn write(&mut self, tile: TileKey, bytes: &[u8]) -> Result<(), TileStoreError> {
        Self::write(self, &file_name(tile), bytes).map_err(failed)
    }

    fn read(&self, tile: TileKey) -> Result<Vec<u8>, TileStoreError> {
        Self::read(self, &file_name(tile)).map_err(failed)?.ok_or(TileStoreError::Missing)
    }

    fn another(&self) -> Result<Box<dyn TileStore>, TileStoreError> {
        Ok(Box::new(self.beside().map_err(failed)?))
    }

    fn clear(&mut self) -> Result<(), TileStoreError> {
        Self::clear(self).map_err(failed)
    }
}

fn file_name(tile: TileKey) -> String {
    format!("{}_{}_{}.tile", tile.x, tile.y, tile.z)
}

fn failed(error: SpillFolderError) -> TileStoreError {
    TileStoreError::Failed { reason: error.to_string() }
}

/// So long a warning stands on `/diagnostics` after something went wrong with a tile: long enough for somebody who looks
/// there now and then. As long as the store fails and is asked, it stands.
const WARNING_STANDS: Duration = Duration::from_secs(30);

/// Tells of the tiles of a map, and of what went wrong with them.
pub(super) struct SpillWatch {
    counters: Counters,
    warned: Throttle,
    last_error: Option<Instant>,
}

impl SpillWatch {
    pub(super) fn new(counters: Counters) -> Self {
        Self { counters, warned: Throttle::for_warnings(), last_error: None }
    }

    /// Looks whether something went wrong since the last look, and tells how the tiles are; nothing where none are
    /// spilled.
    pub(super) fn look(&mut self, map: &mut Map, now: Instant) {
        if let Some((text, is_warning)) = self.condition(map, now) {
            self.counters.note_condition(CONDITION, &text, is_warning);
        }
    }

    fn condition(&mut self, map: &mut Map, now: Instant) -> Option<(String, bool)> {
        let counts = map.spill_counts()?;
        if let Some(error) = map.take_tile_error() {
            self.last_error = Some(now);
            if let Some(held_back) = self.warned.pass() {
                tracing::warn!("{error} ({held_back} more since the last warning)");
            }
        }
        let stands = |last: Instant| now.saturating_duration_since(last) < WARNING_STANDS;
        let text = format!(
            "{} tiles in memory, {} in files; {} lost, {} failures to read or write",
            counts.tiles_in_memory, counts.tiles_in_store, counts.lost, counts.failed
        );
        Some((text, self.last_error.is_some_and(stands)))
    }
}

/// What the report of a cycle has of the tiles; nothing where none are spilled.
pub(super) fn reported(map: &Map) -> Vec<(&'static str, u64)> {
    let Some(counts) = map.spill_counts() else { return Vec::new() };
    vec![
        ("voxels_in_files", counts.voxels_in_store as u64),
        ("tiles_in_memory", counts.tiles_in_memory as u64),
        ("tiles_in_files", counts.tiles_in_store as u64),
        ("tiles_written", counts.written),
        ("tiles_read", counts.read),
        ("tiles_lost", counts.lost),
        ("tile_failures", counts.failed),
    ]
}
