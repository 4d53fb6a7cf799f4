//! The map follows the corrections of the poses that it was built by, block by block.

use geometry::{MapPath, Stamp};
use nalgebra::Isometry3;
use volume::{BlockBox, BlockKey};

use super::SurfaceMap;
use super::spill::{LookedAt, Spill};
use crate::correction::MapNow;
use crate::tiles::TileError;
use crate::{CorrectionError, MapCorrection};

/// A block that moves needs those around it: so many tiles are kept that were looked at last. 27 are needed at a time.
const AROUND_TILES: usize = 32;

impl SurfaceMap {
    /// Takes the trajectory of the platform as the map of the poses has it by now: [`crate::StaticMap::follow_path`] has the
    /// rules. A block of 8 voxels an axis moves by the correction of the moment at which it was seen first. Costs by the blocks
    /// of the map, and takes their memory twice meanwhile. Where tiles are spilled, it takes the memory of 32 of them; all are
    /// read some three times, written elsewhere, and take room on the disk twice meanwhile. Voxels are counted as [`SurfaceMap::len`] does.
    ///
    /// # Errors
    /// When the path is in another frame than the map, or a tile cannot be read or written for now; the map is then as it was.
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
        let before = self.len();
        let moved = if self.spill.is_some() {
            self.move_tiles(now_from_before)
        } else {
            Ok(self.move_in_memory(now_from_before))
        };
        let moved_voxels = moved.inspect_err(|_| self.corrections.put_off(&asked))?;
        if let Some(grid) = &mut self.grid {
            grid.correct(now_from_before, asked.lift_m());
        }
        self.views.correct(now_from_before);
        self.follow_changes_anew();
        self.follow_mesh_anew();
        self.followers.distances = None;
        let shift_m = self.corrections.done(asked);
        let merged_voxels = before.saturating_sub(self.len());
        Ok(MapCorrection { moved_voxels, merged_voxels, shift_m })
    }

    fn move_in_memory(&mut self, now_from_before: impl Fn(Stamp) -> Isometry3<f64>) -> usize {
        let moves = |key: &BlockKey| {
            self.surface.motion_of(*key, &now_from_before) != Isometry3::identity()
        };
        let moved = self.surface.block_keys().into_iter().filter(moves);
        let moved_voxels = moved.map(|key| self.surface.near_nodes_of(key)).sum();
        self.surface = self.surface.corrected(now_from_before);
        moved_voxels
    }

    /// Tile by tile into another store. Until all are there, the old store has the whole map.
    fn move_tiles(
        &mut self,
        now_from_before: impl Fn(Stamp) -> Isometry3<f64>,
    ) -> Result<usize, TileError> {
        self.begin_round();
        self.spill_all()?;
        let Some(old) = self.spill.take() else { return Ok(0) };
        // What listeners know is of the old tiles.
        let follower = self.followers.changes.take();
        let (outcome, old) = match old.another() {
            Ok(another) => {
                self.spill = Some(another);
                (self.fill_from(&old, now_from_before), old)
            }
            Err(error) => (Err(error), old),
        };
        if let Err(error) = &outcome {
            for key in self.surface.block_keys() {
                self.surface.remove_block(key);
            }
            self.spill.insert(old).tiles.failed(error.clone());
        }
        self.followers.changes = follower;
        self.surface.settle_moved();
        outcome
    }

    fn fill_from(
        &mut self,
        old: &Spill,
        now_from_before: impl Fn(Stamp) -> Isometry3<f64>,
    ) -> Result<usize, TileError> {
        let mut before = LookedAt::with_room_for(AROUND_TILES, &self.surface);
        let mut moved_voxels = 0;
        for tile in old.tiles.in_store_by_key() {
            old.with_all_around(tile).for_each(|tile| before.look(old, tile));
            match before.unreadable.get(&tile) {
                Some(error) if !error.is_loss() => return Err(error.clone()),
                _ => {}
            }
            for key in before.blocks_of(tile) {
                let motion = before.surface.motion_of(*key, &now_from_before);
                let moves = motion != Isometry3::identity();
                moved_voxels += if moves { before.surface.near_nodes_of(*key) } else { 0 };
                let moved = before.surface.moved_box(*key, &motion);
                self.put_moved(&before, *key, &now_from_before, moved)?;
            }
        }
        if !before.unreadable.is_empty() {
            self.views.clear();
        }
        for (_, error) in before.unreadable {
            if let Some(spill) = &mut self.spill {
                spill.tiles.lost_before(error);
            }
        }
        Ok(moved_voxels)
    }

    /// Puts a block of before where it is now: in one tile after the other, so that one at a time must be in memory.
    fn put_moved(
        &mut self,
        before: &LookedAt,
        key: BlockKey,
        now_from_before: impl Fn(Stamp) -> Isometry3<f64>,
        moved: BlockBox,
    ) -> Result<(), TileError> {
        let tiles: Vec<_> = self.spill.iter().flat_map(|spill| spill.tiles_of(moved)).collect();
        for tile in tiles {
            let Some(spill) = &self.spill else { break };
            let blocks = spill.blocks_of(tile).intersection(&moved);
            let is_here = self.fetch(blocks);
            let most_new = blocks.blocks() as usize - self.surface.blocks_in(blocks).len();
            if !is_here || !self.spill_until(most_new) {
                return Err(self.why_no_room());
            }
            self.surface.join_moved(&before.surface, key, &now_from_before, blocks);
            if let Some(spill) = &mut self.spill {
                spill.tiles.has(tile);
            }
        }
        Ok(())
    }
}
