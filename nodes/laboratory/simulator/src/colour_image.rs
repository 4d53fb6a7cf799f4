//! Rendering of solids into a colour image.
//!
//! For each moment of the exposure and each ray of a pixel the nearest surface is found as in `depth_image` (one ray is
//! enough when all rays of the pixel and its neighbours hit the same surface). Its paint and the light on it give the
//! brightness, and the pixel gets the mean over moments and rays. The sensor then counts electrons, with noise, and
//! encodes them as sRGB. Panes of glass are transparent.

mod encoding;
mod view;

use estimation::Executor;
use estimation::executor::for_each;
use geometry::{CameraModel, Stamp};
use nalgebra::Isometry3;

use crate::ColourCamera;
use crate::lighting::Lighting;
use crate::noise::{FrameNoise, Stream};
use crate::solid::Solid;

use encoding::SrgbTable;
use view::{View, Visible};

/// A colour image.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ColourImage {
    /// The middle of the exposure.
    pub stamp: Stamp,
    /// The optical frame of the camera.
    pub frame_id: String,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Red, green and blue of each pixel in sRGB, row by row; `3 * width_px * height_px` bytes.
    pub rgb: Vec<u8>,
}

/// The scene at one moment, and the pose of the camera.
pub(crate) struct Moment {
    pub(crate) room_from_camera: Isometry3<f64>,
    pub(crate) moving: Vec<Solid>,
}

/// Renders images, with everything precomputed that does not change between images.
#[derive(Clone, Debug)]
pub(crate) struct ColourSensor {
    camera: CameraModel,
    config: ColourCamera,
    srgb: SrgbTable,
}

/// Rows rendered at once: few enough for a core's cache, enough that the setup of each solid does not matter.
const BAND_ROWS: usize = 16;
const CHANNELS: usize = 3;

impl ColourSensor {
    pub(crate) fn new(config: &ColourCamera, camera: CameraModel) -> Self {
        Self { camera, config: config.clone(), srgb: SrgbTable::new() }
    }

    /// The bytes of the image of these moments of the exposure.
    pub(crate) fn take(
        &self,
        statics: &[Solid],
        moments: &[Moment],
        lighting: &Lighting,
        noise_of: (u64, u64),
        executor: &dyn Executor,
    ) -> Vec<u8> {
        let (seed, frame) = noise_of;
        let noise = FrameNoise::new(seed, Stream::ColourPixel, frame);
        let views: Vec<View<'_>> = moments
            .iter()
            .map(|moment| View::of(statics, moment, &self.camera, self.side(), lighting))
            .collect();
        let row_bytes = CHANNELS * self.camera.width_px;
        let mut rgb = vec![0; row_bytes * self.camera.height_px];
        let bands = rgb.chunks_mut((row_bytes * BAND_ROWS).max(1)).enumerate();
        let mut bands: Vec<(usize, &mut [u8])> = bands.collect();
        for_each(executor, &mut bands, |(band, bytes)| {
            let first_row = *band * BAND_ROWS;
            let light = self.band(&views, first_row, bytes.len() / row_bytes.max(1));
            let first = first_row * row_bytes;
            for (index, (byte, light)) in bytes.iter_mut().zip(light).enumerate() {
                *byte = self.read(light, noise.draw(first + index).normal());
            }
        });
        rgb
    }

    /// The light on the pixels of some rows, three channels each: 1 is just white.
    fn band(&self, views: &[View<'_>], first_row: usize, rows: usize) -> Vec<f32> {
        let mut light = Vec::with_capacity(rows * self.camera.width_px * CHANNELS);
        let seen: Vec<Visible> = views
            .iter()
            .map(|view| Visible::draw(view, &self.camera, first_row..first_row + rows))
            .collect();
        let rays = views.len().max(1) * self.side() * self.side();
        let share = self.config.brightness as f32 / rays as f32;
        for row_px in first_row..first_row + rows {
            for column_px in 0..self.camera.width_px {
                let mut sum = [0.0; CHANNELS];
                for (view, visible) in views.iter().zip(&seen) {
                    visible.add_pixel(view, row_px, column_px, &mut sum);
                }
                light.extend(sum.map(|channel| channel * share));
            }
        }
        light
    }

    /// Rays per pixel along each axis.
    fn side(&self) -> usize {
        self.config.supersampling.max(1)
    }

    /// The value of a channel.
    fn read(&self, light: f32, normal: f32) -> u8 {
        let white = self.config.white_electrons as f32;
        let electrons = light * white;
        let read = self.config.read_noise_electrons as f32;
        let noisy = electrons + (electrons + read * read).sqrt() * normal;
        self.srgb.encode(noisy / white)
    }
}

#[cfg(test)]
mod tests;
