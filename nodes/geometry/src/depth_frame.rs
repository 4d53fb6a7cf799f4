//! A depth image with its camera, and which of its pixels move.

mod cloud_camera;
mod pinhole_fit;
mod points_in_view;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use nalgebra::Point3;

use crate::{
    CameraModel, CameraModelError, ColourSizeError, DepthCameraError, DepthImage, DepthPixels,
    NO_COLOUR,
};
pub use cloud_camera::CloudCamera;
pub use pinhole_fit::PinholeFitError;

/// The depth image of a cycle and its camera. Segmentation's evidence of free space and the map of the depth images are computed
/// from it.
///
/// Depths are whole millimetres, 0 where nothing was measured (`16UC1` of REP-118), whatever encoding they arrived in: so
/// they are the same numbers in one process as over DDS, where they are compressed without loss. Colours, where the cycle has a
/// colour image, are those of the depth image's pixels ([`ColourRegistration`](crate::ColourRegistration)).
#[derive(Clone, PartialEq, Debug)]
pub struct DepthFrame {
    image: DepthImage,
    camera: CameraModel,
    colours: Option<Vec<[u8; 3]>>,
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
        Ok(Self { image, camera, colours: None })
    }

    /// The same with the colour that each pixel shows, row by row: red, green, blue, or [`NO_COLOUR`](crate::NO_COLOUR).
    ///
    /// # Errors
    /// When the colours are not as many as the pixels.
    pub fn with_colours(mut self, colours: Vec<[u8; 3]>) -> Result<Self, ColourSizeError> {
        self.set_colours(colours)?;
        Ok(self)
    }

    pub(crate) fn set_colours(&mut self, colours: Vec<[u8; 3]>) -> Result<(), ColourSizeError> {
        ColourSizeError::check((self.image.width_px(), self.image.height_px()), colours.len())?;
        self.colours = Some(colours);
        Ok(())
    }

    /// The colour of each pixel; `None` where no colour image belongs to the depth image.
    #[must_use]
    pub fn colours(&self) -> Option<&[[u8; 3]]> {
        self.colours.as_deref()
    }

    /// The colours of the pixels by points of the camera's frame, with a colour each, that the image was rendered from: a pixel
    /// has the colour of the first point whose depth it has.
    #[must_use]
    pub fn colours_of_points<'a>(
        &self,
        points: impl IntoIterator<Item = (&'a Point3<f32>, [u8; 3])>,
    ) -> Vec<[u8; 3]> {
        let (width_px, height_px) = (self.image.width_px(), self.image.height_px());
        let mut colours = vec![NO_COLOUR; width_px * height_px];
        let DepthPixels::Millimetres(depths_mm) = self.image.pixels() else { return colours };
        for (point_m, colour) in points {
            let depth_mm = millimetres(point_m.z);
            let Some(at) = self.camera.project(&point_m.cast()) else { continue };
            // Within the image, whose outer pixels reach half a pixel beyond their centres; the casts saturate.
            let pixel = (at.y + 0.5) as usize * width_px + (at.x + 0.5) as usize;
            if let (Some(kept), Some(seen_mm)) = (colours.get_mut(pixel), depths_mm.get(pixel))
                && *kept == NO_COLOUR
                && *seen_mm == depth_mm
            {
                *kept = colour;
            }
        }
        colours
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
        // To the nearest: the cast truncates, and saturates.
        (depth_m * 1e3 + 0.5) as u16
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
