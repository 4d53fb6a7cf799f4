//! Poses: the thesis' six numbers, and interpolation in time.

mod buffer;
#[cfg(test)]
mod tests;

use estimation::perturbation::is_rotation;
use nalgebra::{Isometry3, Matrix4, Translation3, UnitQuaternion};

use crate::Stamp;

pub use buffer::{PoseBuffer, PoseLookupError, PosePushError};

/// A pose of the rig at a moment.
#[derive(Clone, PartialEq, Debug)]
pub struct StampedPose {
    /// When.
    pub stamp: Stamp,
    /// The frame that `map_from_rig` leads to.
    pub frame_id: String,
    /// Takes a point of the rig frame to the map frame.
    pub map_from_rig: Isometry3<f64>,
}

/// No pose may be farther from the origin of its frame: there the single precision of clouds still steps
/// by 8 mm, a tenth of the thesis' voxel; at the coordinates of a map grid (UTM) it would step by half a
/// metre and collapse the cloud.
pub const FARTHEST_POSE_M: f64 = 1e5;

/// A pose cannot carry a cloud.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum UnusablePose {
    /// A number of it is not finite.
    #[error("the pose has a number that is not finite: its source has lost its track")]
    NotFinite,
    /// Its quaternion is no rotation: its source sends zeros, or has not normalised it.
    #[error("the pose has a quaternion of length {length}, where that of a rotation is 1")]
    NotARotation {
        /// The length.
        length: f64,
    },
    /// It lies beyond [`FARTHEST_POSE_M`].
    #[error(
        "the pose lies {distance_m:.0} m from the origin of its frame, and {FARTHEST_POSE_M} m is the most: \
         use a frame with an origin near by"
    )]
    TooFar {
        /// The distance from the origin.
        distance_m: f64,
    },
}

/// Whether clouds can be taken to the frame that a pose leads to.
///
/// # Errors
/// When the pose has a number that is not finite, its quaternion is no rotation, or it lies too far from the origin.
pub fn check_pose(pose: &Isometry3<f64>) -> Result<(), UnusablePose> {
    let Isometry3 { translation, rotation } = pose;
    let mut numbers = translation.vector.iter().chain(rotation.coords.iter());
    if !numbers.all(|number| number.is_finite()) {
        return Err(UnusablePose::NotFinite);
    }
    if !is_rotation(rotation) {
        return Err(UnusablePose::NotARotation { length: rotation.coords.norm() });
    }
    let distance_m = translation.vector.norm();
    if distance_m > FARTHEST_POSE_M {
        return Err(UnusablePose::TooFar { distance_m });
    }
    Ok(())
}

/// The pose of the thesis' vector Vt_k = (Px, Py, Pz, phi, beta, gamma) (Rec-HV 3.2.7): metres, then
/// the angles of the matrix Rz(phi) * Ry(beta) * Rx(gamma) in radians. So phi is the yaw, beta the
/// pitch and gamma the roll, as the printed matrix has it; the glossary swaps phi and gamma.
#[must_use]
pub fn pose_from_vector(vector: &[f64; 6]) -> Isometry3<f64> {
    let [x_m, y_m, z_m, phi_rad, beta_rad, gamma_rad] = *vector;
    Isometry3::from_parts(
        Translation3::new(x_m, y_m, z_m),
        UnitQuaternion::from_euler_angles(gamma_rad, beta_rad, phi_rad),
    )
}

/// The thesis' vector Vt_k of a pose; see [`pose_from_vector`]. phi and gamma lie in `[-pi, pi]`, beta
/// in `[-pi/2, pi/2]`; at its ends only the sum or difference of phi and gamma is determined.
#[must_use]
pub fn pose_vector(pose: &Isometry3<f64>) -> [f64; 6] {
    let (gamma_rad, beta_rad, phi_rad) = pose.rotation.euler_angles();
    let [x_m, y_m, z_m] = pose.translation.vector.into();
    [x_m, y_m, z_m, phi_rad, beta_rad, gamma_rad]
}

/// The homogeneous matrix Mt_k of eq. 8, written out as printed but for the slip of sign in row 1,
/// column 2. The suite computes with [`pose_from_vector`]; this is the plain twin that tests compare.
#[must_use]
pub fn homogeneous_from_pose_vector(vector: &[f64; 6]) -> Matrix4<f64> {
    let [x_m, y_m, z_m, phi, beta, gamma] = *vector;
    let ((sp, cp), (sb, cb), (sg, cg)) = (phi.sin_cos(), beta.sin_cos(), gamma.sin_cos());
    Matrix4::new(
        cp * cb,
        cp * sb * sg - sp * cg,
        cp * sb * cg + sp * sg,
        x_m, //
        sp * cb,
        sp * sb * sg + cp * cg,
        sp * sb * cg - cp * sg,
        y_m, //
        -sb,
        cb * sg,
        cb * cg,
        z_m, //
        0.0,
        0.0,
        0.0,
        1.0,
    )
}
