//! How a camera is followed.

use geometry::{ParameterError, parameter};

use crate::frame::FrameConfig;
use crate::local_map::LocalMapConfig;
use crate::matching::points::MatchConfig;
use crate::motion::MotionConfig;
use crate::solve::{RefineConfig, RigidSetsConfig};

geometry::parameters! {
    /// Parameters of [`Tracker`](super::Tracker).
    #[derive(Clone, PartialEq, Debug)]
    pub struct TrackerConfig {
        /// What is extracted from a pair of images.
        frame: FrameConfig;
        /// How the camera is expected to move.
        motion: MotionConfig;
        /// What is kept of what it has seen.
        map: LocalMapConfig;
        /// How a pose is found near a guess.
        refine: RefineConfig;
        /// How moving objects are separated from the static scene.
        sets: RigidSetsConfig;
        /// When the camera is followed, and when it is lost.
        follow: FollowConfig;
    }
}

geometry::parameters! {
    /// When the camera is followed, and when it is lost.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct FollowConfig {
        /// A map begins with a frame that has this many corners with depths; a line segment counts as two corners, here and in
        /// the next parameters.
        // PL-SLAM, section 2.3, asks for 50 points of a keyframe.
        least_to_begin: usize = 50, at_least(4.0);
        /// A pose is accepted when it explains this many corners and line segments.
        // Three points give a pose; ORB-SLAM2 asks for 30 in its local map, in scenes with more to see.
        least_inliers: usize = 15, at_least(4.0);
        /// A pose is accepted when it explains this share of the features that were matched to landmarks.
        // A person close to the camera, and what has changed.
        least_inlier_share: f64 = 0.15, share;
        /// After the camera was lost, a pose is accepted when it explains this many corners and line segments.
        // ORB-SLAM2 asks for 50 after relocalisation, of points alone.
        least_relocalised: usize = 30, at_least(4.0);
        /// Landmarks are searched for at least this far around their predicted position.
        // What the pose of the first round may be off by, and the corners' own noise on top.
        narrow_radius_px: f64 = 7.0, positive;
        /// Landmarks are searched for at most this far around their predicted position; at least narrow_radius_px.
        // A tenth of an image's width: farther off a descriptor's rivals are too many.
        widest_radius_px: f64 = 60.0, positive;
        /// Between the two radii landmarks are searched for within this many standard deviations of the prediction.
        search_std_devs: f64 = 3.0, positive;
        /// New landmarks are added when the pose explains a smaller share of the features with depths.
        // More than a half: what is seen must not depend on what is about to leave the view.
        known_share: f64 = 0.6, share;
        /// When the pose explains a smaller share of the features that were matched to landmarks, the frame is searched for
        /// things that move otherwise than the room.
        // Noise and wrong matches alone leave more than 80 %.
        suspicious_share: f64 = 0.7, share;
        /// Frames out of order are dropped, but after this many in a row the clock has jumped.
        most_out_of_order: u32 = 3, at_least(1.0);
        /// The time that the camera takes to read the rows of an image, where it is known.
        // No rolling shutter takes longer between two images of a camera that shows motion.
        readout_s: f64 = 0.0, between(0.0, 0.1);
        /// Whether the time to read an image is estimated.
        estimate_readout: bool = true;
        /// How corners are matched when the camera is lost.
        // One thing may be several landmarks that look alike: the next best is no rival.
        blind_matching: MatchConfig = MatchConfig { max_distance: 50, max_ratio: 1.0, ..MatchConfig::default() };
    }
    check = Self::check_radii;
}

impl FollowConfig {
    fn check_radii(&self) -> Result<(), ParameterError> {
        let (narrow, widest) = (self.narrow_radius_px, self.widest_radius_px);
        let accepted = ("at least narrow_radius_px", narrow);
        parameter::check("widest_radius_px", accepted, widest, widest >= narrow)
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
            ("parameter frame.points.levels", |c| c.frame.points.levels = 0),
            ("parameter motion.max_gap_s", |c| c.motion.max_gap_s = 0.0),
            ("parameter map.max_points", |c| c.map.max_points = 0),
            ("parameter map.point_matching.max_ratio", |c| c.map.point_matching.max_ratio = 0.0),
            ("parameter refine.rounds", |c| c.refine.rounds = 0),
            ("parameter sets.max_sets", |c| c.sets.max_sets = 0),
            ("parameter follow.least_inliers", |c| c.follow.least_inliers = 3),
            ("parameter follow.widest_radius_px", |c| c.follow.widest_radius_px = 1.0),
            ("parameter follow.readout_s", |c| c.follow.readout_s = f64::NAN),
        ];
        for (name, spoil) in cases {
            let mut config = TrackerConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.starts_with(name), "{message}");
        }
    }
}
