//! Voxels go where the correction has them.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use geometry::{PathCorrection, Stamp, VoxelGrid, VoxelKey};

use super::super::StaticMap;
use super::super::anchor::{Anchor, TICK_S};
use super::super::blocks::Blocks;
use super::super::seen_order::SeenOrder;
use super::super::voxel::VoxelMean;
use super::MapCorrection;
use crate::tiles::TileError;

/// Where voxels go.
struct Moves<'a> {
    made: &'a PathCorrection,
    grid: VoxelGrid,
    epoch: Stamp,
    /// What was seen first before this time stays ...
    from: Anchor,
    /// ... and at this time or later.
    until: Anchor,
}

impl Moves<'_> {
    /// The voxel where it goes; `None` for one that stays.
    fn of(&self, voxel: &VoxelMean) -> Option<(VoxelKey, VoxelMean)> {
        // Most corrections move the last of the way alone.
        if voxel.anchor < self.from || voxel.anchor >= self.until {
            return None;
        }
        let now_from_before = self.made.at(voxel.anchor.stamp(self.epoch)?);
        if now_from_before == nalgebra::Isometry3::identity() {
            return None;
        }
        let point = (now_from_before * voxel.mean().cast::<f64>()).cast::<f32>();
        // Of numbers this large the sum may be none.
        geometry::is_finite(&point).then(|| (self.grid.key(&point), voxel.moved_to(&point)))
    }
}

impl StaticMap {
    pub(super) fn move_voxels(
        &mut self,
        made: &PathCorrection,
        until: Stamp,
    ) -> Result<MapCorrection, TileError> {
        // A map without a cycle has nothing that moves.
        let Some(epoch) = self.epoch else { return Ok(MapCorrection::default()) };
        let (from, to) = made.span();
        // A tick more: a moment is known to a tick.
        let to = to.plus_seconds(TICK_S).min(until);
        let (from, until) = (Anchor::at(from, epoch), Anchor::at(to, epoch));
        let moves = Moves { made, grid: self.grid, epoch, from, until };
        let before = self.len();
        let moved_voxels = if self.spill.is_some() {
            self.move_tiles(&moves)?
        } else {
            self.move_in_memory(&moves)
        };
        self.changed.clear();
        self.behaviour.map_moved();
        if self.changes.is_some() {
            self.follow_changes_anew();
        }
        let merged_voxels = before.saturating_sub(self.len());
        Ok(MapCorrection { moved_voxels, merged_voxels, shift_m: 0.0 })
    }

    fn move_in_memory(&mut self, moves: &Moves<'_>) -> usize {
        let by_age = self.seen_order.as_ref().map(|order| self.order_after(order, moves));
        let movers: Vec<(VoxelKey, (VoxelKey, VoxelMean))> =
            self.voxels.iter().filter_map(|(key, voxel)| Some((*key, moves.of(voxel)?))).collect();
        for (key, _) in &movers {
            self.voxels.remove(key);
            if let Some(occupied) = &mut self.occupied {
                occupied.remove(*key);
            }
        }
        for (_, (key, voxel)) in &movers {
            // They were there before, and so there is room.
            self.put(*key, voxel);
        }
        if let Some(by_age) = by_age {
            let order = self.seen_order.insert(SeenOrder::default());
            by_age.into_iter().for_each(|key| order.saw(key));
        }
        movers.len()
    }

    /// Where the voxels go, those first that were seen longest ago. Of two that come to one place the later one counts.
    fn order_after(&self, order: &SeenOrder, moves: &Moves<'_>) -> Vec<VoxelKey> {
        let goes_to = |key| {
            let moved = self.voxels.get(&key).and_then(|voxel| moves.of(voxel));
            moved.map_or(key, |(key, _)| key)
        };
        order.by_age().map(goes_to).collect()
    }

    /// Has the voxel, or takes it into the one that it has there. Returns whether there was room.
    fn put(&mut self, key: VoxelKey, voxel: &VoxelMean) -> bool {
        if !self.fetch(key) {
            return false;
        }
        let is_full = self.voxels.len() >= self.max_voxels && !self.voxels.contains_key(&key);
        if is_full && self.spill.is_some() && !self.spill_until(1) {
            return false;
        }
        match self.voxels.entry(key) {
            Entry::Occupied(known) => known.into_mut().merge(voxel),
            Entry::Vacant(entry) => {
                entry.insert(*voxel);
                if let Some(occupied) = &mut self.occupied {
                    occupied.insert(key);
                }
                if let Some(spill) = &mut self.spill {
                    spill.has_one_more();
                }
            }
        }
        true
    }

    /// Tile by tile into another store, so that no more than `max_voxels` and a tile are in memory, and no voxel is met
    /// twice. Until all are there, the old store has the whole map.
    fn move_tiles(&mut self, moves: &Moves<'_>) -> Result<usize, TileError> {
        self.begin_round();
        self.spill_all()?;
        let Some(old) = self.spill.take() else { return Ok(0) };
        let (outcome, old) = match old.another() {
            Ok(another) => {
                self.spill = Some(another);
                (self.fill_from(&old, moves), old)
            }
            Err(error) => (Err(error), old),
        };
        if let Err(error) = &outcome {
            self.voxels = HashMap::default();
            self.occupied = Some(Blocks::default());
            let old = self.spill.insert(old);
            old.failed(error.clone());
        }
        outcome
    }

    fn fill_from(
        &mut self,
        old: &super::super::spill::Spill,
        moves: &Moves<'_>,
    ) -> Result<usize, TileError> {
        let mut moved_voxels = 0;
        for tile in old.tiles_by_key() {
            let voxels = match old.read(tile) {
                Ok(voxels) => voxels,
                Err(error) if error.is_loss() => {
                    self.lost_tile(error);
                    continue;
                }
                Err(error) => return Err(error),
            };
            for (key, voxel) in voxels {
                let moved = moves.of(&voxel);
                moved_voxels += usize::from(moved.is_some());
                let (key, voxel) = moved.unwrap_or((key, voxel));
                if !self.put(key, &voxel) {
                    return Err(self.why_no_room());
                }
            }
        }
        Ok(moved_voxels)
    }
}
