//! The parameters of bundle adjustment.

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use crate::map::ByOdometry;
use crate::solve::RobustKernel;

/// Parameters of [`adjust`](super::adjust).
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BundleConfig {
    /// This many of the right sightings are to pass for inliers.
    pub inlier_probability: f64,
    /// The robust kernel of the first half.
    pub kernel: RobustKernel,
    /// That of motions, in both halves: a gate cannot separate a wrong one from the others.
    pub motion_kernel: RobustKernel,
    /// Steps of the first half, at most.
    pub first_iterations: usize,
    /// Steps of the second, without outliers and without the kernel.
    pub second_iterations: usize,
    /// A sighting whose place in the image fits but not its depth is used without the depth.
    pub keep_without_depth: bool,
}

impl Default for BundleConfig {
    fn default() -> Self {
        Self {
            // The quantiles 5.991 and 7.815, five steps and ten: ORB-SLAM2's local bundle adjustment. It takes Huber's kernel;
            // but what a depth camera says at edges is off by decimetres, often to the same side, and Huber's lets each of them
            // pull for ever: on a turning camera whole keyframes went 7 cm astray.
            inlier_probability: 0.95,
            kernel: RobustKernel::Cauchy,
            // A camera that follows moving objects has a far larger error than the drift of odometry.
            motion_kernel: RobustKernel::Cauchy,
            first_iterations: 5,
            second_iterations: 10,
            // Corners are found where things end, and there the depths of a Kinect belong to either side.
            keep_without_depth: true,
        }
    }
}

impl BundleConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let share = self.inlier_probability;
        let holds = share > 0.0 && share < 1.0;
        parameter::check("inlier_probability", "between 0 and 1", share, holds)?;
        parameter::positive("first_iterations", self.first_iterations as f64)
    }
}

/// Which part of a map is adjusted, and how well its features are seen.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WindowConfig {
    /// Keyframes that are adjusted, at most: those that see most of the same landmarks.
    pub max_keyframes: usize,
    /// Keyframes that are held, at most: those that see most of what is adjusted.
    pub max_fixed: usize,
    /// A keyframe that sees fewer of the same landmarks is no neighbour.
    pub least_shared: u32,
    /// Standard deviation of a corner of level 0, along each axis of the image.
    pub point_std_dev_px: f64,
    /// Standard deviation of an end of a segment, across it.
    pub line_std_dev_px: f64,
    /// This many depths of one view are off by the same: together they say no more than one of them.
    pub depths_alike: f64,
    /// How well odometry knows a motion.
    pub motions: MotionConfig,
}

/// The accuracy of odometry's motion from one keyframe to another: standard deviations.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MotionConfig {
    /// Of a translation, however short the distance is.
    pub shift_m: f64,
    /// Of a rotation, however short the distance is.
    pub turn_rad: f64,
    /// In addition, for each metre of distance: of a translation in metres, of a rotation in radians.
    pub drift_per_m: f64,
    /// And for each radian turned, likewise.
    pub drift_per_rad: f64,
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self {
            // The error of odometry from frame to frame where objects are near.
            shift_m: 0.002,
            turn_rad: 0.001,
            // Half a per cent of the distance: the largest drift that is allowed for.
            drift_per_m: 0.005,
            drift_per_rad: 0.005,
        }
    }
}

/// How well a motion is known: standard deviations along and about each axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MotionStdDev {
    /// Of its shift.
    pub shift_m: f64,
    /// Of its turn.
    pub turn_rad: f64,
}

impl MotionConfig {
    /// The accuracy of odometry's motion between these two; `None` where it was lost in between.
    #[must_use]
    pub fn between(&self, one: &ByOdometry, other: &ByOdometry) -> Option<MotionStdDev> {
        let travelled_m = (other.travelled_m - one.travelled_m).abs();
        let turned_rad = (other.turned_rad - one.turned_rad).abs();
        let drift = self.drift_per_m * travelled_m + self.drift_per_rad * turned_rad;
        let std_dev =
            MotionStdDev { shift_m: self.shift_m + drift, turn_rad: self.turn_rad + drift };
        (one.leg == other.leg).then_some(std_dev)
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::positive("motions.shift_m", self.shift_m)?;
        parameter::positive("motions.turn_rad", self.turn_rad)?;
        parameter::not_negative("motions.drift_per_m", self.drift_per_m)?;
        parameter::not_negative("motions.drift_per_rad", self.drift_per_rad)
    }
}

impl Default for WindowConfig {
    fn default() -> Self {
        Self {
            // What a local adjustment must end in a keyframe's time with; see the benchmark `bundle`.
            max_keyframes: 20,
            max_fixed: 40,
            // An edge of ORB-SLAM's covisibility graph (Mur-Artal et al. 2015, section III-D).
            least_shared: 15,
            // ORB-SLAM2's: one pixel of the level.
            point_std_dev_px: 1.0,
            line_std_dev_px: 1.0,
            // Depth and colour are not taken at the same time, and their calibrations are off: what that does to depths is
            // the same for whole surfaces. Taken for independent, depths drag a turning camera along.
            depths_alike: 25.0,
            motions: MotionConfig::default(),
        }
    }
}

impl WindowConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::positive("max_keyframes", self.max_keyframes as f64)?;
        parameter::positive("max_fixed", self.max_fixed as f64)?;
        parameter::positive("point_std_dev_px", self.point_std_dev_px)?;
        parameter::positive("line_std_dev_px", self.line_std_dev_px)?;
        parameter::positive("depths_alike", self.depths_alike)?;
        self.motions.validate()
    }
}
