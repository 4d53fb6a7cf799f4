//! The map as one cloud.

use geometry::{Cloud, VoxelKey};
use nalgebra::{Point3, Vector3};

use super::StaticMap;
use crate::tiles::TileError;

/// All points of the map, and what could not be read of it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct WholeMap {
    /// The points, one a voxel, in ascending order of the voxels' keys; of a map of depth images, of its
    /// blocks' keys and of the voxels within a block.
    pub points_m: Vec<Point3<f32>>,
    /// The normals of the surface, of length 1, to the side from which it was seen: one a point, or none where the map has
    /// none.
    pub normals: Vec<Vector3<f32>>,
    /// The spilled tiles whose points are not among them, by ascending key.
    pub unreadable: Vec<TileError>,
}

impl StaticMap {
    /// All points of the map, those of spilled tiles included. Takes 24 bytes a voxel while it is made, and
    /// the time to read every spilled tile.
    #[must_use]
    pub fn whole(&self) -> WholeMap {
        let mut voxels: Vec<(VoxelKey, Point3<f32>)> =
            self.voxels.iter().map(|(key, voxel)| (*key, voxel.mean())).collect();
        let mut unreadable = Vec::new();
        if let Some(spill) = &self.spill {
            for tile in spill.tiles_by_key() {
                match spill.read(tile) {
                    Ok(tile) => {
                        voxels.extend(tile.into_iter().map(|(key, voxel)| (key, voxel.mean())));
                    }
                    Err(error) => unreadable.push(error),
                }
            }
        }
        voxels.sort_unstable_by_key(|(key, _)| *key);
        let points_m = voxels.into_iter().map(|(_, mean)| mean).collect();
        WholeMap { points_m, normals: Vec::new(), unreadable }
    }

    /// The points of the map, one a voxel, in ascending order of the voxels' keys: [`StaticMap::whole`] without
    /// what it says of tiles that cannot be read.
    #[must_use]
    pub fn points(&self) -> Vec<Point3<f32>> {
        self.whole().points_m
    }

    /// The map as a cloud: [`StaticMap::points`] with the map's frame and the stamp of the latest cycle. An
    /// empty frame before the first cycle.
    #[must_use]
    pub fn cloud(&self) -> Cloud {
        self.cloud_of(self.points())
    }

    pub(super) fn cloud_of(&self, points_m: Vec<Point3<f32>>) -> Cloud {
        let frame_id = self.frame_id.clone().unwrap_or_default();
        Cloud { stamp: self.stamp, frame_id, points_m }
    }
}
