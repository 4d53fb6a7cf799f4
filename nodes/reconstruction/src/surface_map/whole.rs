//! The map as one cloud.

use geometry::{ColouredCloud, LastSight, OrientedPoints};
use volume::{BlockKey, ChangeFollower, PointRules, Surface, SurfacePoint};

use super::SurfaceMap;
use super::changes::colours_of;
use super::spill::LookedAt;
use crate::WholeMap;
use crate::tiles::{TileError, TileKey};

impl SurfaceMap {
    /// All points, with their normals and colours, those of spilled tiles included. Where tiles are spilled it takes 80 bytes a point and
    /// the memory of 16 tiles while it is made, and the time to read every spilled tile some two times.
    #[must_use]
    pub fn whole(&self) -> WholeMap {
        self.whole_seen_by(|_, _| {})
    }

    /// The map as a cloud for a listener to start with. What it shows and was not told yet is told in any case. Where a tile is
    /// lost, the cloud is what is left.
    ///
    /// # Errors
    /// When a spilled tile cannot be read for now: without its points a listener would take it for empty.
    pub fn cloud_for_listeners(&mut self) -> Result<ColouredCloud, TileError> {
        if let Some(spill) = &mut self.spill {
            spill.tiles.retry_unreadable()?;
        }
        let mut follower = self.followers.changes.take();
        follower.as_mut().into_iter().for_each(ChangeFollower::begin_to_show);
        let WholeMap { points, unreadable, .. } = self.whole_seen_by(|key, points| {
            if let Some(follower) = &mut follower {
                follower.show(key, points, self.grid());
            }
        });
        self.followers.changes = follower;
        if let Some(spill) = &mut self.spill
            && spill.tiles.were_read_but(unreadable)?
        {
            // Listeners still have their points, and nobody knows which ones they were.
            self.follow_changes_anew();
            self.views.clear();
        }
        Ok(ColouredCloud { cloud: self.cloud_of(points.points_m), colours: points.colours })
    }

    fn whole_seen_by(&self, mut see: impl FnMut(BlockKey, &[SurfacePoint])) -> WholeMap {
        let mut all: Vec<(BlockKey, SurfacePoint)> = Vec::new();
        let mut sights: Vec<(BlockKey, LastSight)> = Vec::new();
        let unreadable = self.visit_points(|key, points, sight| {
            see(key, points);
            all.extend(points.iter().map(|point| (key, *point)));
            sights.extend(sight.map(|sight| (key, sight)));
        });
        if self.spill.is_some() {
            // They come tile by tile. The order within a block stays.
            all.sort_by_key(|(key, _)| *key);
            sights.sort_by_key(|(key, _)| *key);
        }
        let sights = sights.into_iter().map(|(_, sight)| sight).collect();
        let points_m = all.iter().map(|(_, point)| point.position_m).collect();
        let normals = all.iter().map(|(_, point)| point.normal).collect();
        let colours = colours_of(all.iter().map(|(_, point)| point));
        // Those of a part show what is not in it as free.
        let views = if unreadable.is_empty() { self.views.all() } else { Vec::new() };
        let points = OrientedPoints { points_m, normals, colours };
        WholeMap { points, views, sights, unreadable }
    }

    /// Calls `visit` with the points of each block and how it was seen last. Returns why some cannot be had, by ascending key of the tile.
    fn visit_points(
        &self,
        mut visit: impl FnMut(BlockKey, &[SurfacePoint], Option<LastSight>),
    ) -> Vec<TileError> {
        if let Some(spill) = &self.spill {
            return self.visit_tiles(&spill.tiles.by_key(), visit);
        }
        let mut points = Vec::new();
        for key in self.surface.block_keys() {
            points.clear();
            self.surface.points_of(key, PointRules::default(), &mut points);
            visit(key, &points, self.surface.last_sight(None, key));
        }
        Vec::new()
    }

    /// Calls `visit` with the points of each block in memory, by all that is known of them.
    pub(super) fn visit_points_in_memory(&self, mut visit: impl FnMut(BlockKey, &[SurfacePoint])) {
        let visit = |key, points: &[SurfacePoint], _| visit(key, points);
        match &self.spill {
            Some(spill) => drop(self.visit_tiles(&spill.tiles.in_memory_by_key(), visit)),
            None => drop(self.visit_points(visit)),
        }
    }

    /// Calls `visit` with the points of each block of tiles, in memory or not, and how it was seen last. Returns why some cannot be had.
    pub(super) fn visit_tiles(
        &self,
        tiles: &[TileKey],
        mut visit: impl FnMut(BlockKey, &[SurfacePoint], Option<LastSight>),
    ) -> Vec<TileError> {
        let mut points = Vec::new();
        self.visit_blocks_of(tiles, |key, looked_at| {
            points.clear();
            let rules = PointRules::default();
            self.surface.points_of_both(looked_at, key, rules, &mut points);
            visit(key, &points, self.surface.last_sight(Some(looked_at), key));
        })
    }

    /// Calls `visit` with each block of tiles, in memory or not, and a surface that has the blocks that are not in memory, of these
    /// and of the next tiles. Returns why some cannot be had.
    pub(super) fn visit_blocks_of(
        &self,
        tiles: &[TileKey],
        mut visit: impl FnMut(BlockKey, &Surface),
    ) -> Vec<TileError> {
        let Some(spill) = &self.spill else { return Vec::new() };
        let mut looked_at = LookedAt::of(&self.surface);
        for tile in tiles {
            spill.with_next(*tile).for_each(|tile| looked_at.look(spill, tile));
            let in_memory = self.surface.blocks_in(spill.blocks_of(*tile));
            for key in in_memory.iter().chain(looked_at.blocks_of(*tile)) {
                visit(*key, &looked_at.surface);
            }
        }
        looked_at.unreadable.into_values().collect()
    }
}
