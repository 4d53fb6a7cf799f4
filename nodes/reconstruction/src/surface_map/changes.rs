//! What listeners have to be told of.

use geometry::{NO_COLOUR, VoxelKey};
use nalgebra::Point3;
use volume::{BlockBox, ChangeFollower, PointRules, SurfaceChanges, SurfacePoint};

use super::SurfaceMap;
use crate::MapChanges;

impl SurfaceMap {
    /// Follows the changes from now on, for listeners that get the map as it is now, or later. Costs by the map in memory.
    pub fn follow_changes(&mut self) {
        let mut follower = ChangeFollower::default();
        self.visit_points_in_memory(|key, points| follower.know(key, points, self.grid()));
        if let Some(spill) = &mut self.spill {
            spill.tiles.follow();
        }
        (self.followers.changes, self.is_followed_anew) = (Some(follower), false);
    }

    /// What listeners know cannot be corrected by changes: follows anew, for listeners that need the whole map.
    pub(super) fn follow_changes_anew(&mut self) {
        if self.followers.changes.is_some() {
            self.follow_changes();
            self.is_followed_anew = true;
        }
    }

    /// There are no listeners any more.
    pub fn unfollow_changes(&mut self) {
        self.followers.changes = None;
    }

    /// The next changes, of no more than so many points, or of one block; see [`crate::StaticMap::take_changes`]. What has gone
    /// is told of by the middle of its voxel.
    pub fn take_changes(&mut self, most_points: usize) -> MapChanges {
        self.begin_round();
        let mut changes = SurfaceChanges::default();
        for _ in 0..self.waiting_changes() {
            let Some(key) = self.followers.changes.as_ref().and_then(ChangeFollower::next_waiting)
            else {
                break;
            };
            // Its tile may have been spilled since, or the next one.
            let is_here = self.fetch(BlockBox { least: key, most: key.offset(1, 1, 1) });
            let Some(follower) = &mut self.followers.changes else { break };
            if !is_here {
                follower.postpone();
                continue;
            }
            let rules = PointRules::default();
            if !follower.take_next(&self.surface, rules, most_points, &mut changes) {
                break;
            }
        }
        let edge_m = self.surface.grid().edge_m();
        let updated = changes.updated.iter().map(|point| point.position_m).collect();
        let updated_colours = colours_of(changes.updated.iter());
        let removed = changes.removed.iter().map(|voxel| middle_m(voxel, edge_m)).collect();
        MapChanges {
            updated: self.cloud_of(updated),
            updated_colours,
            removed: self.cloud_of(removed),
            is_incomplete: std::mem::take(&mut self.is_followed_anew),
        }
    }

    /// The blocks that wait to be looked at by [`SurfaceMap::take_changes`].
    #[must_use]
    pub fn waiting_changes(&self) -> usize {
        self.followers.changes.as_ref().map_or(0, ChangeFollower::waiting)
    }
}

/// The colours of points; none at all where no point has one.
pub(super) fn colours_of<'a>(
    points: impl Iterator<Item = &'a SurfacePoint> + Clone,
) -> Vec<[u8; 3]> {
    if points.clone().all(|point| point.colour.is_none()) {
        return Vec::new();
    }
    points.map(|point| point.colour.unwrap_or(NO_COLOUR)).collect()
}

fn middle_m(voxel: &VoxelKey, edge_m: f64) -> Point3<f32> {
    let middle = |cell: i32| ((f64::from(cell) + 0.5) * edge_m) as f32;
    Point3::new(middle(voxel.x), middle(voxel.y), middle(voxel.z))
}
