//! A depth image with its camera, and which of its pixels move.

mod cloud_camera;
mod computed;
mod pinhole_fit;
mod points_in_view;
#[cfg(test)]
mod tests;

use std::any::Any;
use std::sync::Arc;

use nalgebra::{Isometry3, Point3};

use crate::depth::FARTHEST_MM;
use crate::depth_projection::for_each_voxel;
use crate::rigid::RigidTransform;
use crate::{
    CameraModel, CameraModelError, ColourSizeError, DepthCameraError, DepthImage, DepthPixels,
    NO_COLOUR, PixelArea, PixelVoxels, RayTable, VoxelBox, VoxelGrid, VoxelKey,
};
pub use cloud_camera::CloudCamera;
use computed::Computed;
pub use pinhole_fit::PinholeFitError;

/// The depth image of a cycle and its camera, of the same size. Segmentation's evidence of free space and the map of the depth images are computed
/// from it.
///
/// Depths are whole millimetres, 0 where nothing was measured (`16UC1` of REP-118), whatever encoding they arrived in: so
/// they are the same numbers in one process as over DDS, where they are compressed without loss. Colours, where the cycle has a
/// colour image, are those of the depth image's pixels ([`ColourRegistration`](crate::ColourRegistration)).
#[derive(Clone, PartialEq, Debug)]
pub struct DepthFrame {
    image: Arc<DepthImage>,
    rays: RayTable,
    colours: Option<Vec<[u8; 3]>>,
    computed: Computed,
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
    /// The image, in whole millimetres, with its camera. One that is in millimetres is not copied.
    ///
    /// # Errors
    /// When the camera is none, or the image is of another size.
    pub fn new(
        image: impl Into<Arc<DepthImage>>,
        camera: CameraModel,
    ) -> Result<Self, DepthFrameError> {
        let (image, rays) = (image.into(), RayTable::new(&camera)?);
        DepthCameraError::check(&image, &rays)?;
        Ok(Self::of_its_size(image, rays))
    }

    /// The image with its camera, which is known to be of the same size.
    pub(crate) fn of_its_size(image: Arc<DepthImage>, rays: RayTable) -> Self {
        let image = match image.pixels() {
            DepthPixels::Millimetres(_) => image,
            DepthPixels::Metres(depths_m) => {
                let pixels = depths_m.iter().map(|depth_m| millimetres(*depth_m)).collect();
                Arc::new(image.with_millimetres(pixels))
            }
        };
        Self { image, rays, colours: None, computed: Computed::default() }
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
        let depths_mm = self.depths_mm();
        for (point_m, colour) in points {
            let depth_mm = millimetres(point_m.z);
            let Some(at) = self.camera().project(&point_m.cast()) else { continue };
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

    /// The depths in millimetres, row by row; 0 where nothing was measured.
    #[must_use]
    pub fn depths_mm(&self) -> &[u16] {
        match self.image.pixels() {
            DepthPixels::Millimetres(depths_mm) => depths_mm,
            // By construction there is none such.
            DepthPixels::Metres(_) => &[],
        }
    }

    /// Its camera.
    #[must_use]
    pub fn camera(&self) -> &CameraModel {
        self.rays.camera()
    }

    /// The rays of its camera.
    #[must_use]
    pub fn rays(&self) -> &RayTable {
        &self.rays
    }

    /// What another holder of the frame has computed of its depths and still keeps, if it is of this type: the nodes of one process
    /// hold the same frame.
    #[must_use]
    pub fn computed<T: Any + Send + Sync>(&self) -> Option<Arc<T>> {
        self.computed.get()
    }

    /// Lets other holders of the frame have what was computed of its depths, as long as it is kept: the frame does not keep it. What
    /// was shared first stays.
    pub fn share<T: Any + Send + Sync>(&self, computed: &Arc<T>) {
        self.computed.share(computed);
    }

    /// Calls `take` for each pixel of an area whose voxel is in a box, in the order of the pixels: with its index in the image and the
    /// voxel of the rig that [`ProjectableDepth::reduce`](crate::ProjectableDepth::reduce) with this grid puts its point into. Where
    /// that was noted ([`PixelVoxels`]) and shared, it is not computed again.
    pub fn for_each_voxel(
        &self,
        rig_from_camera: &Isometry3<f64>,
        area: PixelArea,
        grid_and_box: (&VoxelGrid, &VoxelBox),
        take: impl FnMut(usize, VoxelKey),
    ) {
        let (grid, within) = grid_and_box;
        let transform = RigidTransform::new(rig_from_camera);
        let known = self.computed::<PixelVoxels>();
        match known.filter(|known| known.are_made_with(grid, &transform)) {
            Some(known) => known.for_each(area, within, take),
            None => {
                for_each_voxel((&self.image, &self.rays), &transform, area, grid_and_box, take);
            }
        }
    }
}

/// 0 where nothing was measured. What is farther than the format can say is as far as it can: the space before it is free.
fn millimetres(depth_m: f32) -> u16 {
    if depth_m.is_finite() && depth_m > 0.0 {
        // To the nearest: the cast truncates, and saturates.
        ((depth_m * 1e3 + 0.5) as u16).min(FARTHEST_MM)
    } else {
        0
    }
}

/// A depth image of which it is known which pixels show something that moves.
#[derive(Clone, PartialEq, Debug)]
pub struct MaskedDepth {
    frame: Arc<DepthFrame>,
    is_moving: Vec<bool>,
}

/// A mask is not one of a depth image.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a mask of {mask_pixels} pixels does not fit a depth image of {image_pixels}")]
pub struct MaskSizeError {
    /// How many pixels the mask has.
    pub mask_pixels: usize,
    /// How many the image has.
    pub image_pixels: usize,
}

impl MaskedDepth {
    /// The image with the mask: for each pixel, row by row, whether it shows something that moves, or may.
    ///
    /// # Errors
    /// When the mask has another number of pixels than the image.
    pub fn new(frame: Arc<DepthFrame>, is_moving: Vec<bool>) -> Result<Self, MaskSizeError> {
        let (mask_pixels, image_pixels) = (is_moving.len(), frame.depths_mm().len());
        if mask_pixels == image_pixels {
            Ok(Self { frame, is_moving })
        } else {
            Err(MaskSizeError { mask_pixels, image_pixels })
        }
    }

    /// The image with its camera.
    #[must_use]
    pub fn frame(&self) -> &Arc<DepthFrame> {
        &self.frame
    }

    /// For each pixel, row by row, whether it shows something that moves, or may.
    #[must_use]
    pub fn is_moving(&self) -> &[bool] {
        &self.is_moving
    }
}
