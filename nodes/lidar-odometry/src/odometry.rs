//! The pose of the vehicle: each scan is registered to a map of the last ones.
//!
//! | file | the idea |
//! |---|---|
//! | `velocity`, `deskew` | constant velocity; the scan as if measured at once |
//! | `threshold` | how far the truth may be from the prediction |
//! | `track` | the state after a scan; the first scans, and those that do not fit |
//! | `pose` | the result of each scan |
//! | `gap` | the search after a gap in the scans |
//! | `hint` | the motion by wheels or a gyroscope |
//! | `scan_to_scan` | the thesis' method, for comparison |
//! | `follower` | both methods behind one call, with the choice of points |
//!
//! The frame is the KISS-ICP pipeline (Vizzo et al. 2023, section III); a scan is registered to the planes of voxels, by
//! the generalised distance (Koide et al. 2021).

mod config;
mod deskew;
mod follower;
mod gap;
mod hint;
mod pose;
mod scan_to_scan;
#[cfg(test)]
mod tests;
mod threshold;
mod track;

use std::sync::Arc;

use estimation::{Executor, Twist};
use geometry::Stamp;
use nalgebra::Point3;

pub use self::config::LidarOdometryConfig;
pub use self::deskew::deskewed_cloud;
pub use self::follower::{Follower, FollowerConfig, FollowerError, OdometryMethod};
pub use self::hint::MotionHint;
pub use self::pose::{LidarPose, Outcome, Quality, Refusal};
pub use self::scan_to_scan::{Guess, ScanToScan};

use self::track::{LONGEST_PREDICTION_S, Moment, Track};
use crate::registration::{ParameterError, VoxelSurface, align};

/// Scans that are nearer together are one and the same, stamped twice: no sensor turns a thousand times a second.
const LEAST_INTERVAL_S: f64 = 1e-3;

/// The points of a turn of the sensor, in the sensor's frame of when each was measured.
#[derive(Clone, Copy, Debug)]
pub struct LidarScan<'a> {
    /// When the times count from.
    pub stamp: Stamp,
    /// The points. Those that are not finite are left out.
    pub points_m: &'a [Point3<f32>],
    /// When each was measured, in seconds since the stamp. `None` where all are as if measured at the stamp.
    pub times_s: Option<&'a [f32]>,
}

/// Follows a turning LiDAR by its scans.
///
/// Memory is bounded by `max_map_voxels`. The same scans give the same poses, bit for bit, whatever the number of threads.
#[derive(Clone, Debug)]
pub struct LidarOdometry {
    config: LidarOdometryConfig,
    executor: Arc<dyn Executor>,
    map: VoxelSurface,
    track: Option<Track>,
}

impl LidarOdometry {
    /// An odometry that has seen nothing.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(
        config: LidarOdometryConfig,
        executor: Arc<dyn Executor>,
    ) -> Result<Self, ParameterError> {
        config.validate()?;
        Ok(Self { config, executor, map: VoxelSurface::new(config.map_voxel_edge_m), track: None })
    }

    /// Forgets everything: the next scan is the first one.
    pub fn forget(&mut self) {
        self.map.clear();
        self.track = None;
    }

    /// Adds the next scan. Directions that it does not determine are predicted, and listed in the quality.
    ///
    /// # Errors
    /// When the scan has no point within range, or it does not come after the one before. Nothing changes then.
    pub fn step(&mut self, scan: &LidarScan<'_>) -> Result<LidarPose, Refusal> {
        self.step_with(scan, &MotionHint::default())
    }

    /// The same, where wheels or a gyroscope measure the motion since the last pose ([`Self::interval`]): the scan is expected
    /// there, and deskewed by it.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_with(
        &mut self,
        scan: &LidarScan<'_>,
        hint: &MotionHint,
    ) -> Result<LidarPose, Refusal> {
        let moment = Moment::of(scan)?;
        let Some(mut track) = self.track.take() else { return self.start(scan, moment) };
        let pose = self.next(&mut track, scan, &moment, hint);
        self.track = Some(track);
        pose
    }

    /// From when to when the motion would be of use that leads to a scan: from the last pose to that of the scan.
    #[must_use]
    pub fn interval(&self, scan: &LidarScan<'_>) -> Option<(Stamp, Stamp)> {
        Some((self.track.as_ref()?.stamp, Moment::of(scan).ok()?.stamp))
    }

    /// The points of the map that scans are registered to, in the odometry's frame.
    #[must_use]
    pub fn local_map(&self) -> Vec<Point3<f32>> {
        self.map.places_m().map(|place_m| Point3::from(place_m.cast())).collect()
    }

    /// The pipeline of KISS-ICP (section III), and its equations.
    fn next(
        &mut self,
        track: &mut Track,
        scan: &LidarScan<'_>,
        moment: &Moment,
        hint: &MotionHint,
    ) -> Result<LidarPose, Refusal> {
        let passed_s = moment.stamp.seconds_since(track.stamp);
        if passed_s < LEAST_INTERVAL_S {
            return Err(Refusal::NotLater { since_s: passed_s });
        }
        if track.velocity.is_none() {
            self.set_out(track, scan, moment, passed_s)?;
        }
        // A: constant velocity (eq. 1), and the scan is as if measured at once (eq. 2).
        let hinted = hint.motion(&track.expected_motion(passed_s));
        let predicted = track.odom_from_lidar * hinted.unwrap_or(track.expected_motion(passed_s));
        let by_hint = hinted
            .filter(|_| passed_s <= LONGEST_PREDICTION_S)
            .and_then(|motion| Twist::between(&motion, passed_s));
        let cloud = self.prepared(scan, moment, by_hint.or(track.velocity))?;
        // C, D: correspondences with the map reach as far as predictions have been off (eq. 6), and are doubted sooner.
        let rules = self.rules(&track.threshold);
        // E: the pose.
        let unknown_s = track.unknown_s(passed_s, hint);
        let found = if unknown_s > 0.0 {
            self.search(&cloud, track, hint, passed_s)
        } else {
            align(&cloud, &self.map, &predicted, &rules, &*self.executor)
        };
        let found = match found {
            Ok(found) => found,
            Err(error) => return Ok(self.hold(track, scan, &cloud, (moment, &predicted), error)),
        };
        let odom_from_lidar = found.target_from_source;
        track.velocity = Twist::between(&track.odom_from_lidar.inv_mul(&odom_from_lidar), passed_s);
        if unknown_s == 0.0 {
            track.threshold.take_in(&predicted, &odom_from_lidar);
        }
        track.arrive(moment, odom_from_lidar);
        self.take_in(&cloud, track);
        Ok(LidarPose {
            stamp: moment.stamp,
            odom_from_lidar,
            covariance: found.covariance,
            quality: Quality {
                unknown_s,
                ..self.quality(&cloud, &rules, Outcome::Matched, Some(&found))
            },
        })
    }
}
