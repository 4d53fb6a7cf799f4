//! Trajectories for tests.

use geometry::Stamp;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::path::{RawPose, Trajectory};

/// A pose of a source.
pub(super) fn raw(pose: &Isometry3<f64>) -> RawPose {
    let numbers = pose.rotation.quaternion();
    RawPose {
        position_m: pose.translation.vector.into(),
        quaternion_xyzw: [numbers.i, numbers.j, numbers.k, numbers.w],
    }
}

/// Poses at ten a second, the first at 100 s.
pub(super) fn stamped(poses: &[Isometry3<f64>]) -> Trajectory {
    let stamp = |index: usize| Stamp::from_nanos(100_000_000_000 + index as i64 * 100_000_000);
    Trajectory::stamped(poses.iter().enumerate().map(|(index, pose)| (stamp(index), raw(pose))))
}

/// A pose from its position and rotation vector.
pub(super) fn pose(place_m: [f64; 3], turn_rad: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::from(Vector3::from(place_m)),
        UnitQuaternion::from_scaled_axis(Vector3::from(turn_rad)),
    )
}

/// A path that leaves every plane and rotates about all axes.
pub(super) fn walk(poses: usize) -> Vec<Isometry3<f64>> {
    let at = |index: usize| {
        let t = index as f64 * 0.1;
        pose(
            [2.0 * t.cos(), 1.5 * (1.3 * t).sin(), 0.4 * (0.7 * t).sin()],
            [0.2 * (0.5 * t).sin(), 0.1 * t.cos(), 0.9 * t],
        )
    };
    (0..poses).map(at).collect()
}
