//! What listeners have to be told of.

use geometry::VoxelKey;
use nalgebra::Point3;
use volume::{ChangeFollower, PointRules};

use super::SurfaceMap;
use crate::MapChanges;

impl SurfaceMap {
    /// Follows the changes from now on, for listeners that get the map as it is now, or later. Costs by the whole map.
    pub fn follow_changes(&mut self) {
        let mut follower = ChangeFollower::default();
        follower.follow_all(&self.surface);
        follower.take(&self.surface, PointRules::default(), usize::MAX);
        self.follower = Some(follower);
    }

    /// There are no listeners any more.
    pub fn unfollow_changes(&mut self) {
        self.follower = None;
    }

    /// The map as a cloud for a listener to start with. What it shows and was not told yet is told in any case.
    pub fn cloud_for_listeners(&mut self) -> geometry::Cloud {
        if let Some(follower) = &mut self.follower {
            follower.show_whole(&self.surface, PointRules::default());
        }
        self.cloud_of(self.whole().points_m)
    }

    /// The next changes, of no more than so many points, or of one block; see [`crate::StaticMap::take_changes`]. What has gone
    /// is told of by the middle of its voxel.
    pub fn take_changes(&mut self, most_points: usize) -> MapChanges {
        let Some(follower) = &mut self.follower else { return MapChanges::default() };
        let changes = follower.take(&self.surface, PointRules::default(), most_points);
        let edge_m = self.surface.grid().edge_m();
        let updated = changes.updated.iter().map(|point| point.position_m).collect();
        let removed = changes.removed.iter().map(|voxel| middle_m(voxel, edge_m)).collect();
        MapChanges {
            updated: self.cloud_of(updated),
            removed: self.cloud_of(removed),
            is_incomplete: false,
        }
    }
}

fn middle_m(voxel: &VoxelKey, edge_m: f64) -> Point3<f32> {
    let middle = |cell: i32| ((f64::from(cell) + 0.5) * edge_m) as f32;
    Point3::new(middle(voxel.x), middle(voxel.y), middle(voxel.z))
}
