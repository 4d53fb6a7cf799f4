//! The file of the map is this process's own: two that write one file replace each other's map in turns.

use node_shell::{ClaimedFile, Counters, Node, NodeFailure};

use super::map_file::MapFile;
use super::parameters::Settings;
use super::saving::CONDITION;

/// The file of the map, which no other process writes.
pub(super) struct MapClaim {
    file: Option<MapFile>,
    /// Held as long as the node has the file.
    claimed: Option<ClaimedFile>,
    counters: Counters,
}

impl MapClaim {
    /// # Errors
    /// When another process has the file, and does not end soon.
    pub(super) async fn new(settings: &Settings, node: &Node) -> Result<Self, NodeFailure> {
        let claimed = match &settings.file {
            Some(file) => Some(ClaimedFile::at(file.path(), &node.shutdown_signal()).await?),
            None => None,
        };
        let file = settings.file.clone();
        Ok(Self { file, claimed, counters: node.counters() })
    }

    /// Takes the file of changed settings. Where another process has it, they get the former one.
    pub(super) async fn change(&mut self, settings: &mut Settings) {
        if self.file == settings.file {
            return;
        }
        let claimed = match &settings.file {
            Some(file) => ClaimedFile::at_once(file.path()).await.map(Some),
            None => Ok(None),
        };
        match claimed {
            Ok(claimed) => (self.file, self.claimed) = (settings.file.clone(), claimed),
            Err(error) => {
                let text = format!("map_file stays as it was: {error}");
                tracing::warn!("{text}");
                self.counters.note_condition(CONDITION, &text, true);
                settings.file = self.file.clone();
            }
        }
    }
}
