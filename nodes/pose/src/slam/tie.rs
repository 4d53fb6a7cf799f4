//! The filter of the tie between the odometry's frame and the map.
//!
//! Odometry is smooth and drifts; the map does not drift, but the pose of a single frame in it is noisy. The tie between the two
//! frames is filtered (Kalman): its covariance grows with the distance that the camera travels, and each frame that is localised in the map draws it
//! back according to both covariances.

use estimation::perturbation::left::{adjoint, perturbation_between, perturbed};
use estimation::perturbation::parts;
use nalgebra::{Isometry3, Matrix6};

use super::LocaliserConfig;
use crate::solve::PoseEstimate;

/// The covariance of the tie.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tie {
    /// The camera in the map at the last frame, and the covariance of its perturbation; `None` while nothing is known.
    known: Option<(Isometry3<f64>, Matrix6<f64>)>,
}

impl Tie {
    /// The camera has gone on by odometry: this is where the tie has it.
    pub(super) fn predict(&mut self, camera_from_map: &Isometry3<f64>, config: &LocaliserConfig) {
        let Some((before, covariance)) = self.known else { return };
        let motion = camera_from_map * before.inverse();
        let (shift, turn) = parts(&perturbation_between(&before, camera_from_map));
        // What is a metre away shifts as much by a turn: one number for metres and for radians.
        let drift = config.drift_share * shift.norm() + config.drift_per_rad * turn.norm();
        let drift = Matrix6::from_diagonal_element(drift.powi(2));
        let carry = adjoint(&motion);
        self.known = Some((*camera_from_map, carry * covariance * carry.transpose() + drift));
    }

    /// Where the camera is, by the tie and by what a frame says.
    pub(super) fn fused(
        &mut self,
        guess: &Isometry3<f64>,
        located: &PoseEstimate,
        config: &LocaliserConfig,
    ) -> Isometry3<f64> {
        let said = config.alike_frames.max(1.0) * located.covariance;
        let Some((_, covariance)) = self.known else {
            self.known = Some((located.camera_from_map, said));
            return located.camera_from_map;
        };
        let Some(sum) = (covariance + said).cholesky() else { return located.camera_from_map };
        // Of two that are as symmetric as this, the gain's transpose is what the solver gives.
        let gain = sum.solve(&covariance).transpose();
        let off = perturbation_between(guess, &located.camera_from_map);
        let fused = perturbed(guess, &(gain * off));
        let left = (Matrix6::identity() - gain) * covariance;
        self.known = Some((fused, 0.5 * (left + left.transpose())));
        fused
    }
}
