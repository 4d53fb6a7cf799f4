//! Images as a pinhole camera without distortion would take them.

use geometry::{
    CameraModel, CameraModelError, DepthImage, DepthPixels, DepthSizeError, Distortion,
};
use nalgebra::{Point2, Point3};

use super::GrayImage;

/// Where each pixel of a camera without distortion is in the images of one with distortion; built once for a camera.
#[derive(Clone, PartialEq, Debug)]
pub struct Rectification {
    target: CameraModel,
    source_size_px: (usize, usize),
    /// Row by row; where the source does not see what the target would, the nearest pixel that it has.
    taps: Vec<Tap>,
}

/// The four pixels around a position in the source.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Tap {
    /// The upper left one, as an index into the source.
    first: u32,
    /// How near the position is to the right and the lower ones, in parts of 128.
    right_parts: u8,
    lower_parts: u8,
    is_seen: bool,
}

/// A position is exact to 1/256 pixel.
const PARTS: u32 = 128;

/// A camera or an image does not fit.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum RectificationError {
    /// The numbers do not describe a camera.
    #[error(transparent)]
    Camera(#[from] CameraModelError),
    /// The camera to rectify for has distortion itself.
    #[error("the camera that images are rectified for must have no distortion")]
    DistortedTarget,
    /// A camera with this few pixels has none to interpolate between.
    #[error("images of {width_px} x {height_px} pixels are too small to be rectified")]
    TooSmall {
        /// Columns.
        width_px: usize,
        /// Rows.
        height_px: usize,
    },
    /// The image was taken by another camera.
    #[error("the image has {width_px} x {height_px} pixels, the camera {camera_px:?}")]
    ImageSize {
        /// Columns of the image.
        width_px: usize,
        /// Rows of the image.
        height_px: usize,
        /// Columns and rows of the camera.
        camera_px: (usize, usize),
    },
    /// The depth image could not be put together.
    #[error(transparent)]
    Depth(#[from] DepthSizeError),
}

impl Rectification {
    /// From the images of `source` to those that a camera like it, but without distortion, would take.
    ///
    /// # Errors
    /// As [`between`](Self::between).
    pub fn new(source: &CameraModel) -> Result<Self, RectificationError> {
        Self::between(source, &CameraModel { distortion: Distortion::None, ..*source })
    }

    /// From the images of `source` to those of `target`, which is in the same place and turned alike, and has no
    /// distortion.
    ///
    /// # Errors
    /// When the numbers do not describe cameras, when `target` has distortion, and when `source` is narrower or lower
    /// than 2 pixels.
    pub fn between(source: &CameraModel, target: &CameraModel) -> Result<Self, RectificationError> {
        source.validate()?;
        target.validate()?;
        if !target.distortion.is_none() {
            return Err(RectificationError::DistortedTarget);
        }
        let (width_px, height_px) = (source.width_px, source.height_px);
        if width_px.min(height_px) < 2 {
            return Err(RectificationError::TooSmall { width_px, height_px });
        }
        let pixels = (0..target.height_px)
            .flat_map(|row| (0..target.width_px).map(move |column| (column, row)));
        let taps = pixels.map(|(column, row)| {
            let pixel = Point2::new(column as f64, row as f64);
            tap(source, target, &pixel)
        });
        Ok(Self { target: *target, source_size_px: (width_px, height_px), taps: taps.collect() })
    }

    /// The camera that the rectified images are of.
    #[must_use]
    pub fn target(&self) -> &CameraModel {
        &self.target
    }

    /// Whether the source sees what this pixel of the target shows. Elsewhere a gray image repeats the edge of what is
    /// seen, so that no edge arises that is not there, and a depth image has no depth.
    #[must_use]
    pub fn is_seen(&self, column: usize, row: usize) -> bool {
        let is_inside = column < self.target.width_px && row < self.target.height_px;
        is_inside
            && self.taps.get(row * self.target.width_px + column).is_some_and(|tap| tap.is_seen)
    }

    /// A gray image, rectified by bilinear interpolation.
    ///
    /// # Errors
    /// When the image is not of the source's size.
    pub fn rectify(&self, image: &GrayImage) -> Result<GrayImage, RectificationError> {
        let (width_px, height_px) = (image.width_px(), image.height_px());
        self.check_size(width_px, height_px)?;
        let pixels = image.pixels();
        let rectified = self.taps.iter().map(|tap| {
            let first = tap.first as usize;
            let upper = pixels.get(first..first + 2).unwrap_or(&[0, 0]);
            let lower = pixels.get(first + width_px..first + width_px + 2).unwrap_or(&[0, 0]);
            let (right, down) = (u32::from(tap.right_parts), u32::from(tap.lower_parts));
            let along =
                |pair: &[u8]| u32::from(pair[0]) * (PARTS - right) + u32::from(pair[1]) * right;
            let sum = along(upper) * (PARTS - down) + along(lower) * down;
            ((sum + PARTS * PARTS / 2) / (PARTS * PARTS)) as u8
        });
        let rectified = rectified.collect();
        let target = &self.target;
        GrayImage::new(target.width_px, target.height_px, rectified).map_err(|_| {
            RectificationError::ImageSize { width_px, height_px, camera_px: self.source_size_px }
        })
    }

    /// A depth image, rectified by taking the nearest pixel: a mean of two depths would be a point in the air.
    ///
    /// # Errors
    /// When the image is not of the source's size.
    pub fn rectify_depth(&self, image: &DepthImage) -> Result<DepthImage, RectificationError> {
        let width_px = image.width_px();
        self.check_size(width_px, image.height_px())?;
        let nearest = |tap: &Tap| {
            let to_right = usize::from(u32::from(tap.right_parts) * 2 >= PARTS);
            let down = if u32::from(tap.lower_parts) * 2 >= PARTS { width_px } else { 0 };
            tap.is_seen.then_some(tap.first as usize + to_right + down)
        };
        let indices = self.taps.iter().map(nearest);
        let pixels = match image.pixels() {
            DepthPixels::Millimetres(values) => DepthPixels::Millimetres(
                indices
                    .map(|index| index.and_then(|index| values.get(index)).copied().unwrap_or(0))
                    .collect(),
            ),
            DepthPixels::Metres(values) => DepthPixels::Metres(
                indices
                    .map(|index| {
                        index.and_then(|index| values.get(index)).copied().unwrap_or(f32::NAN)
                    })
                    .collect(),
            ),
        };
        let size_px = (self.target.width_px, self.target.height_px);
        Ok(DepthImage::new(image.stamp, image.frame_id.clone(), size_px, pixels)?)
    }

    fn check_size(&self, width_px: usize, height_px: usize) -> Result<(), RectificationError> {
        if (width_px, height_px) == self.source_size_px {
            return Ok(());
        }
        Err(RectificationError::ImageSize { width_px, height_px, camera_px: self.source_size_px })
    }
}

/// Where a pixel of the target is in the source.
fn tap(source: &CameraModel, target: &CameraModel, pixel: &Point2<f64>) -> Tap {
    let ray = Point3::new(
        (pixel.x - target.cx_px) / target.fx_px,
        (pixel.y - target.cy_px) / target.fy_px,
        1.0,
    );
    let seen = source.project(&ray);
    // Pixels outside of the lens model are near no edge that matters: the undistorted pixel is used.
    let shown = source.distortion.distort(&ray.xy().coords).unwrap_or(ray.xy().coords);
    let position = seen.unwrap_or_else(|| {
        Point2::new(source.fx_px * shown.x + source.cx_px, source.fy_px * shown.y + source.cy_px)
    });
    let along = |position: f64, size: usize| {
        let inside = position.clamp(0.0, (size - 1) as f64);
        let first = (inside as usize).min(size - 2);
        (first, ((inside - first as f64) * f64::from(PARTS)).round() as u8)
    };
    let (column, right_parts) = along(position.x, source.width_px);
    let (row, lower_parts) = along(position.y, source.height_px);
    let first = (row * source.width_px + column) as u32;
    Tap { first, right_parts, lower_parts, is_seen: seen.is_some() }
}

#[cfg(test)]
mod tests;
