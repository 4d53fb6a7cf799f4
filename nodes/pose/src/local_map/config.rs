//! The parameters of the local map.

use std::f64::consts::PI;

use super::place::InverseDepth;
use crate::feature::points::Pyramid;
use crate::matching::lines::{LineMatchConfig, ProjectedLineConfig};
use crate::matching::points::{GuidedConfig, MatchConfig};

geometry::parameters! {
    /// Parameters of [`LocalMap`](super::LocalMap).
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct LocalMapConfig {
        /// The most points that are kept; those that have not been seen for longest are dropped.
        // Ten views of a thousand corners.
        max_points: usize = 10_000, at_least(1.0);
        /// The most lines that are kept.
        max_lines: usize = 2_000;
        /// A point is searched for where it is seen from a direction that differs by at most this from the last one.
        // PL-SLAM section 2.3.
        max_viewing_angle_rad: f64 = PI / 3.0, positive;
        /// Standard deviation of a corner of level 0, along each axis of the image.
        // ORB-SLAM2's: one pixel of the level.
        point_std_dev_px: f64 = 1.0, positive;
        /// Standard deviation of an end of a line segment, across it.
        line_std_dev_px: f64 = 1.0, positive;
        /// The levels that corners are found on. [`Tracker`](crate::tracking::Tracker) has them from the extraction.
        pyramid: Pyramid as skip;
        /// Standard deviation of a landmark's position from one frame to the next, whatever its filter has.
        landmark_noise_m: f64 = 2e-4, positive;
        /// Inverse depth, in 1/m, of a feature whose depth is not measured: the mean.
        // From 3 m to infinity within two standard deviations: what a depth camera does not measure is beyond its range, or at
        // an edge. (Civera, Davison and Montiel 2008, section III: infinity must be within.)
        unmeasured_inverse_depth: f64 = 0.1, positive;
        /// Inverse depth, in 1/m, of a feature whose depth is not measured: the standard deviation.
        unmeasured_inverse_depth_std_dev: f64 = 0.1, positive;
        /// A landmark is located when the standard deviation of its inverse depth is at most this share of it. A lost camera is
        /// searched for by located points alone.
        // Twice what structured light has at 7 m.
        located_share: f64 = 0.02, positive;
        /// Where landmarks that are not located contribute to the camera's pose, their error in the image by their depth counts
        /// as this many times as large.
        // Before they are located all have an error of the same sign, as far as a scene is farther or nearer than assumed, in one
        // frame after the other: a thousand of them would say so with the voice of a thousand.
        unlocated_error_factor: f64 = 100.0, positive;
        /// What is nearer than this share of a landmark's distance hides it, and is not it.
        // What covers most of an image is much nearer than the room; within the rest are the map's drift and slanted surfaces.
        hiding_share: f64 = 0.8, share;
        /// A landmark is dropped when it was seen in a smaller share of the frames that should have seen it.
        // PL-SLAM section 2.3 (ORB-SLAM): found in more than a quarter of the frames that should see it.
        min_seen_share: f64 = 0.25, share;
        /// A landmark is kept for at least this many frames that should have seen it.
        min_expected_frames: u32 = 5;
        /// How corners are matched to points.
        // What is alike by chance only makes outliers: of a prediction that is right, true matches differ by less.
        point_matching: MatchConfig = MatchConfig { max_distance: 64, ..GuidedConfig::default().matching };
        /// A corner is searched for this many levels above and below the predicted one.
        level_tolerance: u8 = GuidedConfig::default().level_tolerance;
        /// How line segments are matched to lines.
        line_matching: LineMatchConfig = ProjectedLineConfig::default().matching;
        /// A line and a segment of it overlap along the line by at least this share of the shorter one.
        min_line_overlap: f64 = ProjectedLineConfig::default().min_overlap, share;
    }
}

impl LocalMapConfig {
    /// How far a feature is whose depth is not measured.
    pub(super) fn unmeasured_depth(&self) -> InverseDepth {
        InverseDepth {
            mean: self.unmeasured_inverse_depth,
            std_dev: self.unmeasured_inverse_depth_std_dev,
        }
    }

    /// Whether what has one depth hides what has the other.
    pub(super) fn hides(&self, nearer_m: f64, farther_m: f64) -> bool {
        nearer_m < self.hiding_share * farther_m
    }

    /// Whether what has one depth may be what has the other: neither hides the other.
    pub(super) fn may_be_one(&self, one_m: f64, other_m: f64) -> bool {
        !self.hides(one_m, other_m) && !self.hides(other_m, one_m)
    }

    /// A corner is as sure as the pixels of its level.
    pub(super) fn pixel_std_dev_px(&self, level: u8) -> f64 {
        self.point_std_dev_px * self.pyramid.scale_factor.powi(i32::from(level))
    }

    /// How corners are searched for, no farther from where they are predicted.
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
