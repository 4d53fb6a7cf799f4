//! Places of an image that small surfaces cover.

use geometry::CameraModel;
use nalgebra::{Point2, Point3};

/// So much of a pixel is covered by rounding: a pixel that is projected into its own camera covers itself alone.
const ROUNDING_PX: f64 = 0.01;

/// The pixels that surfaces cover in the image of a camera, however large these are there: each costs the same.
pub(crate) struct Splats<'a> {
    camera: &'a CameraModel,
    /// How many more surfaces cover a pixel than the one to its left, than in the row above; a column and a row more than the image.
    steps: Vec<i32>,
}

impl<'a> Splats<'a> {
    pub(crate) fn new(camera: &'a CameraModel) -> Self {
        let (columns, rows) =
            (camera.width_px.saturating_add(1), camera.height_px.saturating_add(1));
        Self { camera, steps: vec![0; columns.saturating_mul(rows)] }
    }

    /// Adds a surface that faces the camera: its middle, and its width and height.
    pub(crate) fn add(&mut self, middle_m: &Point3<f64>, [width_m, height_m]: [f64; 2]) {
        let CameraModel { width_px, height_px, fx_px, fy_px, .. } = *self.camera;
        let Some(Point2 { coords }) = self.camera.project_beyond(middle_m) else { return };
        let half_px = |size_m: f64, focal_px: f64| 0.5 * size_m * focal_px / middle_m.z;
        let (Some([left, right]), Some([top, bottom])) = (
            covered(coords.x, half_px(width_m, fx_px), width_px),
            covered(coords.y, half_px(height_m, fy_px), height_px),
        ) else {
            return;
        };
        let columns = width_px + 1;
        for (row, column, step) in
            [(top, left, 1), (top, right, -1), (bottom, left, -1), (bottom, right, 1)]
        {
            if let Some(place) = self.steps.get_mut(row * columns + column) {
                *place += step;
            }
        }
    }

    /// Which pixels are covered, row by row.
    pub(crate) fn into_mask(self) -> Vec<bool> {
        let CameraModel { width_px, height_px, .. } = *self.camera;
        let mut mask = Vec::with_capacity(width_px * height_px);
        let mut covers = vec![0_i32; width_px + 1];
        for row in self.steps.chunks(width_px + 1).take(height_px) {
            let mut in_row = 0;
            for (covers, step) in covers.iter_mut().zip(row) {
                in_row += step;
                *covers += in_row;
            }
            mask.extend(covers.iter().take(width_px).map(|covers| *covers > 0));
        }
        mask
    }
}

/// The first pixel that is covered, and the one behind the last; `None` where none of the image is.
fn covered(middle_px: f64, half_px: f64, size_px: usize) -> Option<[usize; 2]> {
    let half_px = (half_px - ROUNDING_PX).max(0.0);
    // A pixel reaches half a pixel to each side of its centre.
    let (first, last) = ((middle_px - half_px + 0.5).floor(), (middle_px + half_px - 0.5).ceil());
    if !(first.is_finite() && last.is_finite()) || last < 0.0 || first >= size_px as f64 {
        return None;
    }
    // The casts saturate, at 0 too.
    Some([first as usize, (last as usize).saturating_add(1).min(size_px)])
}
