//! The map follows the corrections of the poses that it was built by, block by block.

use geometry::{MapPath, Stamp};
use nalgebra::Isometry3;
use volume::PointRules;

use super::SurfaceMap;
use crate::static_map::MapNow;
use crate::{CorrectionError, MapCorrection};

impl SurfaceMap {
    /// Takes the trajectory of the platform as the map of the poses has it by now: [`crate::StaticMap::follow_path`] has the
    /// rules. A block of 8 voxels an axis moves by the correction of the moment at which it was seen first. Costs by the blocks
    /// of the map, and takes their memory twice meanwhile.
    ///
    /// # Errors
    /// When the path is in another frame than the map.
    pub fn follow_path(&mut self, path: &MapPath) -> Result<MapCorrection, CorrectionError> {
        let map = MapNow {
            frame_id: self.frame_id.as_deref(),
            stamp: self.stamp,
            edge_m: self.surface.grid().edge_m(),
        };
        let Some(asked) = self.corrections.asked_by(path, map)? else {
            return Ok(MapCorrection::default());
        };
        let now_from_before = |seen: Stamp| {
            if seen < asked.until { asked.made.at(seen) } else { Isometry3::identity() }
        };
        let (mut moved_voxels, mut before, mut points) = (0, 0, Vec::new());
        for key in self.surface.block_keys() {
            points.clear();
            self.surface.points_of(key, PointRules::default(), &mut points);
            before += points.len();
            let seen = self.surface.seen(key);
            let moves =
                seen.is_some_and(|(first, _)| now_from_before(first) != Isometry3::identity());
            moved_voxels += if moves { points.len() } else { 0 };
        }
        self.surface = self.surface.corrected(now_from_before);
        if let Some(follower) = &mut self.follower {
            follower.follow_all(&self.surface);
        }
        let after = self.surface.points(PointRules::default()).len();
        let shift_m = self.corrections.done(asked);
        let merged_voxels = before.saturating_sub(after);
        Ok(MapCorrection { moved_voxels, merged_voxels, shift_m })
    }
}
