//! Undistortion of a depth image.

use geometry::CameraModel;
use nalgebra::Point3;

/// For each pixel of the undistorted image, the pixel of the original. The nearest pixel is used: an interpolated depth at
/// an edge would be on neither surface.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Remap {
    camera: CameraModel,
    /// One beyond the last pixel where the original has none.
    source: Vec<u32>,
}

impl Remap {
    pub(super) fn of(camera: &CameraModel) -> Self {
        let pixels = camera.width_px * camera.height_px;
        let source = (0..pixels).map(|pixel| {
            let (column, row) = (pixel % camera.width_px, pixel / camera.width_px);
            let ray = Point3::new(
                (column as f64 - camera.cx_px) / camera.fx_px,
                (row as f64 - camera.cy_px) / camera.fy_px,
                1.0,
            );
            camera.project(&ray).map_or(pixels, |seen| {
                let last = |size_px: usize| size_px.saturating_sub(1);
                // The casts saturate at 0.
                let column = (seen.x.round() as usize).min(last(camera.width_px));
                let row = (seen.y.round() as usize).min(last(camera.height_px));
                row * camera.width_px + column
            }) as u32
        });
        Self { camera: *camera, source: source.collect() }
    }

    pub(super) fn is_of(&self, camera: &CameraModel) -> bool {
        self.camera == *camera
    }

    /// Sets `none` where the original has no pixel.
    pub(super) fn apply<T: Copy>(&self, pixels: &mut [T], none: T) {
        let shown = pixels.to_vec();
        for (pixel, &source) in pixels.iter_mut().zip(&self.source) {
            *pixel = shown.get(source as usize).copied().unwrap_or(none);
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.source.capacity() * size_of::<u32>()
    }
}
