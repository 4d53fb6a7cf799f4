//! A map that was saved takes the place of this one.

use geometry::{LastSight, MapView, NO_COLOUR, OrientedPoints, VoxelGrid, VoxelKey};
use nalgebra::{Point3, Vector3};
use volume::BlockBox;

use super::{SurfaceMap, normals};
use crate::tiles::TileKey;
use crate::{Addition, LoadError};

/// Points that are farther apart than so many edges are not joined to a surface.
pub(crate) const MOST_SPACING_IN_EDGES: f64 = 16.0;

impl SurfaceMap {
    /// Puts points, in `frame_id`, in the place of the whole map: of a map of any edge, with a normal each or with none. Normals that
    /// are missing, 0 or not finite are estimated. A point says where the surface is as far around it as the points are apart. The stamp stays. Who follows
    /// the changes has to start with a new map.
    ///
    /// # Errors
    /// When there is no room; the map is then as it was. Where tiles are spilled, when they cannot be: the old map has gone then,
    /// half a map is none, and the map is empty.
    pub fn replace(
        &mut self,
        points_m: &[Point3<f32>],
        normals: &[Vector3<f32>],
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        let (points_m, normals) = (points_m.to_vec(), normals.to_vec());
        let points = OrientedPoints { points_m, normals, colours: Vec::new() };
        self.replace_coloured(&points, frame_id)
    }

    /// The same with a colour for each point, or none.
    ///
    /// # Errors
    /// As [`SurfaceMap::replace`].
    pub fn replace_coloured(
        &mut self,
        points: &OrientedPoints,
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        let replaced = self.replace_points(points, frame_id);
        if let Some(grid) = self.grid.as_mut().filter(|_| replaced.is_ok()) {
            grid.loaded();
        }
        replaced
    }

    fn replace_points(
        &mut self,
        points: &OrientedPoints,
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        let has_normals = points.points_m.len() == points.normals.len();
        let mut points = one_a_voxel(points, self.grid());
        let points_m = &points.points_m;
        let edge_m = self.grid().edge_m();
        let most_m = MOST_SPACING_IN_EDGES * edge_m;
        let spacing_m = normals::spacing_m(points_m, edge_m, most_m);
        if !has_normals {
            points.normals.clear();
        }
        points.normals.resize(points_m.len(), Vector3::zeros());
        normals::fill(points_m, &mut points.normals, spacing_m.unwrap_or(most_m));
        // Points that are too far apart are not joined.
        let reach_m = spacing_m.unwrap_or(edge_m);
        if self.spill.is_some() {
            return self.replace_tile_by_tile(&points, reach_m, frame_id);
        }
        let mut surface = self.surface.emptied();
        let points = (0..points.points_m.len()).filter_map(|index| at(&points, index));
        let refused = surface.put_coloured_points(points, reach_m, BlockBox::ALL);
        if refused > 0 {
            let (blocks, max_map_blocks) =
                (surface.blocks() + refused, surface.config().max_blocks);
            return Err(LoadError::TooManyBlocks { blocks, max_map_blocks });
        }
        self.clear();
        self.surface = surface;
        self.follow_mesh_anew();
        self.rename_frame(frame_id);
        Ok(Addition { new_voxels: self.surface.blocks(), ..Addition::default() })
    }

    fn replace_tile_by_tile(
        &mut self,
        points: &OrientedPoints,
        reach_m: f64,
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        self.clear();
        self.rename_frame(frame_id);
        let mut by_tile = self.points_by_tile(&points.points_m, reach_m);
        // Those of a tile in their order.
        by_tile.sort_unstable();
        let mut addition = Addition::default();
        for of_tile in by_tile.chunk_by(|(a, _), (b, _)| a == b) {
            let Some((tile, _)) = of_tile.first() else { continue };
            let of_tile_m = of_tile.iter().filter_map(|(_, index)| at(points, *index as usize));
            let Some(new_blocks) = self.put_tile(*tile, of_tile_m, reach_m) else {
                let reason = self.take_tile_error();
                self.clear();
                return Err(LoadError::NoRoom { refused_points: of_tile.len(), reason });
            };
            addition.new_voxels += new_blocks;
        }
        self.follow_mesh_anew();
        Ok(addition)
    }

    /// The tiles of the blocks that each point is joined to, with its index.
    fn points_by_tile(&self, points_m: &[Point3<f32>], reach_m: f64) -> Vec<(TileKey, u32)> {
        let Some(spill) = &self.spill else { return Vec::new() };
        let of_point = |(index, point_m): (u32, &Point3<f32>)| {
            spill.tiles_of(self.surface.point_box(point_m, reach_m)).map(move |tile| (tile, index))
        };
        (0..).zip(points_m).flat_map(of_point).collect()
    }

    /// Joins all points of a tile to it. Returns how many blocks it has; `None` where there is no room.
    fn put_tile(
        &mut self,
        tile: TileKey,
        coloured: impl Iterator<Item = ColouredPoint> + Clone,
        reach_m: f64,
    ) -> Option<usize> {
        let blocks_around =
            |(point, ..): ColouredPoint| self.surface.point_box(&point, reach_m).blocks();
        let most_new = coloured.clone().map(blocks_around).fold(0, u64::saturating_add);
        let spill = self.spill.as_mut()?;
        let blocks = spill.blocks_of(tile);
        spill.tiles.pass_on();
        if !self.spill_until(most_new.min(blocks.blocks()) as usize) {
            return None;
        }
        let before = self.surface.blocks();
        let refused = self.surface.put_coloured_points(coloured, reach_m, blocks);
        self.spill.as_mut()?.tiles.has(tile);
        (refused == 0).then(|| self.surface.blocks() - before)
    }

    /// Adds the views that the points of a file were seen from.
    pub(crate) fn add_views(&mut self, views: impl IntoIterator<Item = MapView>) {
        self.views.add_loaded(views);
    }

    /// Takes how the blocks of the file were seen last. A hand before a part of the lens is there for a shorter time than the least that
    /// each of them has to be missed for.
    pub(crate) fn take_last_sights(&mut self, sights: impl IntoIterator<Item = LastSight>) {
        let least_s = self.stop_s as f32;
        let at_least =
            |sight: LastSight| LastSight { lasted_s: sight.lasted_s.max(least_s), ..sight };
        self.surface.take_last_sights(sights.into_iter().map(at_least));
    }

    /// Gives the frame of the map another name. The points stay.
    pub fn rename_frame(&mut self, frame_id: &str) {
        if self.frame_id.replace(frame_id.to_owned()).is_some_and(|before| before != frame_id) {
            self.follow_mesh_anew();
        }
    }
}

/// A point with its normal and its colour.
type ColouredPoint = (Point3<f32>, Vector3<f32>, [u8; 3]);

fn at(points: &OrientedPoints, index: usize) -> Option<ColouredPoint> {
    let OrientedPoints { points_m, normals, colours } = points;
    let colour = colours.get(index).copied().unwrap_or(NO_COLOUR);
    Some((*points_m.get(index)?, *normals.get(index)?, colour))
}

/// One point for each voxel, the mean of those in it, with the sum of their normals and the mean of their colours, by ascending
/// key: a place with many points costs as one with one. Points and normals that are not finite are left out; points without normals, or
/// without colours, stay without.
#[must_use]
pub fn one_a_voxel(points: &OrientedPoints, grid: &VoxelGrid) -> OrientedPoints {
    let OrientedPoints { points_m, normals, colours } = points;
    let mut keyed: Vec<(VoxelKey, usize)> = (0..)
        .zip(points_m)
        .filter(|(_, point_m)| geometry::is_finite(point_m))
        .map(|(index, point_m)| (grid.key(point_m), index))
        .collect();
    keyed.sort_unstable();
    let of_voxel = |points: &[(VoxelKey, usize)]| {
        let own = || points.iter().filter_map(|(_, index)| points_m.get(*index));
        let sum = own().fold(Vector3::zeros(), |sum, point_m| sum + point_m.coords.cast::<f64>());
        let normals = points.iter().filter_map(|(_, index)| normals.get(*index));
        let normals = normals.filter(|normal| normal.iter().all(|along| along.is_finite()));
        let colours = points.iter().filter_map(|(_, index)| colours.get(*index));
        let point_m: Point3<f32> = Point3::from(sum / points.len() as f64).cast();
        ((point_m, normals.sum::<Vector3<f32>>()), mean_colour(colours))
    };
    let voxels = keyed.chunk_by(|a, b| a.0 == b.0).map(of_voxel);
    let ((points_m, mut sums), mut means): ((Vec<_>, Vec<_>), Vec<_>) = voxels.unzip();
    if normals.is_empty() {
        sums.clear();
    }
    if colours.is_empty() {
        means.clear();
    }
    OrientedPoints { points_m, normals: sums, colours: means }
}

/// The mean of those that are colours.
fn mean_colour<'a>(colours: impl Iterator<Item = &'a [u8; 3]>) -> [u8; 3] {
    let (mut sum, mut count) = ([0_u32; 3], 0);
    for colour in colours.filter(|colour| **colour != NO_COLOUR) {
        sum.iter_mut().zip(colour).for_each(|(sum, part)| *sum += u32::from(*part));
        count += 1;
    }
    // No larger than the largest of them.
    if count == 0 { NO_COLOUR } else { sum.map(|sum| ((sum + count / 2) / count) as u8) }
}
