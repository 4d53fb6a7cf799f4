//! What is kept of what the camera has seen.

use std::f64::consts::PI;

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use super::place::InverseDepth;
use crate::feature::points::Pyramid;
use crate::matching::lines::{LineMatchConfig, ProjectedLineConfig};
use crate::matching::points::{GuidedConfig, MatchConfig};

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
    /// The levels that corners are found on. [`Tracker`](crate::tracking::Tracker) has them from the extraction.
    #[serde(skip)]
    pub pyramid: Pyramid,
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
    pub point_matching: MatchConfig,
    /// A corner may be found so many levels above or below the one that it is foreseen on.
    pub level_tolerance: u8,
    /// How segments are matched to lines.
    pub line_matching: LineMatchConfig,
    /// Along a line, it and a segment of it share at least this much of the shorter one.
    pub min_line_overlap: f64,
}

impl Default for LocalMapConfig {
    fn default() -> Self {
        let (guided, projected) = (GuidedConfig::default(), ProjectedLineConfig::default());
        // What is alike by chance only makes outliers: of a prediction that is right, true matches differ by less.
        let point_matching = MatchConfig { max_distance: 64, ..guided.matching };
        Self {
            // Ten views of a thousand corners.
            max_points: 10_000,
            max_lines: 2_000,
            // PL-SLAM section 2.3.
            max_viewing_angle_rad: PI / 3.0,
            // ORB-SLAM2's: one pixel of the level.
            point_std_dev_px: 1.0,
            line_std_dev_px: 1.0,
            pyramid: Pyramid::default(),
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
            level_tolerance: guided.level_tolerance,
            line_matching: projected.matching,
            min_line_overlap: projected.min_overlap,
        }
    }
}

impl LocalMapConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::positive("max_points", self.max_points as f64)?;
        parameter::positive("max_viewing_angle_rad", self.max_viewing_angle_rad)?;
        parameter::positive("point_std_dev_px", self.point_std_dev_px)?;
        parameter::positive("line_std_dev_px", self.line_std_dev_px)?;
        parameter::positive("landmark_noise_m", self.landmark_noise_m)?;
        parameter::positive("unmeasured_inverse_depth", self.unmeasured_inverse_depth)?;
        let std_dev = self.unmeasured_inverse_depth_std_dev;
        parameter::positive("unmeasured_inverse_depth_std_dev", std_dev)?;
        parameter::positive("located_share", self.located_share)?;
        parameter::positive("unlocated_doubt", self.unlocated_doubt)?;
        parameter::between("min_seen_share", self.min_seen_share, 0.0, 1.0)?;
        parameter::between("min_line_overlap", self.min_line_overlap, 0.0, 1.0)
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
        self.point_std_dev_px * self.pyramid.scale_factor.powi(i32::from(level))
    }

    /// How corners are looked for, no farther from where they are foreseen.
    pub(super) fn guided(&self, radius_px: f32) -> GuidedConfig {
        GuidedConfig {
            matching: self.point_matching,
            radius_px,
            scale_factor: self.pyramid.scale_factor as f32,
            level_tolerance: self.level_tolerance,
        }
    }

    /// How segments are, likewise.
    pub(super) fn projected(&self, max_offset_px: f64) -> ProjectedLineConfig {
        let (matching, min_overlap) = (self.line_matching, self.min_line_overlap);
        ProjectedLineConfig { matching, max_offset_px, min_overlap }
    }
}
