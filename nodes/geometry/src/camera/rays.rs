//! The rays of all pixels, computed once.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use nalgebra::{Point2, Vector2};

use super::{CameraModel, CameraModelError};

/// A camera whose numbers are checked, with the ray `(x / z, y / z)` of each of its pixels, so that lens distortion costs nothing
/// per frame.
///
/// The rays are computed at the first use, and clones share them.
#[derive(Clone, Debug)]
pub struct RayTable {
    camera: CameraModel,
    rays: Arc<OnceLock<Arc<Rays>>>,
}

/// The rays follow from the camera.
impl PartialEq for RayTable {
    fn eq(&self, other: &Self) -> bool {
        self.camera == other.camera
    }
}

#[derive(Debug)]
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

impl Rays {
    fn of(camera: &CameraModel) -> Self {
        let CameraModel { width_px, height_px, .. } = *camera;
        if camera.distortion.is_none() {
            return Self::Separable {
                x_of_column: (0..width_px)
                    .map(|column| ((column as f64 - camera.cx_px) / camera.fx_px) as f32)
                    .collect(),
                y_of_row: (0..height_px)
                    .map(|row| ((row as f64 - camera.cy_px) / camera.fy_px) as f32)
                    .collect(),
            };
        }
        let pixels = (0..height_px).flat_map(|row| (0..width_px).map(move |column| (column, row)));
        let (x, y) = pixels
            .map(|(column, row)| {
                let ray = camera.ray(&Point2::new(column as f64, row as f64));
                ray.map_or((f32::NAN, f32::NAN), |ray| (ray.x as f32, ray.y as f32))
            })
            .unzip();
        Self::PerPixel { x, y }
    }
}

impl RayTable {
    /// The rays of `camera`.
    ///
    /// # Errors
    /// When the numbers do not describe a camera; see [`CameraModel::validate`].
    pub fn new(camera: &CameraModel) -> Result<Self, CameraModelError> {
        camera.validate()?;
        Ok(Self::of_valid(*camera))
    }

    /// The rays of a camera that is known to be one.
    pub(crate) fn of_valid(camera: CameraModel) -> Self {
        Self { camera, rays: Arc::default() }
    }

    /// Shares the rays of `last`, where that is the table of the same camera, and takes its place: for images that come as messages,
    /// each with a camera of its own.
    pub fn share_with(&self, last: &mut Option<Self>) {
        if let Some(last) = last.as_ref().filter(|last| *last == self) {
            // Where they are computed already they stay.
            let _ = self.rays.set(Arc::clone(last.computed()));
        }
        *last = Some(self.clone());
    }

    fn computed(&self) -> &Arc<Rays> {
        self.rays.get_or_init(|| Arc::new(Rays::of(&self.camera)))
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
        match &**self.computed() {
            Rays::Separable { x_of_column, y_of_row } => {
                Some(RayRow::Straight { x: x_of_column, y: *y_of_row.get(row_px)? })
            }
            Rays::PerPixel { x, y } => {
                Some(RayRow::Bent { x: x.get(start..end)?, y: y.get(start..end)? })
            }
        }
    }
}
