//! Loading of the map from its file, at the start and on request.

use node_shell::{NodeFailure, Unusable, is_for_good};

use super::Stage;
use super::map_file::MapFile;
use super::saving::{NO_MAP_FILE, Unsaved};

/// The frame of the world whose origin is the same one after each start (REP-105), alone or behind a prefix (`robot/map`).
/// A map that was loaded is in it. Others, such as `odom`, have their origin where the node that publishes the poses was started.
const FIXED_FRAME: &str = "map";

impl Stage {
    /// Begins with the map of the file, if there is one and the map has not begun; see [`Self::clean_up`].
    ///
    /// # Errors
    /// When the file cannot be read, is no map, or does not fit the parameters: without the error the node would replace it. Another start
    /// would fail in the same way, but for a file that could not be read ([`Unusable`]).
    pub(super) fn begin_with(&mut self, file: Option<&MapFile>) -> Result<(), NodeFailure> {
        if std::mem::replace(&mut self.has_begun, true) {
            return Ok(());
        }
        let Some(file) = file.filter(|file| file.exists()) else { return Ok(()) };
        self.load(Some(file)).map_err(|error| {
            let path = file.path().display();
            let text = format!("{error}; with {path} moved away the node starts with an empty map");
            if is_for_good(&error) { Unusable::new(text).into() } else { NodeFailure::from(text) }
        })?;
        self.unsaved.is_changed = false;
        Ok(())
    }

    /// Drops the map, which is in its file; a node that is activated again begins with it.
    pub(super) fn clean_up(&mut self) {
        self.reset();
        self.unsaved.is_changed = false;
        self.has_begun = false;
    }

    pub(super) fn load(&mut self, file: Option<&MapFile>) -> Result<String, NodeFailure> {
        let file = file.ok_or(NO_MAP_FILE)?;
        let frame_id = self.map.frame_id().unwrap_or(FIXED_FRAME).to_owned();
        let awaits_frame = self.loaded_awaits_frame || self.map.frame_id().is_none();
        let loaded = file.load(&mut self.map, &frame_id);
        // If tiles could not be spilled, the map was dropped.
        if loaded.is_ok() || self.map.is_empty() {
            self.loaded_awaits_frame = awaits_frame && loaded.is_ok();
            self.unsaved = Unsaved::ANOTHER_MAP;
            self.map_replaced();
        }
        let voxels = loaded?;
        let path = file.path().display();
        Ok(format!("loaded a map of {voxels} voxels in frame {frame_id:?} from {path}"))
    }

    /// Sets the frame of the poses. A loaded map is continued if the frame is a `map`; another frame has another origin, and
    /// a new map is begun.
    pub(super) fn settle_frame(&mut self, frame_id: &str) {
        if !std::mem::take(&mut self.loaded_awaits_frame) {
            return;
        }
        if frame_id.rsplit('/').next() == Some(FIXED_FRAME) {
            self.map.rename_frame(frame_id);
            return;
        }
        tracing::warn!(
            "the poses are in the frame {frame_id:?}, and the loaded map of {} points is in {FIXED_FRAME:?}: it is not \
             continued, an empty map begins, and the file is kept as a numbered version when that one is saved. A map \
             goes on growing where the poses are in {FIXED_FRAME:?}, with the same origin after each start",
            self.map.len()
        );
        self.reset();
    }
}
