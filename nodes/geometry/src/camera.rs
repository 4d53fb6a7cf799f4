//! The pinhole camera with lens distortion.

mod coefficients;
mod distortion;
mod rays;
#[cfg(test)]
mod tests;

use nalgebra::{Point2, Point3, Vector2};
use serde::{Deserialize, Serialize};

pub use coefficients::DistortionError;
pub use distortion::Distortion;
pub(crate) use rays::RayRow;
pub use rays::RayTable;

/// A pinhole camera. A pixel's centre has whole coordinates, as OpenCV and ROS have it.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct CameraModel {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Focal length in columns.
    pub fx_px: f64,
    /// Focal length in rows.
    pub fy_px: f64,
    /// Column of the principal point.
    pub cx_px: f64,
    /// Row of the principal point.
    pub cy_px: f64,
    /// Lens distortion.
    pub distortion: Distortion,
}

/// The numbers do not describe a camera.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum CameraModelError {
    /// The image has no pixels, or more than [`CameraModel::MAX_PIXELS`].
    #[error(
        "a camera image of {width_px} x {height_px} pixels: it must have between 1 and {} of them",
        CameraModel::MAX_PIXELS
    )]
    Size {
        /// Columns.
        width_px: usize,
        /// Rows.
        height_px: usize,
    },
    /// A focal length is not a positive number: the camera is not calibrated.
    #[error(
        "focal lengths of {fx_px} and {fy_px} px: both must be positive numbers; \
         a driver sends 0 until its camera is calibrated"
    )]
    FocalLength {
        /// In columns.
        fx_px: f64,
        /// In rows.
        fy_px: f64,
    },
    /// The principal point is not finite.
    #[error("a principal point at column {cx_px}, row {cy_px}: both must be finite numbers")]
    PrincipalPoint {
        /// Column.
        cx_px: f64,
        /// Row.
        cy_px: f64,
    },
    /// A pixel looks nearly along the image plane, or all pixels look into one direction.
    #[error(
        "a focal length of {focal_px:?} px, and a pixel {farthest_px:?} px from the principal point: no lens shows that; \
         a pixel is at most {:.1} degrees from the axis, and a focal length at most {} px",
        CameraModel::STEEPEST_SLOPE.atan().to_degrees(),
        CameraModel::LONGEST_FOCAL_LENGTH_PX
    )]
    View {
        /// The focal length along one axis of the image.
        focal_px: f64,
        /// How far the border of the image is from the principal point along that axis.
        farthest_px: f64,
    },
    /// A distortion coefficient is not finite.
    #[error("distortion coefficient {index} is {value}: it must be a finite number")]
    Distortion {
        /// Which one, counted from 0 in the order of `sensor_msgs/CameraInfo`.
        index: usize,
        /// What it is.
        value: f64,
    },
}

impl CameraModel {
    /// The largest image that is accepted, 4096 x 4096: no depth camera has more, and a message that
    /// states a wrong size must not decide how much memory is taken.
    pub const MAX_PIXELS: usize = 1 << 24;

    /// The steepest direction of a pixel, before the distortion: x or y over z. A lens without distortion that sees 120 degrees
    /// has 1.7; with this the farthest depth that an image can state lies within kilometres.
    const STEEPEST_SLOPE: f64 = 100.0;

    /// The longest focal length: a pixel of the longest telescopes of survey cameras has 1e5.
    const LONGEST_FOCAL_LENGTH_PX: f64 = 1e6;

    /// Checks that the numbers describe a camera.
    ///
    /// # Errors
    /// When a number is not finite, a focal length is not positive, no lens has such a view, or the image has no pixels or
    /// more than [`MAX_PIXELS`](Self::MAX_PIXELS).
    pub fn validate(&self) -> Result<(), CameraModelError> {
        let Self { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion } = *self;
        let pixels = width_px.checked_mul(height_px);
        if !pixels.is_some_and(|pixels| (1..=Self::MAX_PIXELS).contains(&pixels)) {
            return Err(CameraModelError::Size { width_px, height_px });
        }
        let is_length = |length: f64| length.is_finite() && length > 0.0;
        if !is_length(fx_px) || !is_length(fy_px) {
            return Err(CameraModelError::FocalLength { fx_px, fy_px });
        }
        if !cx_px.is_finite() || !cy_px.is_finite() {
            return Err(CameraModelError::PrincipalPoint { cx_px, cy_px });
        }
        for (size_px, focal_px, middle_px) in [(width_px, fx_px, cx_px), (height_px, fy_px, cy_px)]
        {
            let farthest_px = middle_px.abs().max((size_px as f64 - middle_px).abs());
            let is_view = focal_px <= Self::LONGEST_FOCAL_LENGTH_PX
                && farthest_px <= Self::STEEPEST_SLOPE * focal_px;
            if !is_view {
                return Err(CameraModelError::View { focal_px, farthest_px });
            }
        }
        let coefficients = distortion.coefficients();
        match coefficients.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            Some((index, &value)) => Err(CameraModelError::Distortion { index, value }),
            None => Ok(()),
        }
    }

    /// Where a point of the camera frame (x right, y down, z forward, in metres) appears, as column
    /// and row.
    ///
    /// `None` where the camera does not see it: it is not in front, it falls outside the image, or it
    /// is so far off the axis that the lens model folds over and no longer describes the lens.
    #[must_use]
    pub fn project(&self, point_in_camera: &Point3<f64>) -> Option<Point2<f64>> {
        self.project_beyond(point_in_camera).filter(|pixel| self.contains(pixel))
    }

    /// The same where it falls beside the image, too, as the middle of what reaches into it.
    #[must_use]
    pub fn project_beyond(&self, point_in_camera: &Point3<f64>) -> Option<Point2<f64>> {
        if point_in_camera.z <= 0.0 {
            return None;
        }
        let ray = point_in_camera.xy().coords / point_in_camera.z;
        let seen = self.distortion.distort(&ray)?;
        Some(Point2::new(self.fx_px * seen.x + self.cx_px, self.fy_px * seen.y + self.cy_px))
    }

    /// The ray of a pixel, `(x / z, y / z)` in the camera frame: the point that the pixel sees at a
    /// depth of `z` metres is `(x / z * z, y / z * z, z)`.
    ///
    /// `None` where the lens model gives this pixel no ray.
    #[must_use]
    pub fn ray(&self, pixel: &Point2<f64>) -> Option<Vector2<f64>> {
        let seen =
            Vector2::new((pixel.x - self.cx_px) / self.fx_px, (pixel.y - self.cy_px) / self.fy_px);
        self.distortion.undistort(&seen)
    }

    /// Whether a position lies on the image, whose outer pixels reach half a pixel beyond their
    /// centres.
    #[must_use]
    pub fn contains(&self, pixel: &Point2<f64>) -> bool {
        let within = |value: f64, size: usize| value >= -0.5 && value < size as f64 - 0.5;
        within(pixel.x, self.width_px) && within(pixel.y, self.height_px)
    }
}
