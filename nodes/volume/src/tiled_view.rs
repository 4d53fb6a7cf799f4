//! What one image saw by direction, without the image: the least and the greatest depth of each of its tiles.

use geometry::Stamp;
use nalgebra::Point3;

use crate::camera_frame::CameraFrame;
use crate::depth_view::{DepthView, Kind, with_projection};
use crate::projection::{Covered, Extent, Project};

/// What an image says of a place of the map.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sight {
    /// It is outside of the image, or farther away than all that the image shows.
    OutOfView,
    /// Nothing came back from its direction.
    NoReturn,
    /// All that came back from its direction is clearly behind it.
    ReturnsBehind,
    /// Something came back from around it, or from clearly before it.
    Returns,
}

/// The depths of one image by direction.
#[derive(Clone, Debug)]
pub struct TiledView {
    stamp: Stamp,
    pub(crate) kind: Kind,
    frame: CameraFrame,
    pub(crate) tile_px: usize,
    pub(crate) columns: usize,
    rows: usize,
    /// The least depth of each tile, row by row; 0 where nothing came back.
    pub(crate) least_m: Vec<f32>,
    /// The greatest depth of each tile; 0 where nothing came back.
    pub(crate) most_m: Vec<f32>,
    farthest_m: f32,
}

impl TiledView {
    /// What an image saw.
    #[must_use]
    pub fn of(view: &DepthView) -> Self {
        let tiles = &**view.tiles;
        Self {
            stamp: view.stamp,
            kind: view.kind,
            frame: CameraFrame::new(&view.map_from_camera),
            tile_px: tiles.tile_px(),
            columns: tiles.columns(),
            rows: tiles.rows(),
            least_m: tiles.least_return_m().to_vec(),
            most_m: tiles.most_m().to_vec(),
            farthest_m: view.farthest_m(),
        }
    }

    /// The time of the image.
    #[must_use]
    pub fn stamp(&self) -> Stamp {
        self.stamp
    }

    /// The camera's optical centre.
    #[must_use]
    pub fn camera_in_map_m(&self) -> Point3<f64> {
        self.frame.camera_in_map_m
    }

    /// What the image says of a place: by the tile in its direction, and by what came back from the voxel around it and from
    /// one beside that, the means of whose depths are no better than that.
    #[must_use]
    pub fn sight(&self, place_in_map_m: &Point3<f64>, voxel_edge_m: f64) -> Sight {
        let direction = self.covered(place_in_map_m, 0.0);
        let voxel = self.covered(place_in_map_m, voxel_edge_m);
        let (Some(direction), Some(voxel)) = (direction, voxel) else { return Sight::OutOfView };
        if direction.is_cut || direction.nearest_m > self.farthest_m {
            return Sight::OutOfView;
        }
        let edge_m = voxel_edge_m as f32;
        let (before_m, behind_m) = (voxel.nearest_m - edge_m, voxel.farthest_m + edge_m);
        let depths_m = |tile: usize| match (self.least_m.get(tile), self.most_m.get(tile)) {
            (Some(&least_m), Some(&most_m)) if least_m > 0.0 => Some((least_m, most_m)),
            _ => None,
        };
        let is_around = |(least_m, most_m)| least_m <= behind_m && most_m >= before_m;
        if self.tiles(voxel.columns, voxel.rows).filter_map(depths_m).any(is_around) {
            return Sight::Returns;
        }
        match self.tiles(direction.columns, direction.rows).find_map(depths_m) {
            None => Sight::NoReturn,
            Some((least_m, _)) if least_m > behind_m => Sight::ReturnsBehind,
            Some(_) => Sight::Returns,
        }
    }

    /// The part of the image that a cube covers; `None` where that is nothing, or not known.
    pub(crate) fn covered(&self, middle_in_map_m: &Point3<f64>, edge_m: f64) -> Option<Covered> {
        if !middle_in_map_m.iter().all(|along_m| along_m.is_finite()) {
            return None;
        }
        let cube = self.frame.around_cube(middle_in_map_m, edge_m as f32);
        match with_projection!(self.kind, projection => projection.extent(&cube)) {
            Extent::Within(covered) => Some(covered),
            Extent::Outside | Extent::Undecided => None,
        }
    }

    /// The length that a pixel spans at a depth of 1 m.
    pub(crate) fn pixel_slope(&self) -> f32 {
        with_projection!(self.kind, projection => projection.pixel_slope())
    }

    /// The indices of the tiles that hold these columns and rows of pixels, first and last.
    pub(crate) fn tiles(
        &self,
        [left, right]: [u32; 2],
        [top, bottom]: [u32; 2],
    ) -> impl Iterator<Item = usize> + use<> {
        let tile_px = self.tile_px.max(1);
        let within = move |first: u32, last: u32, tiles: usize| {
            first as usize / tile_px..(last as usize / tile_px + 1).min(tiles)
        };
        let (tile_columns, width) = (within(left, right, self.columns), self.columns);
        within(top, bottom, self.rows)
            .flat_map(move |row| tile_columns.clone().map(move |column| row * width + column))
    }
}
