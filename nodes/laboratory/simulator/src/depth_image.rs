//! Rendering of solids into the depth image of a structured-light camera.
//!
//! Solids are drawn one after the other into a canvas, each within the bounds of its projection, with a depth test.
//! Static solids are drawn only once when the rig does not move. Panes of glass come last: they attenuate the signal
//! from behind them. The canvas is then measured: shadow of the projector, loss of signal, disparity with noise,
//! rounding.

use std::ops::Range;

use estimation::Executor;
use estimation::executor::for_each;
use geometry::CameraModel;
use nalgebra::{Isometry3, Point3};

use crate::DepthCamera;
use crate::noise::FrameNoise;
use crate::projection::Projection;
use crate::solid::{STATIC_ID, Solid};

/// Rows drawn by one thread at a time.
const BAND_ROWS: usize = 16;
/// The variation of the returned light between images.
const STRENGTH_FLUTTER: f32 = 0.2;
/// Projector columns closer than this belong to one surface, not to an object and its shadow.
const SHADOW_MARGIN_PX: f32 = 0.25;

/// The noise-free view of the camera: for each pixel the nearest surface.
#[derive(Clone, Debug)]
pub(crate) struct Canvas {
    /// Depth along the optical axis; infinite where there is nothing.
    depth_m: Vec<f32>,
    /// See [`Solid::strength`].
    strength: Vec<f32>,
    id: Vec<u16>,
}

/// The measured image.
#[derive(Clone, Debug)]
pub(crate) struct Reading {
    /// 0 where nothing was measured.
    pub(crate) depth_mm: Vec<u16>,
    /// The object at each measured pixel.
    pub(crate) labels: Vec<u16>,
}

impl Canvas {
    pub(crate) fn new(camera: &CameraModel) -> Self {
        let pixels = camera.width_px * camera.height_px;
        Self {
            depth_m: vec![f32::INFINITY; pixels],
            strength: vec![0.0; pixels],
            id: vec![STATIC_ID; pixels],
        }
    }

    /// Draws solids with a depth test: first the opaque ones, then the panes, which attenuate what has been drawn behind
    /// them.
    pub(crate) fn draw<'a>(
        &mut self,
        camera: &CameraModel,
        room_from_camera: &Isometry3<f64>,
        solids: impl Iterator<Item = &'a Solid>,
        min_signal: f64,
        executor: &dyn Executor,
    ) {
        let mut shown: Vec<Projection<'_>> =
            solids.filter_map(|solid| Projection::of(solid, room_from_camera, camera)).collect();
        // Stable: equal depths keep their order.
        shown.sort_by_key(|projection| projection.solid.is_pane());
        let pixels = (BAND_ROWS * camera.width_px).max(1);
        let mut bands: Vec<(usize, Band<'_>)> = self
            .depth_m
            .chunks_mut(pixels)
            .zip(self.strength.chunks_mut(pixels))
            .zip(self.id.chunks_mut(pixels))
            .map(|((depth_m, strength), id)| Band { depth_m, strength, id })
            .enumerate()
            .collect();
        for_each(executor, &mut bands, |(index, band)| {
            let first = *index * BAND_ROWS;
            let rows = first..(first + BAND_ROWS).min(camera.height_px);
            for projection in &shown {
                band.draw(projection, &rows, min_signal);
            }
        });
    }

    /// The true point of a pixel in the optical frame; `None` if there is nothing.
    pub(crate) fn point_m(&self, camera: &CameraModel, index: usize) -> Option<Point3<f64>> {
        let depth_m = f64::from(*self.depth_m.get(index)?);
        let column = (index % camera.width_px) as f64;
        let row = (index / camera.width_px) as f64;
        depth_m.is_finite().then(|| {
            Point3::new(
                (column - camera.cx_px) / camera.fx_px * depth_m,
                (row - camera.cy_px) / camera.fy_px * depth_m,
                depth_m,
            )
        })
    }
}

/// A band of rows of a canvas.
struct Band<'a> {
    depth_m: &'a mut [f32],
    strength: &'a mut [f32],
    id: &'a mut [u16],
}

impl Band<'_> {
    fn draw(&mut self, projection: &Projection<'_>, rows: &Range<usize>, min_signal: f64) {
        let solid = projection.solid;
        projection.for_each_hit(rows, |index, ray, hit| {
            // The ray's direction has depth 1, so its parameter is the depth.
            let depth_m = hit.parameter as f32;
            if depth_m < self.depth_m[index] {
                let distance_m = hit.parameter * ray.direction.norm();
                let cos_incidence = hit.cos_incidence(&ray.direction);
                if solid.is_pane() {
                    self.strength[index] *= solid.weakening(cos_incidence) as f32;
                    return;
                }
                self.depth_m[index] = depth_m;
                self.strength[index] = solid.strength(cos_incidence, distance_m, min_signal) as f32;
                self.id[index] = solid.id;
            }
        });
    }
}

/// Measures canvases, with the camera's limits and errors precomputed.
#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    width_px: usize,
    live_columns_px: usize,
    shift_at_1m_px: f32,
    depth_min_m: f32,
    depth_max_m: f32,
    steps_at_1m: f32,
    noise_steps: f32,
    dropout_ratio: f32,
    /// The depth of each disparity in millimetres; 0 where it is out of range.
    depth_mm_of_disparity: Vec<u16>,
}

impl Sensor {
    pub(crate) fn new(config: &DepthCamera) -> Self {
        let step_per_m = config.disparity_step_per_m;
        let farthest_steps = (1.0 / (config.depth_min_m * step_per_m)).ceil() as usize;
        let depth_mm_of_disparity = (0..=farthest_steps)
            .map(|steps| 1.0 / (steps as f64 * step_per_m))
            .map(|depth_m| {
                let in_range = depth_m >= config.depth_min_m && depth_m <= config.depth_max_m;
                if in_range { (depth_m * 1e3).round() as u16 } else { 0 }
            })
            .collect();
        // Rounding alone has a standard deviation of sqrt(1/12) of a step; the rest is added as noise.
        let drawn_variance = config.disparity_noise_steps.powi(2) - 1.0 / 12.0;
        Self {
            width_px: config.camera.width_px,
            live_columns_px: config.camera.width_px.saturating_sub(config.dead_columns_px),
            shift_at_1m_px: (config.camera.fx_px * config.projector_baseline_m) as f32,
            depth_min_m: config.depth_min_m as f32,
            depth_max_m: config.depth_max_m as f32,
            steps_at_1m: (1.0 / step_per_m) as f32,
            noise_steps: drawn_variance.max(0.0).sqrt() as f32,
            dropout_ratio: config.dropout_ratio as f32,
            depth_mm_of_disparity,
        }
    }

    /// The camera's measurement of a canvas.
    pub(crate) fn read(&self, canvas: &Canvas, noise: &FrameNoise) -> Reading {
        let pixels = canvas.depth_m.len();
        let mut reading = Reading { depth_mm: vec![0; pixels], labels: vec![STATIC_ID; pixels] };
        self.for_each_lit(canvas, |index, depth_m| {
            let draw = noise.draw(index);
            let chance = draw.uniform();
            let needed = 1.0 + STRENGTH_FLUTTER * (chance - 0.5);
            if chance < self.dropout_ratio || canvas.strength[index] < needed {
                return;
            }
            let steps = self.steps_at_1m / depth_m + self.noise_steps * draw.normal();
            // The cast rounds down and saturates at 0, where the table has no depth.
            let depth_mm =
                self.depth_mm_of_disparity.get((steps + 0.5) as usize).copied().unwrap_or(0);
            if depth_mm > 0 {
                reading.depth_mm[index] = depth_mm;
                reading.labels[index] = canvas.id[index];
            }
        });
        reading
    }

    /// The pixels that a camera without noise and random failures would measure.
    pub(crate) fn measurable(&self, canvas: &Canvas) -> Vec<usize> {
        let mut pixels = Vec::new();
        self.for_each_lit(canvas, |index, depth_m| {
            let in_range = depth_m >= self.depth_min_m && depth_m <= self.depth_max_m;
            if in_range && canvas.strength[index] >= 1.0 {
                pixels.push(index);
            }
        });
        pixels.sort_unstable();
        pixels
    }

    /// Calls `visit` with the index and depth of each pixel of the live columns that the projector lights.
    ///
    /// Seen from a projector right of the camera, a pixel at column `u` and depth `z` lies at column
    /// `u - f b / z`. Going from right to left this falls steadily along what is lit; where it rises
    /// above what it has been, something farther right and nearer stands in the light. Exact for things
    /// that are wider than the baseline times their distance from the background over the
    /// background's depth (3.5 cm for an object half way to it).
    fn for_each_lit(&self, canvas: &Canvas, mut visit: impl FnMut(usize, f32)) {
        for (row, depths_m) in canvas.depth_m.chunks_exact(self.width_px.max(1)).enumerate() {
            let mut leftmost_px = f32::INFINITY;
            for (column, &depth_m) in depths_m.iter().enumerate().rev() {
                let projector_px = column as f32 - self.shift_at_1m_px / depth_m;
                let lit = projector_px <= leftmost_px + SHADOW_MARGIN_PX;
                leftmost_px = leftmost_px.min(projector_px);
                if lit && column < self.live_columns_px && depth_m.is_finite() {
                    visit(row * self.width_px + column, depth_m);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
