//! After a gap in the scans: the vehicle may be anywhere along its way.

use estimation::Twist;

use super::LidarOdometry;
use super::hint::MotionHint;
use super::track::{LONGEST_PREDICTION_S, Track};
use crate::registration::{PreparedCloud, Registration, RegistrationError, align};

/// A scan is missing where the time between two is longer than so many times that before.
const GAP_IN_INTERVALS: f64 = 2.0;
/// The vehicle may have become faster by this factor.
const FASTER: f64 = 1.5;
/// Registrations begin this many voxels of the map apart: they find the pose from so far off.
const STEP_VOXELS: f64 = 3.0;
/// ... and this far turned: a step of 3 m, 30 m away.
const STEP_RAD: f64 = 0.1;
/// So many begin at most: on 90 m of the way, about the reach of the map.
const MOST_STEPS: f64 = 30.0;

impl Track {
    /// How long the motion to a scan has not been measured, if that is longer than it can be predicted; otherwise 0.
    pub(super) fn unknown_s(&self, passed_s: f64, hint: &MotionHint) -> f64 {
        let is_gap =
            passed_s > LONGEST_PREDICTION_S && passed_s > GAP_IN_INTERVALS * self.interval_s;
        if is_gap && !hint.has_translation() { passed_s } else { 0.0 }
    }
}

impl LidarOdometry {
    /// Registers a scan from places along the way, from where the vehicle was last to where it would be if it had become faster.
    /// Most of the scan is in the map at the true one: elsewhere in a street the walls agree as well, but nothing else.
    pub(super) fn search(
        &self,
        cloud: &PreparedCloud,
        track: &Track,
        hint: &MotionHint,
        passed_s: f64,
    ) -> Result<Registration, RegistrationError> {
        let going = track.velocity.unwrap_or_default();
        let Twist { linear_m_per_s, angular_rad_per_s } = going;
        let steps_per_s = linear_m_per_s.norm() / (STEP_VOXELS * self.config.map_voxel_edge_m)
            + angular_rad_per_s.norm() / STEP_RAD;
        let steps = (FASTER * passed_s * steps_per_s).min(MOST_STEPS) as u32;
        let rules = self.rules(&track.threshold);
        let from = |step: u32| {
            // None without a motion, but that from where it was.
            let motion = going.displacement(f64::from(step) / steps_per_s.max(f64::MIN_POSITIVE));
            let start = track.odom_from_lidar * hint.motion(&motion).unwrap_or(motion);
            align(cloud, &self.map, &start, &rules, &*self.executor)
        };
        let standing = from(0);
        (1..=steps).map(from).fold(standing, |best, found| match (&best, &found) {
            (Err(_), Ok(_)) => found,
            (Ok(before), Ok(now)) if now.overlap > before.overlap => found,
            _ => best,
        })
    }
}
