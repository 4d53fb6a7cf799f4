//! The map of keyframes is saved, loaded, and let go.

use std::path::Path;

use node_shell::NodeFailure;

use super::Stage;
use crate::saved_map::SavedMap;
use crate::shell::follower::Follower;
use crate::shell::map_file::MapFile;

const NO_MAP_FILE: &str = "the parameter map_file is empty: it names the file of the map";
const NO_SLAM: &str = "there is no map: the parameter slam is false";
const EMPTY: &str = "there is no map yet: no image has made a keyframe";

impl Stage {
    /// The map as it is now, and where it goes. To be written it may be taken to another thread.
    ///
    /// # Errors
    /// When there is no map, or no file for it.
    pub(in crate::shell) fn to_be_saved(&self) -> Result<(MapFile, SavedMap), NodeFailure> {
        let saved = self.saved()?;
        let file = self.map_file.clone().ok_or(NO_MAP_FILE)?;
        Ok((file, saved))
    }

    /// Puts the map of the file in the place of the map. Odometry continues; the camera is searched for in the new map. When it
    /// fails, all is as it was. Returns what was done.
    ///
    /// # Errors
    /// When there is no such file, or what is in it is no map.
    pub(in crate::shell) fn load_map(&mut self) -> Result<String, NodeFailure> {
        if !self.parameters.slam {
            return Err(NO_SLAM.into());
        }
        let file = self.map_file.as_ref().ok_or(NO_MAP_FILE)?;
        let saved = file.load()?;
        let message = file.loaded(&saved);
        let tracker = self.follower.tracker().clone();
        let world_from_map = saved.world_from_map;
        self.follower = Follower::new(&self.parameters, Some(saved.map), Some(tracker))?;
        self.output.reset(Some(&world_from_map));
        self.reset_trajectory();
        tracing::info!("{message}");
        Ok(message)
    }

    /// Begins anew: the next image is the first one. A map that is only used for localisation stays, and the camera is searched for
    /// in it. Returns what was done.
    ///
    /// # Errors
    /// When no thread can be started for the new map.
    pub(in crate::shell) fn begin_anew(&mut self) -> Result<String, NodeFailure> {
        let kept = self.follower.map().filter(|_| self.parameters.localisation_only);
        let message = match &kept {
            Some(map) => {
                format!("looks for the camera in the map of {} keyframes", map.keyframes().len())
            }
            None => "begins anew, with nothing".to_owned(),
        };
        let world_from_map = kept.is_some().then(|| *self.output.frames().world_from_map());
        self.follower = Follower::new(&self.parameters, kept.map(|map| (*map).clone()), None)?;
        self.output.reset(world_from_map.as_ref());
        self.reset_trajectory();
        self.forget_inputs();
        tracing::info!("{message}");
        Ok(message)
    }

    /// Saves the map where the parameter `save_map_on_exit` says, if it does.
    pub(in crate::shell) fn save_on_exit(&self) -> Result<(), NodeFailure> {
        let Some(file) = &self.map_file_on_exit else { return Ok(()) };
        match self.saved() {
            Ok(saved) => drop(file.save(&saved)?),
            // A map that was saved before is worth more than none.
            Err(error) => tracing::warn!("no map is saved: {error}"),
        }
        Ok(())
    }

    /// Saves the map to a file, whatever the parameters say. Returns what was done.
    ///
    /// # Errors
    /// When there is no map, or it cannot be written.
    pub fn save_map_to(&self, path: &Path) -> Result<String, NodeFailure> {
        MapFile::at(path.to_owned()).save(&self.saved()?)
    }

    fn saved(&self) -> Result<SavedMap, NodeFailure> {
        let map = self.follower.map().ok_or(NO_SLAM)?;
        if map.keyframes().is_empty() {
            return Err(EMPTY.into());
        }
        let world_from_map = *self.output.frames().world_from_map();
        Ok(SavedMap { map: (*map).clone(), world_from_map })
    }
}
