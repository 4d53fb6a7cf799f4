//! A revolution as a picture of all that is around (Road LiDAR, section 3.3): intensities or ranges, a row of pixels
//! for each laser.
//!
//! The thesis colours intensities with PINK and ranges with HSV, ranges scaled evenly to 0 .. 255. These are here; by
//! default both have a colour map whose steps look alike everywhere, and ranges are scaled by their logarithm: evenly
//! scaled, the road before the vehicle has a tenth of the colours.

mod colour_map;

use std::f32::consts::{PI, TAU};

use geometry::{LidarReturn, Revolution};
use serde::{Deserialize, Serialize};

pub use colour_map::{ColourMap, Rgb};

/// How a panorama is drawn.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PanoramaConfig {
    /// The quantity drawn.
    pub quantity: Quantity,
    /// How values become colours.
    pub colour_map: ColourMap,
    /// The values of the first colour and the last: of intensities in the scanner's unit, of ranges in metres.
    pub limits: [f32; 2],
    /// Pixels all around.
    pub width_px: usize,
    /// Pixels of a row of the revolution, one above the other.
    pub row_height_px: usize,
    /// The colour of what returned nothing.
    pub nothing: Rgb,
}

/// The quantity of a panorama.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Intensities, evenly scaled.
    Intensity,
    /// Ranges, scaled by their logarithm.
    Range,
    /// Ranges, evenly scaled.
    LinearRange,
}

impl PanoramaConfig {
    /// Intensities of 0 to 255, as Velodynes report them.
    #[must_use]
    pub fn intensities() -> Self {
        Self { quantity: Quantity::Intensity, limits: [0.0, 255.0], ..Self::default() }
    }

    /// As the thesis draws intensities.
    #[must_use]
    pub fn pink_intensities() -> Self {
        Self { colour_map: ColourMap::Pink, ..Self::intensities() }
    }

    /// As the thesis draws ranges.
    #[must_use]
    pub fn hsv_ranges() -> Self {
        Self {
            quantity: Quantity::LinearRange,
            colour_map: ColourMap::Hsv,
            limits: [0.0, Self::default().limits[1]],
            ..Self::default()
        }
    }
}

impl Default for PanoramaConfig {
    /// Ranges.
    fn default() -> Self {
        Self {
            quantity: Quantity::Range,
            colour_map: ColourMap::Even,
            // From the roof of a car to the reach of the HDL-32E (its data sheet).
            limits: [2.0, 100.0],
            // 0.2 degrees a pixel, about as a scanner at 10 turns a second measures.
            width_px: 1800,
            // Lasers are about 1.3 degrees apart, pixels of a row 0.2.
            row_height_px: 6,
            nothing: [0; 3],
        }
    }
}

/// A picture.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Panorama {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Red, green and blue of each pixel, row by row.
    pub rgb: Vec<u8>,
}

/// Why a panorama cannot be drawn.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum PanoramaConfigError {
    /// The limits leave nothing between them, or a logarithm needs one above 0.
    #[error(
        "limits {low} and {high} must rise, and be above 0 for ranges that are scaled by their logarithm"
    )]
    Limits {
        /// The first.
        low: f32,
        /// The second.
        high: f32,
    },
    /// The picture has no pixels, or more than a picture has.
    #[error("{name} is {value}, not within 1 .. {limit}")]
    Size {
        /// What is wrong.
        name: &'static str,
        /// What it is.
        value: usize,
        /// The most that it may be.
        limit: usize,
    },
}

/// The widest picture, and the highest row of it: what viewers open.
const MAX_WIDTH_PX: usize = 16_384;
const MAX_ROW_HEIGHT_PX: usize = 64;

impl PanoramaConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// When the limits or the sizes are none.
    pub fn validate(&self) -> Result<(), PanoramaConfigError> {
        let [low, high] = self.limits;
        let scales = low < high && high.is_finite() && low.is_finite();
        if !scales || (self.quantity == Quantity::Range && low <= 0.0) {
            return Err(PanoramaConfigError::Limits { low, high });
        }
        for (name, value, limit) in [
            ("width_px", self.width_px, MAX_WIDTH_PX),
            ("row_height_px", self.row_height_px, MAX_ROW_HEIGHT_PX),
        ] {
            if value == 0 || value > limit {
                return Err(PanoramaConfigError::Size { name, value, limit });
            }
        }
        Ok(())
    }

    /// The picture of a revolution: the highest laser on top, forward in the middle, left of the vehicle on the left.
    /// Of several returns in a pixel the nearest is drawn. A pixel to which no firing belongs takes what is beside it,
    /// as far as a firing reaches.
    ///
    /// # Errors
    /// When the configuration does not hold.
    pub fn draw(&self, revolution: &Revolution) -> Result<Panorama, PanoramaConfigError> {
        self.validate()?;
        let height_px = revolution.rows() * self.row_height_px;
        let mut rgb = Vec::with_capacity(self.width_px * height_px * 3);
        for row in 0..revolution.rows() {
            let line: Vec<u8> = self
                .row(revolution, row)
                .into_iter()
                .flat_map(|found| self.colour(found))
                .collect();
            for _ in 0..self.row_height_px {
                rgb.extend_from_slice(&line);
            }
        }
        Ok(Panorama { width_px: self.width_px, height_px, rgb })
    }

    /// The value of each pixel of a row.
    fn row(&self, revolution: &Revolution, row: usize) -> Vec<Option<f32>> {
        let mut nearest: Vec<Option<(f32, f32)>> = vec![None; self.width_px];
        for found in revolution.row(row).iter().flatten() {
            let range_m = found.position_m.coords.norm();
            let pixel = nearest.get_mut(self.pixel_of(found));
            if let Some(pixel) = pixel
                && pixel.is_none_or(|(known_m, _)| range_m < known_m)
            {
                *pixel = Some((range_m, self.value(found, range_m)));
            }
        }
        // A firing is as wide as there are pixels for it.
        let reach = self.width_px.div_ceil(revolution.columns().max(1)) / 2;
        let value = |pixel: usize| nearest.get(pixel).copied().flatten().map(|(_, value)| value);
        (0..self.width_px)
            .map(|pixel| {
                let beside = (1..=reach).find_map(|step| {
                    value(pixel.wrapping_sub(step)).or_else(|| value(pixel + step))
                });
                value(pixel).or(beside)
            })
            .collect()
    }

    /// From behind over the left, forward and the right to behind.
    fn pixel_of(&self, found: &LidarReturn) -> usize {
        let azimuth_rad = found.position_m.y.atan2(found.position_m.x);
        let share = (PI - azimuth_rad) / TAU;
        ((share * self.width_px as f32) as usize).min(self.width_px.saturating_sub(1))
    }

    /// Within 0 .. 1.
    fn value(&self, found: &LidarReturn, range_m: f32) -> f32 {
        let [low, high] = self.limits;
        let share = match self.quantity {
            Quantity::Intensity => (found.intensity - low) / (high - low),
            Quantity::LinearRange => (range_m - low) / (high - low),
            Quantity::Range => (range_m.max(low) / low).ln() / (high / low).ln(),
        };
        if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) }
    }

    fn colour(&self, value: Option<f32>) -> Rgb {
        value.map_or(self.nothing, |value| self.colour_map.colour(value))
    }
}

#[cfg(test)]
mod tests;
