//! A map that spills: its folder, what is told of its tiles.

use node_shell::{Counters, NodeFailure, Throttle};

use super::ReconstructionParameters;
use super::tile_folder::TileFolder;
use crate::{AtMaxVoxels, StaticMap};

/// The name of the tiles on `/diagnostics`.
const CONDITION: &str = "spilled tiles";

/// The empty map that the parameters ask for.
///
/// # Errors
/// When a parameter is out of its range, or the folder of the tiles cannot be had.
pub fn empty_map(parameters: &ReconstructionParameters) -> Result<StaticMap, NodeFailure> {
    parameters.config.validate()?;
    Ok(match parameters.config.at_max_voxels {
        AtMaxVoxels::Spill => {
            let store = TileFolder::new(&parameters.spill_folder)?;
            StaticMap::with_tile_store(parameters.config, Box::new(store))?
        }
        AtMaxVoxels::Refuse | AtMaxVoxels::DropOldest => StaticMap::new(parameters.config)?,
    })
}

/// Tells of the tiles of a map, and of what went wrong with them.
pub(super) struct SpillWatch {
    counters: Counters,
    warned: Throttle,
}

impl SpillWatch {
    pub(super) fn new(counters: Counters) -> Self {
        Self { counters, warned: Throttle::for_warnings() }
    }

    /// Looks after a cycle. Returns what its report has of the tiles; nothing where none are spilled.
    pub(super) fn look(&self, map: &mut StaticMap) -> Vec<(&'static str, u64)> {
        let Some(counts) = map.spill_counts() else { return Vec::new() };
        if let Some(error) = map.take_tile_error()
            && let Some(held_back) = self.warned.pass()
        {
            tracing::warn!("{error} ({held_back} more since the last warning)");
        }
        let (lost, failed) = (counts.lost, counts.failed);
        let text = format!(
            "{} tiles in memory, {} in files; {lost} lost, {failed} failures to read or write",
            counts.tiles_in_memory, counts.tiles_in_store
        );
        self.counters.note_condition(CONDITION, &text, lost + failed > 0);
        vec![
            ("voxels_in_files", counts.voxels_in_store as u64),
            ("tiles_in_memory", counts.tiles_in_memory as u64),
            ("tiles_in_files", counts.tiles_in_store as u64),
            ("tiles_written", counts.written),
            ("tiles_read", counts.read),
            ("tiles_lost", lost),
            ("tile_failures", failed),
        ]
    }
}
