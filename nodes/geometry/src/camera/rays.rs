//! The rays of all pixels, computed once.

use std::ops::Range;

use nalgebra::{Point2, Vector2};

use super::{CameraModel, CameraModelError};

/// The ray `(x / z, y / z)` of every pixel of a camera, so that lens distortion costs nothing per
/// frame.
#[derive(Clone, PartialEq, Debug)]
pub struct RayTable {
    camera: CameraModel,
    rays: Rays,
}

#[derive(Clone, PartialEq, Debug)]
enum Rays {
    /// Without distortion x depends on the column alone and y on the row.
    Separable { x_of_column: Vec<f32>, y_of_row: Vec<f32> },
    /// Row by row; NaN where the lens model gives a pixel no ray.
    PerPixel { x: Vec<f32>, y: Vec<f32> },
}

/// The rays of one row of pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) enum RayRow<'a> {
    /// One y for the whole row.
    Straight { x: &'a [f32], y: f32 },
    /// A y for each pixel.
    Bent { x: &'a [f32], y: &'a [f32] },
}

impl<'a> RayRow<'a> {
    /// The rays of some of the row's columns; of none where the row is shorter.
    pub(crate) fn part(&self, columns: Range<usize>) -> RayRow<'a> {
        let part = |values: &'a [f32]| values.get(columns.clone()).unwrap_or_default();
        match *self {
            RayRow::Straight { x, y } => RayRow::Straight { x: part(x), y },
            RayRow::Bent { x, y } => RayRow::Bent { x: part(x), y: part(y) },
        }
    }
}

impl RayTable {
    /// The rays of `camera`.
    ///
    /// # Errors
    /// When the numbers do not describe a camera; see [`CameraModel::validate`].
    pub fn new(camera: &CameraModel) -> Result<Self, CameraModelError> {
        camera.validate()?;
        let CameraModel { width_px, height_px, .. } = *camera;
        let rays = if camera.distortion.is_none() {
            Rays::Separable {
                x_of_column: (0..width_px)
                    .map(|column| ((column as f64 - camera.cx_px) / camera.fx_px) as f32)
                    .collect(),
                y_of_row: (0..height_px)
                    .map(|row| ((row as f64 - camera.cy_px) / camera.fy_px) as f32)
                    .collect(),
            }
        } else {
            let pixels =
                (0..height_px).flat_map(|row| (0..width_px).map(move |column| (column, row)));
            let (x, y) = pixels
                .map(|(column, row)| {
                    let ray = camera.ray(&Point2::new(column as f64, row as f64));
                    ray.map_or((f32::NAN, f32::NAN), |ray| (ray.x as f32, ray.y as f32))
                })
                .unzip();
            Rays::PerPixel { x, y }
        };
        Ok(Self { camera: *camera, rays })
    }

    /// The camera.
    #[must_use]
    pub fn camera(&self) -> &CameraModel {
        &self.camera
    }

    /// Columns.
    #[must_use]
    pub fn width_px(&self) -> usize {
        self.camera.width_px
    }

    /// Rows.
    #[must_use]
    pub fn height_px(&self) -> usize {
        self.camera.height_px
    }

    /// The ray `(x / z, y / z)` of a pixel. `None` outside the image, and where the lens model gives
    /// the pixel no ray.
    #[must_use]
    pub fn ray(&self, column_px: usize, row_px: usize) -> Option<Vector2<f32>> {
        if column_px >= self.camera.width_px {
            return None;
        }
        let ray = match self.row(row_px)? {
            RayRow::Straight { x, y } => Vector2::new(*x.get(column_px)?, y),
            RayRow::Bent { x, y } => Vector2::new(*x.get(column_px)?, *y.get(column_px)?),
        };
        (!ray.x.is_nan()).then_some(ray)
    }

    /// The rays of a row; `None` outside the image.
    pub(crate) fn row(&self, row_px: usize) -> Option<RayRow<'_>> {
        let start = row_px.checked_mul(self.camera.width_px)?;
        let end = start.checked_add(self.camera.width_px)?;
        match &self.rays {
            Rays::Separable { x_of_column, y_of_row } => {
                Some(RayRow::Straight { x: x_of_column, y: *y_of_row.get(row_px)? })
            }
            Rays::PerPixel { x, y } => {
                Some(RayRow::Bent { x: x.get(start..end)?, y: y.get(start..end)? })
            }
        }
    }
}
