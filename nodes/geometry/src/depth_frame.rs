//! A depth image with its camera, and which of its pixels move.

use std::sync::Arc;

use crate::{CameraModel, CameraModelError, DepthCameraError, DepthImage, DepthPixels};

/// The depth image of a cycle and the camera that took it, for a map that is finer than the reduced cloud.
///
/// Depths are whole millimetres, 0 where nothing was measured (`16UC1` of REP-118), whatever encoding they arrived in: so
/// they are the same numbers in one process as over DDS, where they are compressed without loss.
#[derive(Clone, PartialEq, Debug)]
pub struct DepthFrame {
    image: DepthImage,
    camera: CameraModel,
}

/// An image and a camera that are not of each other.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum DepthFrameError {
    /// The camera is none.
    #[error(transparent)]
    Camera(#[from] CameraModelError),
    /// The image is of another size.
    #[error(transparent)]
    Size(#[from] DepthCameraError),
}

impl DepthFrame {
    /// The image, in whole millimetres, with its camera.
    ///
    /// # Errors
    /// When the camera is none, or the image is of another size.
    pub fn new(image: &DepthImage, camera: CameraModel) -> Result<Self, DepthFrameError> {
        camera.validate()?;
        let (image_width_px, image_height_px) = (image.width_px(), image.height_px());
        let (camera_width_px, camera_height_px) = (camera.width_px, camera.height_px);
        if (image_width_px, image_height_px) != (camera_width_px, camera_height_px) {
            return Err(DepthFrameError::Size(DepthCameraError {
                image_width_px,
                image_height_px,
                camera_width_px,
                camera_height_px,
            }));
        }
        let image = match image.pixels() {
            DepthPixels::Millimetres(_) => image.clone(),
            DepthPixels::Metres(depths_m) => {
                let pixels = depths_m.iter().map(|depth_m| millimetres(*depth_m)).collect();
                image.with_millimetres(pixels)
            }
        };
        Ok(Self { image, camera })
    }

    /// The image.
    #[must_use]
    pub fn image(&self) -> &DepthImage {
        &self.image
    }

    /// Its camera.
    #[must_use]
    pub fn camera(&self) -> &CameraModel {
        &self.camera
    }
}

/// 0 where nothing was measured. What is farther than the format can say is as far as it can: the space before it is free.
fn millimetres(depth_m: f32) -> u16 {
    if depth_m.is_finite() && depth_m > 0.0 {
        // The cast saturates.
        (depth_m * 1e3).round() as u16
    } else {
        0
    }
}

/// A depth image of which it is known which pixels show something that moves.
#[derive(Clone, PartialEq, Debug)]
pub struct MaskedDepth {
    /// The image with its camera.
    pub frame: Arc<DepthFrame>,
    /// For each pixel, row by row, whether it shows something that moves, or may.
    pub is_moving: Vec<bool>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Distortion, Stamp};

    fn camera() -> CameraModel {
        let (width_px, height_px, distortion) = (3, 2, Distortion::None);
        let (fx_px, fy_px, cx_px, cy_px) = (3.0, 3.0, 1.0, 0.5);
        CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion }
    }

    fn image(size_px: (usize, usize), pixels: DepthPixels) -> DepthImage {
        DepthImage::new(Stamp::from_nanos(7), "camera".to_owned(), size_px, pixels).unwrap()
    }

    #[test]
    fn metres_become_whole_millimetres_and_what_is_no_depth_becomes_none() {
        let metres = vec![1.0004, f32::NAN, f32::INFINITY, -1.0, 0.0, 80.0];
        let frame = DepthFrame::new(&image((3, 2), DepthPixels::Metres(metres)), camera()).unwrap();
        let expected = DepthPixels::Millimetres(vec![1000, 0, 0, 0, 0, u16::MAX]);
        assert_eq!(frame.image(), &image((3, 2), expected));
    }

    #[test]
    fn an_image_of_another_size_than_its_camera_is_refused() {
        let depths = DepthPixels::Millimetres(vec![1000; 6]);
        assert!(DepthFrame::new(&image((3, 2), depths.clone()), camera()).is_ok());
        let error = DepthFrame::new(&image((2, 3), depths), camera()).unwrap_err();
        assert!(error.to_string().contains("2 x 3"), "{error}");
    }
}
