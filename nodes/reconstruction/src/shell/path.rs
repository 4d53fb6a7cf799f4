//! Corrections of the map by corrected trajectories of the platform.

use msgs::convert::{self, ConvertError};
use msgs::nav_msgs::Path;
use node_shell::{Counters, Throttle};

use super::Stage;
use crate::{CorrectionError, Map, MapCorrection};

/// The name of the corrections on `/diagnostics`.
const CONDITION: &str = "corrections of the map";
/// The cause of a drop: the map was not corrected.
const REFUSED: &str = "path refused";

/// Reports the corrections.
pub(super) struct PathWatch {
    counters: Counters,
    warned: Throttle,
}

/// Why the map was not corrected by a path.
#[derive(Debug, thiserror::Error)]
enum PathFailure {
    #[error(transparent)]
    Message(#[from] ConvertError),
    #[error(transparent)]
    Map(#[from] CorrectionError),
}

impl PathWatch {
    pub(super) fn new(counters: Counters) -> Self {
        Self { counters, warned: Throttle::for_warnings() }
    }

    fn corrected(&self, map: &Map, done: &MapCorrection) {
        let MapCorrection { moved_voxels, merged_voxels, shift_m } = *done;
        tracing::info!(
            "corrected the map: {moved_voxels} voxels moved, by {shift_m:.2} m at most where they were seen from near; \
             {merged_voxels} are one with another now"
        );
        let counts = map.correction_counts();
        let text = format!(
            "{}, the last by {shift_m:.2} m, the largest by {:.2} m",
            counts.corrections, counts.largest_shift_m
        );
        self.counters.note_condition(CONDITION, &text, false);
    }

    fn refused(&mut self, topic: &str, error: &PathFailure) {
        self.counters.count_drop(REFUSED);
        if let Some(held_back) = self.warned.pass() {
            tracing::warn!("{topic}: {error} ({held_back} more since the last warning)");
        }
    }
}

impl Stage {
    /// Takes a corrected trajectory.
    pub(super) fn take_path(&mut self, message: &Path) {
        match self.follow(message) {
            Ok(done) if done.moved_voxels > 0 => {
                self.path_watch.corrected(&self.map, &done);
                self.unsaved.is_changed = true;
                self.map_replaced();
            }
            Ok(_) => {}
            Err(error) => self.path_watch.refused(self.paths.topic(), &error),
        }
    }

    fn follow(&mut self, message: &Path) -> Result<MapCorrection, PathFailure> {
        let path = convert::map_path_from_message(message)?;
        Ok(self.map.follow_path(&path)?)
    }
}

/// The numbers of the corrections for the report of a cycle; none before the first correction.
pub(super) fn reported(map: &Map) -> Vec<(&'static str, u64)> {
    let counts = map.correction_counts();
    if counts.corrections == 0 {
        return Vec::new();
    }
    vec![
        ("map_corrections", counts.corrections),
        ("largest_correction_mm", (counts.largest_shift_m * 1e3) as u64),
        ("cycles_brought_over", counts.late_cycles),
    ]
}
