//! Voxels move with the part of the trajectory at which they were seen first: [`crate::correction`] has the rules.
//!
//! A voxel moves as a point, the mean with its weight, and is binned anew. Each move rounds the mean to 32 bits; the number of
//! its points is never changed. A voxel that others come to keeps its moment; of those that come to one place where none was it is
//! that of the one with most points. By the earliest one each correction would take it a voxel farther.

use std::cmp::Reverse;
use std::collections::hash_map::Entry;

use geometry::{MapPath, PathCorrection, Stamp, VoxelKey};
use nalgebra::Isometry3;

use super::StaticMap;
use super::anchor::Anchor;
use super::voxel::VoxelMean;
use crate::correction::{MapNow, TICK_S};
use crate::{CorrectionCounts, CorrectionError, MapCorrection};

#[cfg(test)]
mod tests;

impl StaticMap {
    /// Takes the trajectory of the platform as the map of the poses has it by now, and moves what has moved with it. The first
    /// path, and one that has no vertex in common with the last, is the reference for later ones. Without a path, or
    /// with one that does not change, the map is the same to the last bit.
    ///
    /// What was seen at [`MapPath::since`] or later stays, and what comes later and is of before is corrected. What was
    /// seen between two vertices moves by what lies between theirs; what was seen after the last that both paths have, by
    /// that of the last; and points of a map that was loaded stay.
    ///
    /// Costs by the voxels of the map. Takes 92 bytes for each voxel that moves while it is made. When something has moved, who
    /// follows the changes needs the whole map: [`crate::MapChanges::is_incomplete`].
    ///
    /// # Errors
    /// When the path is in another frame than the map; the map is then as it was.
    pub fn follow_path(&mut self, path: &MapPath) -> Result<MapCorrection, CorrectionError> {
        let map = MapNow {
            frame_id: self.frame_id.as_deref(),
            stamp: self.stamp,
            edge_m: self.grid.edge_m(),
        };
        let Some(asked) = self.corrections.asked_by(path, map)? else {
            return Ok(MapCorrection::default());
        };
        let before = self.voxels.len();
        let moved_voxels = self.move_voxels(&asked.made, asked.until);
        let merged_voxels = before - self.voxels.len();
        Ok(MapCorrection { moved_voxels, merged_voxels, shift_m: self.corrections.done(asked) })
    }

    /// What the corrections did since the map was empty.
    #[must_use]
    pub fn correction_counts(&self) -> CorrectionCounts {
        self.corrections.counts()
    }

    /// Returns how many moved.
    fn move_voxels(&mut self, made: &PathCorrection, until: Stamp) -> usize {
        // A map without a cycle has nothing that moves.
        let Some(epoch) = self.epoch else { return 0 };
        let (from, to) = made.span();
        // A tick more: a time is known to a tick. Most corrections move the end of the trajectory alone.
        let moving = Anchor::at(from, epoch)..Anchor::at(to.plus_seconds(TICK_S).min(until), epoch);
        let moved = |voxel: &VoxelMean| {
            let seen = voxel.anchor.stamp(epoch).filter(|_| moving.contains(&voxel.anchor))?;
            let now_from_before = made.at(seen);
            let point = (now_from_before * voxel.mean().cast::<f64>()).cast::<f32>();
            // Of numbers this large the sum may be none.
            let moves = now_from_before != Isometry3::identity() && geometry::is_finite(&point);
            moves.then(|| (self.grid.key(&point), voxel.moved_to(&point)))
        };
        let mut movers: Vec<(VoxelKey, (VoxelKey, VoxelMean))> =
            self.voxels.iter().filter_map(|(key, voxel)| Some((*key, moved(voxel)?))).collect();
        for (key, _) in &movers {
            self.voxels.remove(key);
        }
        // The outcome is the same in any order of those that come to one place.
        movers.sort_unstable_by_key(|(_, (key, _))| *key);
        let heaviness = |voxel: &VoxelMean| (voxel.points(), Reverse(voxel.anchor));
        let mut newly = None;
        for (_, (key, voxel)) in &movers {
            match self.voxels.entry(*key) {
                Entry::Occupied(known) => {
                    let known = known.into_mut();
                    known.merge(voxel);
                    if let Some((_, most)) = newly.as_mut().filter(|(newly, _)| newly == key)
                        && heaviness(voxel) > *most
                    {
                        *most = heaviness(voxel);
                        known.anchor = voxel.anchor;
                    }
                }
                Entry::Vacant(entry) => {
                    newly = Some((*key, heaviness(entry.insert(*voxel))));
                }
            }
        }
        self.changed.clear();
        if self.changes.is_some() {
            self.follow_changes_anew();
        }
        movers.len()
    }
}
