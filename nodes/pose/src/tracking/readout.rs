//! How long a camera takes to read the rows of an image.
//!
//! Its data sheet says so, if there is one. Observations show it too: were the time wrong, all features that the camera sees while it
//! rotates would be shifted, more so towards the top and the bottom. The time is one number more that the errors of the points
//! depend on; it is estimated beside each pose (by the Schur complement on it), and the estimates are put together.

use geometry::CameraModel;
use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use crate::frame::Twist;
use crate::local_map::{ReadoutDerivative, image_slopes};
use crate::solve::{PointObservation, Verdict};

/// At first the time is taken to be 0, give or take a third of the time between two images.
const PRIOR_STD_DEV_S: f64 = 0.01;
/// Landmarks were seen with the same shift before, and contain much of it: this share of a frame's information is new.
const NEW_SHARE: f64 = 0.05;
/// Longer than that it is something else.
const LONGEST_S: f64 = 0.05;
/// A motion that moves the image by less from its top to its bottom says nothing.
const LEAST_INFORMATION_PER_S2: f64 = 1.0;

/// The estimate of the readout time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Readout {
    /// The time from the first row to the last.
    pub seconds: f64,
    /// One over its variance.
    information_per_s2: f64,
}

/// Points of a frame whose features were taken to the middle row by the time so far.
pub(super) struct SeenMoving<'a> {
    pub(super) camera: &'a CameraModel,
    pub(super) camera_from_map: Isometry3<f64>,
    pub(super) twist: Twist,
    pub(super) points: &'a [PointObservation],
    /// The derivatives of the map's points by the readout time.
    pub(super) readout_derivatives_m_per_s: &'a [Vector3<f64>],
    pub(super) verdicts: &'a [Verdict],
}

impl Readout {
    pub(super) fn new(seconds: f64) -> Self {
        Self { seconds, information_per_s2: PRIOR_STD_DEV_S.powi(-2) }
    }

    /// Its standard deviation.
    #[must_use]
    pub fn std_dev_s(&self) -> f64 {
        self.information_per_s2.sqrt().recip()
    }

    /// Corrects the time by what the points of a frame are off by.
    ///
    /// Returns the derivative of the pose by the readout time, and by how much the time has grown.
    pub(super) fn learn(&mut self, seen: &SeenMoving<'_>) -> (ReadoutDerivative, f64) {
        // The normal equations of the pose's perturbation and of the time.
        let (mut of_pose, mut mixed) = (Matrix6::zeros(), Vector6::zeros());
        let (mut of_time, mut right_of_pose, mut right) = (0.0, Vector6::zeros(), 0.0);
        let SeenMoving { camera, camera_from_map, twist, .. } = seen;
        let mut derivative = ReadoutDerivative { twist: *twist, pose_per_s: Vector6::zeros() };
        let accepted = seen.points.iter().zip(seen.readout_derivatives_m_per_s).zip(seen.verdicts);
        for ((point, readout_derivative_m_per_s), _) in
            accepted.filter(|(_, verdict)| verdict.is_inlier())
        {
            let place_m = camera_from_map * point.point_in_map_m;
            let Some(projected) = camera.project(&place_m) else { continue };
            let weight = point.pixel_std_dev_px.hypot(point.spread_px.norm()).powi(-2);
            let slopes = image_slopes(camera, &place_m);
            let measured = derivative.of_measured(&place_m, point.pixel_px.y, camera);
            let by_time =
                slopes * (measured - camera_from_map.rotation * readout_derivative_m_per_s);
            let off = point.pixel_px - projected;
            for row in 0..2 {
                let slope: Vector3<f64> = slopes.row(row).transpose();
                let about = place_m.coords.cross(&slope);
                let by_pose = -Vector6::new(slope.x, slope.y, slope.z, about.x, about.y, about.z);
                of_pose += weight * by_pose * by_pose.transpose();
                mixed += weight * by_time[row] * by_pose;
                of_time += weight * by_time[row] * by_time[row];
                right_of_pose -= weight * off[row] * by_pose;
                right -= weight * off[row] * by_time[row];
            }
        }
        let Some(cholesky) = of_pose.cholesky() else { return (derivative, 0.0) };
        derivative.pose_per_s = -cholesky.solve(&mixed);
        let information = of_time - mixed.dot(&cholesky.solve(&mixed));
        if information < LEAST_INFORMATION_PER_S2 {
            return (derivative, 0.0);
        }
        let step_s = (right - mixed.dot(&cholesky.solve(&right_of_pose))) / information;
        let new = NEW_SHARE * information;
        self.information_per_s2 += new;
        let gain = new / self.information_per_s2;
        let before_s = self.seconds;
        self.seconds = (before_s + gain * step_s).clamp(0.0, LONGEST_S);
        (derivative, self.seconds - before_s)
    }
}
