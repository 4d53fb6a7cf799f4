//! What line segments are found by.

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

/// Parameters of [`LineDetector`](super::LineDetector).
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LineConfig {
    /// An edge is drawn from pixels whose gradient, `|Gx| + |Gy|` of the Sobel operator on the smoothed image, is a
    /// maximum and at least so large, in gray levels. A step of so many quarters of a gray level has it.
    pub anchor_gradient: f64,
    /// It is followed for as long as the gradient is at least so large.
    pub edge_gradient: f64,
    /// The detail ratio: anchors are sought in each row and column of a number that this divides. 1 seeks in all.
    pub scan_interval_px: usize,
    /// A line begins as so many pixels in a row that lie on one.
    pub seed_px: usize,
    /// They lie on one when they deviate by at most so much, by the root of the mean square.
    pub max_rms_px: f64,
    /// A line grows by points that deviate by at most so much.
    pub max_deviation_px: f64,
    /// It ends where more than so many in a row deviate by more.
    pub max_outliers_px: usize,
    /// So many segments may be expected of an image of noise alone.
    pub max_false_alarms: f64,
    /// Parts of one line are joined over gaps of at most so many pixels.
    pub max_gap_px: f64,
    /// Parts of one line differ by at most so much in direction.
    pub max_turn_rad: f64,
    /// Threads that share the work, the caller's among them. The segments do not depend on it.
    pub max_threads: usize,
}

impl Default for LineConfig {
    fn default() -> Self {
        Self {
            // Where rounding to whole gray levels, 8 in all by the Sobel operator's weights, turns a gradient by 45
            // degrees at most: 8 / sin(45 degrees). Edge Drawing Parameter Free (Akinlar and Topal 2012) has 6 / sin(45
            // degrees) of the Prewitt operator by the same reasoning.
            anchor_gradient: 11.3,
            // Canny (1986) recommends a ratio of two or three to one of his two thresholds.
            edge_gradient: 5.65,
            // EDLines' demo, and OpenCV: every row and column.
            scan_interval_px: 1,
            // Long enough for a direction; a third less than what passes the test alone, so that short parts can be
            // joined to some that do.
            seed_px: 8,
            // EDLines has 1 pixel for whole pixels, which lie up to a half off the edge by themselves. Ours do not.
            max_rms_px: 0.5,
            // EDLines.
            max_deviation_px: 1.0,
            // As many as a crossing edge of the smoothing kernel's width bends.
            max_outliers_px: 5,
            // EDLines has 1. Its pixels are held to be independent, and neighbours of a smoothed image are not.
            max_false_alarms: 0.1,
            // Two seeds.
            max_gap_px: 16.0,
            // 6 degrees: what the direction of a seed is uncertain by, when its points deviate by 0.25 pixels.
            max_turn_rad: 0.1,
            max_threads: 1,
        }
    }
}

/// What `|Gx| + |Gy|` is at most: 6 times 255.
const LARGEST_GRADIENT: f64 = 1530.0;
/// More threads than this are a slip of the pen.
const MOST_THREADS: usize = 256;
/// No image has longer edges.
const LONGEST_PX: f64 = 1e5;

impl LineConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for (name, value) in
            [("anchor_gradient", self.anchor_gradient), ("edge_gradient", self.edge_gradient)]
        {
            let holds = value > 0.0 && value <= LARGEST_GRADIENT;
            parameter::check(name, "in (0, 1530] gray levels", value, holds)?;
        }
        for (name, value) in [
            ("max_rms_px", self.max_rms_px),
            ("max_deviation_px", self.max_deviation_px),
            ("max_false_alarms", self.max_false_alarms),
        ] {
            parameter::check(name, "a positive number", value, value > 0.0 && value.is_finite())?;
        }
        let counts = [
            ("scan_interval_px", self.scan_interval_px, 1),
            ("seed_px", self.seed_px, 3),
            ("max_outliers_px", self.max_outliers_px, 0),
        ];
        for (name, value, least) in counts {
            let value = value as f64;
            let accepted = match least {
                0 => "in 0 .. 100000 pixels",
                1 => "in 1 .. 100000 pixels",
                _ => "in 3 .. 100000 pixels",
            };
            parameter::check(
                name,
                accepted,
                value,
                value >= f64::from(least) && value <= LONGEST_PX,
            )?;
        }
        let gap = self.max_gap_px;
        parameter::check(
            "max_gap_px",
            "in [0, 100000] pixels",
            gap,
            (0.0..=LONGEST_PX).contains(&gap),
        )?;
        let turn = self.max_turn_rad;
        parameter::check("max_turn_rad", "in [0, 0.5] radians", turn, (0.0..=0.5).contains(&turn))?;
        let threads = self.max_threads;
        parameter::check(
            "max_threads",
            "in 1 .. 256",
            threads as f64,
            (1..=MOST_THREADS).contains(&threads),
        )
    }
}
