//! What is kept of what the camera has seen.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::place::InverseDepth;
use crate::matching::lines::LineMatchConfig;
use crate::matching::points::{GuidedConfig, MatchConfig};
use crate::solve::ConfigError;

/// Parameters of [`LocalMap`](super::LocalMap).
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LocalMapConfig {
    /// No more points are kept; those that were not seen for longest are dropped.
    pub max_points: usize,
    /// No more lines are kept.
    pub max_lines: usize,
    /// A point is looked for where it is seen from a direction that differs by at most so much from the last one.
    pub max_viewing_angle_rad: f64,
    /// Standard deviation of a corner of level 0, along each axis of the image.
    pub point_std_dev_px: f64,
    /// Standard deviation of an end of a segment, across it.
    pub line_std_dev_px: f64,
    /// The factor between the levels that corners are found on.
    pub scale_factor: f64,
    /// How many levels there are.
    pub levels: usize,
    /// What a landmark's place may be off by from one frame to the next, whatever its filter says: standard deviation.
    pub landmark_noise_m: f64,
    /// Inverse depth, in 1/m, of a feature whose depth is not measured: the mean ...
    pub unmeasured_inverse_depth: f64,
    /// ... and the standard deviation.
    pub unmeasured_inverse_depth_std_dev: f64,
    /// A landmark is located when the standard deviation of its inverse depth is at most this share of it. A lost camera is
    /// looked for by located points alone.
    pub located_share: f64,
    /// What others are off by in the image through their depths is taken to be so many times as much when they say where the
    /// camera is.
    pub unlocated_doubt: f64,
    /// A landmark is forgotten when it was seen in a smaller share of the frames that should have.
    pub min_seen_share: f64,
    /// But not before so many frames.
    pub least_foreseen: u32,
    /// How corners are matched to points.
    pub point_matching: GuidedConfig,
    /// How segments are matched to lines.
    pub line_matching: LineMatchConfig,
}

impl Default for LocalMapConfig {
    fn default() -> Self {
        let guided = GuidedConfig::default();
        // What is alike by chance only makes outliers: of a prediction that is right, true matches differ by less.
        let matching = MatchConfig { max_distance: 64, ..guided.matching };
        let point_matching = GuidedConfig { matching, ..guided };
        Self {
            // Ten views of a thousand corners.
            max_points: 10_000,
            max_lines: 2_000,
            // PL-SLAM section 2.3.
            max_viewing_angle_rad: PI / 3.0,
            // ORB-SLAM2's: one pixel of the level.
            point_std_dev_px: 1.0,
            line_std_dev_px: 1.0,
            scale_factor: f64::from(point_matching.scale_factor),
            levels: 8,
            landmark_noise_m: 2e-4,
            // From 3 m to infinity within two standard deviations: what a depth camera does not measure is beyond its
            // range, or at an edge. (Civera, Davison and Montiel 2008, section III: infinity must be within.)
            unmeasured_inverse_depth: 0.1,
            unmeasured_inverse_depth_std_dev: 0.1,
            // Twice what structured light has at 7 m.
            located_share: 0.02,
            // Before they are located all are off to the same side, as far as a scene is farther or nearer than was
            // thought, in one frame after the other: a thousand of them would say so with the voice of a thousand.
            unlocated_doubt: 100.0,
            // PL-SLAM section 2.3 (ORB-SLAM): found in more than a quarter of the frames that should see it.
            min_seen_share: 0.25,
            least_foreseen: 5,
            point_matching,
            line_matching: LineMatchConfig::default(),
        }
    }
}

impl LocalMapConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ConfigError> {
        ConfigError::unless_positive("max_points", self.max_points as f64)?;
        ConfigError::unless_positive("max_viewing_angle_rad", self.max_viewing_angle_rad)?;
        ConfigError::unless_positive("point_std_dev_px", self.point_std_dev_px)?;
        ConfigError::unless_positive("line_std_dev_px", self.line_std_dev_px)?;
        ConfigError::unless_positive("landmark_noise_m", self.landmark_noise_m)?;
        ConfigError::unless_positive("unmeasured_inverse_depth", self.unmeasured_inverse_depth)?;
        let std_dev = self.unmeasured_inverse_depth_std_dev;
        ConfigError::unless_positive("unmeasured_inverse_depth_std_dev", std_dev)?;
        ConfigError::unless_positive("located_share", self.located_share)?;
        ConfigError::unless_positive("unlocated_doubt", self.unlocated_doubt)?;
        ConfigError::unless(self.scale_factor > 1.0, "scale_factor", "above 1", self.scale_factor)
    }

    /// How far a feature is whose depth is not measured.
    pub(super) fn unmeasured_depth(&self) -> InverseDepth {
        InverseDepth {
            mean: self.unmeasured_inverse_depth,
            std_dev: self.unmeasured_inverse_depth_std_dev,
        }
    }

    /// A corner is as sure as the pixels of its level.
    pub(super) fn pixel_std_dev_px(&self, level: u8) -> f64 {
        self.point_std_dev_px * self.scale_factor.powi(i32::from(level))
    }
}
