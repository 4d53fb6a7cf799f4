//! The parameters of point extraction, their defaults, and where these come from.

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

/// The parameters of [`crate::feature::points::PointExtractor`]. Every default stands in [`PointConfig::default`] and
/// nowhere else.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct PointConfig {
    /// No more corners than this are extracted from an image, and as many wherever it has them.
    pub max_corners: usize,
    /// How many scales corners are looked for in, the image's own included.
    pub levels: usize,
    /// How much smaller each level is than the one before.
    pub scale_factor: f64,
    /// How much brighter or darker, in gray levels, the nine ring pixels of a corner must be than its centre.
    pub threshold: u8,
    /// The same for the cells of the image in which no corner reaches [`threshold`](Self::threshold).
    pub low_threshold: u8,
    /// The side of such a cell, in pixels of the level.
    pub cell_px: usize,
    /// This share of a level's corners is chosen so that they cover it evenly, which holds a pose in all directions; the
    /// others are the strongest, which are found again most often.
    pub even_share: f64,
    /// How many threads work on an image. It changes no result.
    pub threads: usize,
}

/// The levels that corners are found on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pyramid {
    /// How many there are, the image's own included.
    pub levels: usize,
    /// How much smaller each is than the one before.
    pub scale_factor: f64,
}

impl Default for Pyramid {
    fn default() -> Self {
        PointConfig::default().pyramid()
    }
}

impl Default for PointConfig {
    fn default() -> Self {
        Self {
            // Mur-Artal et al. 2015, section IV.A: 1000 corners for images of 512 x 384 to 752 x 480 pixels, 8 levels
            // of 1.2.
            max_corners: 1000,
            levels: 8,
            scale_factor: 1.2,
            // The two thresholds that ORB-SLAM2 (Mur-Artal and Tardos 2017) is configured with for TUM RGB-D: 20 as
            // in ORB, 7 where nothing is found.
            threshold: 20,
            low_threshold: 7,
            // A patch that a corner is described by is 31 pixels wide: about one corner a patch.
            cell_px: 32,
            // Neither is best alone: ORB-SLAM spreads all, ORB none.
            even_share: 0.5,
            threads: 1,
        }
    }
}

/// More corners than this are of no use to an odometry, and matching takes the square of their time.
const MOST_CORNERS: usize = 100_000;
/// With a factor of 1.2 the sixteenth level is 15 times smaller.
const MOST_LEVELS: usize = 16;
/// Bilinear interpolation leaves out no pixel up to a factor of 2.
const LARGEST_SCALE_FACTOR: f64 = 2.0;
/// Nearer to 1 two levels show the same.
const SMALLEST_SCALE_FACTOR: f64 = 1.01;
/// A cell's side: below, a cell holds hardly a corner; above, the image is one cell.
const CELLS_PX: std::ops::RangeInclusive<usize> = 8..=1024;
/// More threads than an image has bands of cells would stand idle.
const MOST_THREADS: usize = 64;

impl PointConfig {
    /// The levels that corners are found on.
    #[must_use]
    pub fn pyramid(&self) -> Pyramid {
        Pyramid { levels: self.levels, scale_factor: self.scale_factor }
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let corners = self.max_corners;
        parameter::check(
            "max_corners",
            "in 1 .. 100000",
            corners as f64,
            (1..=MOST_CORNERS).contains(&corners),
        )?;
        let levels = self.levels;
        parameter::check(
            "levels",
            "in 1 .. 16",
            levels as f64,
            (1..=MOST_LEVELS).contains(&levels),
        )?;
        let factor = self.scale_factor;
        let factors = SMALLEST_SCALE_FACTOR..=LARGEST_SCALE_FACTOR;
        parameter::check("scale_factor", "in [1.01, 2]", factor, factors.contains(&factor))?;
        parameter::check(
            "threshold",
            "at least 1",
            f64::from(self.threshold),
            self.threshold >= 1,
        )?;
        let low = self.low_threshold;
        let lows = 1..=self.threshold;
        parameter::check(
            "low_threshold",
            "in 1 .. threshold",
            f64::from(low),
            lows.contains(&low),
        )?;
        let cell = self.cell_px;
        parameter::check("cell_px", "in 8 .. 1024", cell as f64, CELLS_PX.contains(&cell))?;
        let share = self.even_share;
        parameter::check("even_share", "in [0, 1]", share, (0.0..=1.0).contains(&share))?;
        let threads = self.threads;
        parameter::check(
            "threads",
            "in 1 .. 64",
            threads as f64,
            (1..=MOST_THREADS).contains(&threads),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_each_bad_parameter_is_named() {
        type Spoil = fn(&mut PointConfig);
        assert_eq!(PointConfig::default().validate(), Ok(()));
        let cases: [(&str, Spoil); 10] = [
            ("max_corners", |c| c.max_corners = 0),
            ("levels", |c| c.levels = 17),
            ("scale_factor", |c| c.scale_factor = f64::NAN),
            ("scale_factor", |c| c.scale_factor = 1.0),
            ("threshold", |c| c.threshold = 0),
            ("low_threshold", |c| c.low_threshold = 21),
            ("low_threshold", |c| c.low_threshold = 0),
            ("cell_px", |c| c.cell_px = 0),
            ("even_share", |c| c.even_share = 1.1),
            ("threads", |c| c.threads = 0),
        ];
        for (name, spoil) in cases {
            let mut config = PointConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.contains(&format!("parameter {name} ")), "{message}");
        }
    }
}
