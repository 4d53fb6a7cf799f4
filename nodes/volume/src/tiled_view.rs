//! What one image saw by direction, without the image: the least and the greatest depth of each of its tiles.

use std::ops::Range;

use geometry::Stamp;
use nalgebra::Point3;

use crate::camera_frame::CameraFrame;
use crate::depth_view::{DepthView, Kind, with_projection};
use crate::projection::{CameraBox, Covered, Extent, Project};

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
            most_m: tiles.most_m().collect(),
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
        let Some(cube) = self.cube(place_in_map_m, voxel_edge_m) else { return Sight::OutOfView };
        let point = CameraBox { half_m: [0.0; 3], ..cube };
        let Some(direction) = self.covered_by(&point) else { return Sight::OutOfView };
        if direction.is_cut || direction.nearest_m > self.farthest_m {
            return Sight::OutOfView;
        }
        let Some(voxel) = self.covered_by(&cube) else { return Sight::OutOfView };
        let edge_m = voxel_edge_m as f32;
        let (before_m, behind_m) = (voxel.nearest_m - edge_m, voxel.farthest_m + edge_m);
        let in_direction = self.nearest_return_m(&direction);
        let is_before_or_around = in_direction.is_some_and(|least_m| least_m <= behind_m);
        if is_before_or_around || self.has_returns_between(&voxel, before_m, behind_m) {
            return Sight::Returns;
        }
        if in_direction.is_some() { Sight::ReturnsBehind } else { Sight::NoReturn }
    }

    /// The part of the image that a cube covers; `None` where that is nothing, or not known.
    pub(crate) fn covered(&self, middle_in_map_m: &Point3<f64>, edge_m: f64) -> Option<Covered> {
        self.covered_by(&self.cube(middle_in_map_m, edge_m)?)
    }

    /// A cube of the map in the camera's frame; `None` where its centre is not finite.
    fn cube(&self, middle_in_map_m: &Point3<f64>, edge_m: f64) -> Option<CameraBox> {
        let is_finite = middle_in_map_m.iter().all(|along_m| along_m.is_finite());
        is_finite.then(|| self.frame.around_cube(middle_in_map_m, edge_m as f32))
    }

    fn covered_by(&self, cube: &CameraBox) -> Option<Covered> {
        match with_projection!(self.kind, projection => projection.extent(cube)) {
            Extent::Within(covered) => Some(covered),
            Extent::Outside | Extent::Undecided => None,
        }
    }

    /// The least depth of the first tile of a part of the image from which something came back.
    fn nearest_return_m(&self, part: &Covered) -> Option<f32> {
        let depths_m =
            self.tiles(part.columns, part.rows).filter_map(|tile| self.least_m.get(tile));
        depths_m.copied().find(|least_m| *least_m > 0.0)
    }

    /// Whether the depths of some tile of a part of the image may be between these.
    fn has_returns_between(&self, part: &Covered, before_m: f32, behind_m: f32) -> bool {
        let (columns, rows) = self.tile_ranges(part.columns, part.rows);
        rows.into_iter().any(|row| {
            let tiles = row * self.columns + columns.start..row * self.columns + columns.end;
            let least_m = self.least_m.get(tiles.clone()).unwrap_or_default();
            let most_m = self.most_m.get(tiles).unwrap_or_default();
            // Not short-circuiting: the compiler tests several at once.
            least_m.iter().zip(most_m).fold(false, |is_between, (&least_m, &most_m)| {
                is_between | ((least_m > 0.0) & (least_m <= behind_m) & (most_m >= before_m))
            })
        })
    }

    /// The length that a pixel spans at a depth of 1 m.
    pub(crate) fn pixel_slope(&self) -> f32 {
        with_projection!(self.kind, projection => projection.pixel_slope())
    }

    /// The indices of the tiles that hold these columns and rows of pixels, first and last.
    pub(crate) fn tiles(
        &self,
        columns_px: [u32; 2],
        rows_px: [u32; 2],
    ) -> impl Iterator<Item = usize> + use<> {
        let (columns, rows) = self.tile_ranges(columns_px, rows_px);
        let width = self.columns;
        rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
    }

    /// The columns and the rows of these tiles.
    fn tile_ranges(
        &self,
        [left, right]: [u32; 2],
        [top, bottom]: [u32; 2],
    ) -> (Range<usize>, Range<usize>) {
        // A shift: the edge is a power of two, and divisions would take longer than all the rest.
        let shift = self.tile_px.max(1).trailing_zeros();
        let within = |first: u32, last: u32, tiles: usize| {
            (first >> shift) as usize..((last >> shift) as usize + 1).min(tiles)
        };
        (within(left, right, self.columns), within(top, bottom, self.rows))
    }
}
