//! Poses, points and lines that explain together what keyframes saw (PL-SLAM section 2.1: local and full bundle
//! adjustment).
//!
//! | module | what is in it |
//! |---|---|
//! | `config` | the parameters |
//! | `motion` | the motion that odometry measured from one pose to another |
//! | `landmark` | three numbers to correct a point by, four for a line, and the derivatives of an error by them |
//! | `problem` | the cost, and its normal equations |
//! | `schur` | the landmarks are eliminated; the poses are left, and solved for |
//! | `descent` | the steps |
//! | `legs` | the legs of the odometry through a map |
//! | `window` | which part of a map is adjusted, and how the result is taken into it |
//!
//! Levenberg-Marquardt under a robust kernel; at half of the iterations outliers are decided, and the rest continues without them;
//! at the end they are decided again (Mur-Artal et al. 2015, section VI-D). The errors are those of [`crate::solve`]: pixels, and
//! depths where there are any.

mod config;
mod descent;
mod landmark;
mod legs;
mod motion;
mod problem;
mod schur;
#[cfg(test)]
mod tests;
mod window;

use geometry::{CameraModel, CameraModelError, ParameterError};
use nalgebra::{Isometry3, Point3};

pub use config::{BundleConfig, MotionConfig, MotionStdDev, WindowConfig};
use estimation::perturbation::is_rigid;
pub use motion::Motion;
pub use window::{Applied, StaleWindow, Window};
pub(crate) use window::{line_observation, point_observation};

use crate::solve::{LineObservation, PluckerLine, PointObservation, PoseError, Verdict};
use descent::Search;

/// The input of an adjustment.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Bundle {
    /// The poses.
    pub poses: Vec<BundlePose>,
    /// The points, in the map frame.
    pub points_m: Vec<Point3<f64>>,
    /// The lines: two points of each, in the map frame.
    pub lines_m: Vec<[Point3<f64>; 2]>,
    /// The observations of the points.
    pub point_sightings: Vec<Sighting<PointObservation>>,
    /// The observations of the lines.
    pub line_sightings: Vec<Sighting<LineObservation>>,
    /// The motions that odometry measured between the poses.
    pub motions: Vec<Motion>,
}

/// A camera and where it was.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BundlePose {
    /// The rectified camera.
    pub camera: CameraModel,
    /// Where it is thought to have been.
    pub camera_from_map: Isometry3<f64>,
    /// Whether that is certain.
    pub is_fixed: bool,
}

/// A landmark that a camera saw.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sighting<O> {
    /// Which pose.
    pub pose: usize,
    /// Which point, or which line.
    pub landmark: usize,
    /// Where in the image. Its place in the map is not used.
    pub seen: O,
}

/// A bundle, adjusted.
#[derive(Clone, PartialEq, Debug)]
pub struct Adjusted {
    /// The poses: `camera_from_map`.
    pub poses: Vec<Isometry3<f64>>,
    /// The points.
    pub points_m: Vec<Point3<f64>>,
    /// The lines: the points of each that are nearest to those given.
    pub lines_m: Vec<[Point3<f64>; 2]>,
    /// The status of each sighting of a point.
    pub point_verdicts: Vec<Verdict>,
    /// And of a line.
    pub line_verdicts: Vec<Verdict>,
    /// The cost of all usable sightings before, under the kernel.
    pub cost_before: f64,
    /// And what the same cost after. It may be more, when what is an outlier does not count any more.
    pub cost: f64,
    /// Steps that were taken.
    pub iterations: usize,
    /// Whether it was stopped before it was done: everything is as good as it was by then.
    pub was_aborted: bool,
}

/// A bundle that cannot be adjusted.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum BundleError {
    /// A parameter means nothing.
    #[error(transparent)]
    Config(#[from] ParameterError),
    /// The numbers of a camera describe none.
    #[error(transparent)]
    Camera(#[from] CameraModelError),
    /// A camera has lens distortion.
    #[error("camera {pose} has lens distortion: sightings must be those of rectified images")]
    NotRectified {
        /// Which pose.
        pose: usize,
    },
    /// A sighting is of a pose or a landmark that is not there.
    #[error(
        "sighting {sighting} is of pose {pose} and landmark {landmark}, which are not both there"
    )]
    NoSuchThing {
        /// Which of the points' or of the lines'.
        sighting: usize,
        /// The pose.
        pose: usize,
        /// The landmark.
        landmark: usize,
    },
    /// A motion is not between two of the poses, or has no valid covariance.
    #[error("motion {motion} is not between two of {poses} poses, or its numbers are invalid")]
    Motion {
        /// Which motion.
        motion: usize,
        /// How many poses there are.
        poses: usize,
    },
    /// A number is not finite, or a line has no length.
    #[error("{what} {index} has a number that is not finite, or no length")]
    NotFinite {
        /// A pose, a point or a line.
        what: &'static str,
        /// Which.
        index: usize,
    },
    /// No pose is fixed: everything together could be anywhere.
    #[error("none of {poses} poses is fixed")]
    NothingFixed {
        /// How many there are.
        poses: usize,
    },
}

/// Finds the poses, points and lines that explain all sightings best, near those given. `is_aborted` is called before
/// every step; of a bundle that was stopped everything is as good as it was by then, and all of it fits together.
///
/// A sighting that cannot be used is ignored, and a landmark that its sightings do not determine stays. The same bundle gives
/// the same result, bit for bit.
///
/// # Errors
/// When a camera, a parameter or an index cannot be used, and when no pose is fixed.
pub fn adjust(
    bundle: &Bundle,
    config: &BundleConfig,
    is_aborted: &dyn Fn() -> bool,
) -> Result<Adjusted, BundleError> {
    config.validate()?;
    bundle.check()?;
    let mut search = Search::new(bundle, config, is_aborted);
    let all = search.usable();
    let cost_before = search.cost(&all);
    search.descend(&all, config.kernel, config.first_iterations);
    let inliers = search.judged();
    search.descend(&inliers, crate::solve::RobustKernel::None, config.second_iterations);
    let uses = search.judged();
    let cost = search.cost(&all);
    let state = search.state;
    Ok(Adjusted {
        poses: state.poses,
        points_m: state.points_m,
        lines_m: state.lines_m,
        point_verdicts: uses.points,
        line_verdicts: uses.lines,
        cost_before,
        cost,
        iterations: search.iterations,
        was_aborted: search.was_aborted,
    })
}

impl Bundle {
    fn check(&self) -> Result<(), BundleError> {
        for (pose, of_pose) in self.poses.iter().enumerate() {
            match crate::solve::refine::check_camera(&of_pose.camera) {
                Ok(()) => {}
                Err(PoseError::Camera(error)) => return Err(error.into()),
                Err(_) => return Err(BundleError::NotRectified { pose }),
            }
            if !is_rigid(&of_pose.camera_from_map) {
                return Err(BundleError::NotFinite { what: "pose", index: pose });
            }
        }
        let is_nowhere = |point: &Point3<f64>| !point.iter().all(|value| value.is_finite());
        if let Some(index) = self.points_m.iter().position(is_nowhere) {
            return Err(BundleError::NotFinite { what: "point", index });
        }
        let is_none = |[start, end]: &[Point3<f64>; 2]| PluckerLine::through(start, end).is_none();
        if let Some(index) = self.lines_m.iter().position(is_none) {
            return Err(BundleError::NotFinite { what: "line", index });
        }
        self.check_sightings(&self.point_sightings, self.points_m.len())?;
        self.check_sightings(&self.line_sightings, self.lines_m.len())?;
        let poses = self.poses.len();
        if let Some(motion) = self.motions.iter().position(|motion| !motion.is_usable(poses)) {
            return Err(BundleError::Motion { motion, poses });
        }
        if self.poses.iter().any(|pose| pose.is_fixed) {
            Ok(())
        } else {
            Err(BundleError::NothingFixed { poses })
        }
    }

    fn check_sightings<O>(
        &self,
        sightings: &[Sighting<O>],
        landmarks: usize,
    ) -> Result<(), BundleError> {
        let poses = self.poses.len();
        let is_off = |of: &Sighting<O>| of.pose >= poses || of.landmark >= landmarks;
        match sightings.iter().position(is_off) {
            None => Ok(()),
            Some(sighting) => {
                let Sighting { pose, landmark, .. } = sightings[sighting];
                Err(BundleError::NoSuchThing { sighting, pose, landmark })
            }
        }
    }
}
