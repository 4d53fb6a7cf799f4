//! A map that was saved takes the place of this one.

use nalgebra::{Point3, Vector3};
use volume::BlockBox;

use super::SurfaceMap;
use crate::tiles::TileKey;
use crate::{Addition, LoadError};

/// A point is joined to the nodes of its voxel and of those beside: of no more blocks than meet in a corner.
const MOST_BLOCKS_A_POINT: usize = 8;

impl SurfaceMap {
    /// Puts points with their normals, in `frame_id`, in the place of the whole map. The stamp stays. Who follows the changes has
    /// to start with a new map.
    ///
    /// # Errors
    /// When there are points and no normals, or no room; the map is then as it was. Where tiles are spilled, when they cannot be:
    /// the old map has gone then, half a map is none, and the map is empty.
    pub fn replace(
        &mut self,
        points_m: &[Point3<f32>],
        normals: &[Vector3<f32>],
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        if points_m.len() != normals.len() {
            return Err(LoadError::NoNormals);
        }
        if self.spill.is_some() {
            return self.replace_tile_by_tile(points_m, normals, frame_id);
        }
        let mut surface = self.surface.emptied();
        let points = points_m.iter().copied().zip(normals.iter().copied());
        if surface.put_points(points, BlockBox::ALL) > 0 {
            let max_map_blocks = surface.config().max_blocks;
            return Err(LoadError::TooManyBlocks { max_map_blocks });
        }
        let stamp = self.stamp;
        self.clear();
        (self.surface, self.stamp) = (surface, stamp);
        self.rename_frame(frame_id);
        Ok(Addition { new_voxels: self.surface.blocks(), ..Addition::default() })
    }

    fn replace_tile_by_tile(
        &mut self,
        points_m: &[Point3<f32>],
        normals: &[Vector3<f32>],
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        let stamp = self.stamp;
        self.clear();
        self.stamp = stamp;
        self.rename_frame(frame_id);
        let mut by_tile = self.points_by_tile(points_m);
        // Those of a tile in their order.
        by_tile.sort_unstable();
        let mut addition = Addition::default();
        for of_tile in by_tile.chunk_by(|(a, _), (b, _)| a == b) {
            let Some((tile, _)) = of_tile.first() else { continue };
            let points = of_tile.iter().filter_map(|(_, index)| {
                Some((*points_m.get(*index as usize)?, *normals.get(*index as usize)?))
            });
            let Some(new_blocks) = self.put_tile(*tile, of_tile.len(), points) else {
                let reason = self.take_tile_error();
                self.clear();
                return Err(LoadError::NoRoom { refused_points: of_tile.len(), reason });
            };
            addition.new_voxels += new_blocks;
        }
        Ok(addition)
    }

    /// The tiles of the blocks that each point is joined to, with its index.
    fn points_by_tile(&self, points_m: &[Point3<f32>]) -> Vec<(TileKey, u32)> {
        let Some(spill) = &self.spill else { return Vec::new() };
        let finite = (0..).zip(points_m).filter(|(_, point_m)| geometry::is_finite(point_m));
        let of_point = |(index, point_m): (u32, &Point3<f32>)| {
            spill.tiles_of(self.surface.point_box(point_m)).map(move |tile| (tile, index))
        };
        finite.flat_map(of_point).collect()
    }

    /// Joins all points of a tile to it, so many. Returns how many blocks it has; `None` where there is no room.
    fn put_tile(
        &mut self,
        tile: TileKey,
        points: usize,
        oriented: impl Iterator<Item = (Point3<f32>, Vector3<f32>)>,
    ) -> Option<usize> {
        let spill = self.spill.as_mut()?;
        let blocks = spill.blocks_of(tile);
        spill.tiles.pass_on();
        let most_new = points.saturating_mul(MOST_BLOCKS_A_POINT).min(blocks.blocks() as usize);
        if !self.spill_until(most_new) {
            return None;
        }
        let before = self.surface.blocks();
        let refused = self.surface.put_points(oriented, blocks);
        self.spill.as_mut()?.tiles.has(tile);
        (refused == 0).then(|| self.surface.blocks() - before)
    }

    /// Gives the frame of the map another name. The points stay.
    pub fn rename_frame(&mut self, frame_id: &str) {
        self.frame_id = Some(frame_id.to_owned());
    }
}
