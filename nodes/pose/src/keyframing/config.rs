//! The numbers of all rules, with their sources.

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use crate::bundle_adjustment::WindowConfig;
use crate::matching::lines::ProjectedLineConfig;
use crate::matching::points::{GuidedConfig, MatchConfig};

/// Parameters of the rules. "The seed" is PL-SLAM section 2.1.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KeyframingConfig {
    /// After a relocalisation this many frames must have passed.
    pub frames_after_relocalisation: u64,
    /// While mapping is busy, this many frames after the last keyframe.
    pub frames_after_keyframe: u64,
    /// Points that a keyframe must see.
    pub least_points: usize,
    /// It must see less than this share of the points of the keyframe that it is followed from.
    pub max_tracked_share: f64,

    /// Between the camera and its projector, in metres.
    pub baseline_m: f64,
    /// A point no farther than this many baselines is close: it determines the camera's position, and not only its rotation.
    pub close_baselines: f64,

    /// A landmark is on probation for this many keyframes after its own.
    pub probation_keyframes: u64,
    /// Of the frames that should have seen it, it must be found in more than this share.
    pub min_found_share: f64,
    /// When this many keyframes have come after its own ...
    pub settled_keyframes: u64,
    /// ... it must have been seen this often: a view with its depth counts for two (ORB-SLAM2).
    pub least_views: usize,

    /// A keyframe goes when this share of its close points ...
    pub redundant_share: f64,
    /// ... is seen by this many others, on the same or a finer level.
    pub redundant_sightings: usize,

    /// Keyframes that it is triangulated with and whose landmarks are compared, at most.
    pub neighbours: usize,
    /// Of each of these, this many more for the comparison.
    pub second_neighbours: usize,
    /// A neighbour sees at least this many of the same landmarks.
    pub least_shared: u32,
    /// The cosine of the angle between two rays must be less.
    pub max_parallax_cos: f64,
    /// Distances must go with levels to this factor, times the step of a level.
    pub scale_consistency: f64,
    /// How corners of two keyframes are matched.
    pub matching: MatchConfig,
    /// How points are looked for in another keyframe.
    pub fusing: GuidedConfig,
    /// How lines are.
    pub fusing_lines: ProjectedLineConfig,
    /// A landmark is looked for from directions that differ by at most this much from the mean one.
    pub max_viewing_angle_rad: f64,
    /// How well features are seen.
    pub window: WindowConfig,
}

impl Default for KeyframingConfig {
    fn default() -> Self {
        let guided = GuidedConfig::default();
        Self {
            // The seed, "Decisión de nuevo fotograma clave", all four.
            frames_after_relocalisation: 20,
            frames_after_keyframe: 20,
            least_points: 50,
            max_tracked_share: 0.9,
            // The Kinect's: 7.5 cm (Khoshelham and Elberink 2012); 40 of them: the seed, section 2.1 (Paz et al. 2008).
            baseline_m: 0.075,
            close_baselines: 40.0,
            // ORB-SLAM: recent points are those of the last three keyframes.
            probation_keyframes: 3,
            // The seed, "Eliminación de puntos de mapa recientes": in more than 25 % of the frames; if more than one keyframe
            // has passed since its creation, in at least three. The same for lines (section 2.3).
            min_found_share: 0.25,
            settled_keyframes: 2,
            least_views: 3,
            // The seed, "Selección local de fotogramas clave".
            redundant_share: 0.9,
            redundant_sightings: 3,
            // ORB-SLAM2: ten neighbours to triangulate and fuse with, five more of each to fuse with, edges of 15.
            neighbours: 10,
            second_neighbours: 5,
            least_shared: 15,
            // ORB-SLAM2: 1.15 degrees, and 1.5 levels' steps.
            max_parallax_cos: 0.9998,
            scale_consistency: 1.5,
            // ORB-SLAM2: 50 bits where the epipolar line is the only guide, and 3 pixels of the level where a point is to be
            // fused.
            matching: MatchConfig { max_distance: 50, ..MatchConfig::default() },
            fusing: GuidedConfig {
                matching: MatchConfig { max_distance: 50, ..guided.matching },
                radius_px: 3.0,
                ..guided
            },
            // A line's end is seen to a pixel, as a point is.
            fusing_lines: ProjectedLineConfig {
                max_offset_px: 3.0,
                ..ProjectedLineConfig::default()
            },
            // PL-SLAM section 2.3.
            max_viewing_angle_rad: std::f64::consts::FRAC_PI_3,
            window: WindowConfig::default(),
        }
    }
}

impl KeyframingConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::between("max_tracked_share", self.max_tracked_share, 0.0, 1.0)?;
        parameter::positive("baseline_m", self.baseline_m)?;
        parameter::positive("close_baselines", self.close_baselines)?;
        parameter::between("min_found_share", self.min_found_share, 0.0, 1.0)?;
        parameter::between("redundant_share", self.redundant_share, 0.0, 1.0)?;
        parameter::between("max_parallax_cos", self.max_parallax_cos, 0.0, 1.0)?;
        let scale = self.scale_consistency;
        parameter::check("scale_consistency", "at least 1", scale, scale >= 1.0)?;
        parameter::positive("max_viewing_angle_rad", self.max_viewing_angle_rad)?;
        self.window.validate()
    }

    /// Points no farther than this are close.
    pub(super) fn close_m(&self) -> f64 {
        self.close_baselines * self.baseline_m
    }
}
