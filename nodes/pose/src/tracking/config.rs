//! How a camera is followed.

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use crate::frame::{FrameConfig, FrameConfigError};
use crate::local_map::LocalMapConfig;
use crate::matching::points::MatchConfig;
use crate::motion::MotionConfig;
use crate::solve::{RefineConfig, RigidSetsConfig};

/// Parameters of [`Tracker`](super::Tracker).
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerConfig {
    /// What is looked for in a pair of images.
    pub frame: FrameConfig,
    /// How the camera is thought to move.
    pub motion: MotionConfig,
    /// What is kept of what it has seen.
    pub map: LocalMapConfig,
    /// How a pose is found near a guess.
    pub refine: RefineConfig,
    /// How things that move otherwise than the room are told from it.
    pub sets: RigidSetsConfig,
    /// When the camera is followed, and when it is lost.
    pub follow: FollowConfig,
}

/// When the camera is followed, and when it is lost.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FollowConfig {
    /// A map begins with a frame that has so many corners with depths; here and below a segment is worth two.
    pub least_to_begin: usize,
    /// A pose counts when it explains so many corners and segments, ...
    pub least_inliers: usize,
    /// ... and this share of those that were held to be landmarks.
    pub least_inlier_share: f64,
    /// After the camera was lost, a pose counts when it explains so many.
    pub least_relocalised: usize,
    /// Landmarks are looked for at least so far around where they are foreseen ...
    pub narrow_radius_px: f64,
    /// ... and at most so far.
    pub widest_radius_px: f64,
    /// In between: so many standard deviations of the prediction.
    pub search_std_devs: f64,
    /// New landmarks are taken in when the pose explains a smaller share of the features with depths.
    pub known_share: f64,
    /// When it explains a smaller share of those that were held to be landmarks, it is looked for something that moves
    /// otherwise than the room.
    pub suspicious_share: f64,
    /// Frames out of order are dropped, but after so many in a row the clock has jumped.
    pub most_out_of_order: u32,
    /// How long the camera takes to read the rows of an image, where that is known.
    pub readout_s: f64,
    /// Whether that time is estimated.
    pub estimate_readout: bool,
    /// How corners are matched when the camera is lost.
    pub blind_matching: MatchConfig,
}

impl Default for FollowConfig {
    fn default() -> Self {
        Self {
            // PL-SLAM, section 2.3, asks for 50 points of a keyframe.
            least_to_begin: 50,
            // Three points give a pose; ORB-SLAM2 asks for 30 in its local map, in scenes with more to see.
            least_inliers: 15,
            // A person close to the camera, and what has changed.
            least_inlier_share: 0.15,
            // ORB-SLAM2 asks for 50 after relocalisation, of points alone.
            least_relocalised: 30,
            // What the pose of the first round may be off by, and the corners' own noise on top.
            narrow_radius_px: 7.0,
            // A tenth of an image's width: farther off a descriptor's rivals are too many.
            widest_radius_px: 60.0,
            search_std_devs: 3.0,
            // More than a half: what is seen must not hang on what is about to leave the view.
            known_share: 0.6,
            // Noise and wrong matches alone leave more than 80 %.
            suspicious_share: 0.7,
            most_out_of_order: 3,
            readout_s: 0.0,
            estimate_readout: true,
            // One thing may be several landmarks that look alike: the next best is no rival.
            blind_matching: MatchConfig {
                max_distance: 50,
                max_ratio: 1.0,
                ..MatchConfig::default()
            },
        }
    }
}

/// A parameter has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum TrackerConfigError {
    /// One of the features'.
    #[error("frame: {0}")]
    Frame(#[from] FrameConfigError),
    /// One of the motion's.
    #[error("motion: {0}")]
    Motion(ParameterError),
    /// One of the map's.
    #[error("map: {0}")]
    Map(ParameterError),
    /// One of the matching's.
    #[error("map: point_matching: {0}")]
    PointMatching(ParameterError),
    /// The same for lines.
    #[error("map: line_matching: {0}")]
    LineMatching(ParameterError),
    /// One of the solver's.
    #[error("refine: {0}")]
    Refine(ParameterError),
    /// One of those that concern moving things.
    #[error("sets: {0}")]
    Sets(ParameterError),
    /// One of the matching's when the camera is lost.
    #[error("follow: blind_matching: {0}")]
    BlindMatching(ParameterError),
    /// One of the following's.
    #[error("follow: {0}")]
    Follow(ParameterError),
}

impl TrackerConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), TrackerConfigError> {
        self.frame.validate()?;
        self.motion.validate().map_err(TrackerConfigError::Motion)?;
        self.map.validate().map_err(TrackerConfigError::Map)?;
        let (points, lines) = (self.map.point_matching, self.map.line_matching);
        points.validate().map_err(TrackerConfigError::PointMatching)?;
        lines.validate().map_err(TrackerConfigError::LineMatching)?;
        self.refine.validate().map_err(TrackerConfigError::Refine)?;
        self.sets.validate().map_err(TrackerConfigError::Sets)?;
        self.follow.blind_matching.validate().map_err(TrackerConfigError::BlindMatching)?;
        self.follow.validate().map_err(TrackerConfigError::Follow)
    }
}

/// No rolling shutter takes longer between two images of a camera that shows motion.
const SLOWEST_READOUT_S: f64 = 0.1;

impl FollowConfig {
    /// Checks every parameter but those of the matching.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::at_least("least_to_begin", self.least_to_begin, 4)?;
        parameter::at_least("least_inliers", self.least_inliers, 4)?;
        parameter::at_least("least_relocalised", self.least_relocalised, 4)?;
        parameter::between("least_inlier_share", self.least_inlier_share, 0.0, 1.0)?;
        parameter::positive("narrow_radius_px", self.narrow_radius_px)?;
        let widest = self.widest_radius_px;
        let holds = widest.is_finite() && widest >= self.narrow_radius_px;
        parameter::check("widest_radius_px", "at least narrow_radius_px", widest, holds)?;
        parameter::positive("search_std_devs", self.search_std_devs)?;
        parameter::between("known_share", self.known_share, 0.0, 1.0)?;
        parameter::between("suspicious_share", self.suspicious_share, 0.0, 1.0)?;
        parameter::at_least("most_out_of_order", self.most_out_of_order as usize, 1)?;
        parameter::between("readout_s", self.readout_s, 0.0, SLOWEST_READOUT_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_bad_values_are_named() {
        type Spoil = fn(&mut TrackerConfig);
        assert_eq!(TrackerConfig::default().validate(), Ok(()));
        let cases: [(&str, Spoil); 9] = [
            ("frame: points: parameter levels", |c| c.frame.points.levels = 0),
            ("motion: parameter max_gap_s", |c| c.motion.max_gap_s = 0.0),
            ("map: parameter max_points", |c| c.map.max_points = 0),
            ("map: point_matching: parameter max_ratio", |c| c.map.point_matching.max_ratio = 0.0),
            ("refine: parameter rounds", |c| c.refine.rounds = 0),
            ("sets: parameter max_sets", |c| c.sets.max_sets = 0),
            ("follow: parameter least_inliers", |c| c.follow.least_inliers = 3),
            ("follow: parameter widest_radius_px", |c| c.follow.widest_radius_px = 1.0),
            ("follow: parameter readout_s", |c| c.follow.readout_s = f64::NAN),
        ];
        for (name, spoil) in cases {
            let mut config = TrackerConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.starts_with(name), "{message}");
        }
    }
}
