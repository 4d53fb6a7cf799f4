//! Smoothed poses.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3 as Vector, Vector4};

/// The mean of the last poses.
#[derive(Clone, Debug)]
pub(super) struct Smoothing {
    poses: VecDeque<Isometry3<f64>>,
    length: usize,
}

impl Smoothing {
    pub(super) fn new(length: usize) -> Self {
        Self { poses: VecDeque::new(), length: length.max(1) }
    }

    pub(super) fn clear(&mut self) {
        self.poses.clear();
    }

    pub(super) fn smoothed(&mut self, pose: Isometry3<f64>) -> Isometry3<f64> {
        self.poses.push_back(pose);
        while self.poses.len() > self.length {
            self.poses.pop_front();
        }
        if self.poses.len() == 1 {
            return pose;
        }
        let count = self.poses.len() as f64;
        let shift = self.poses.iter().map(|pose| pose.translation.vector).sum::<Vector<f64>>();
        // Of rotations that are near each other the normalised sum of the quaternions is the mean, in one hemisphere.
        let reference = pose.rotation.coords;
        let sum: Vector4<f64> = self
            .poses
            .iter()
            .map(|pose| pose.rotation.coords * reference.dot(&pose.rotation.coords).signum())
            .sum();
        let rotation = UnitQuaternion::from_quaternion(Quaternion::from_vector(sum));
        Isometry3::from_parts(Translation3::from(shift / count), rotation)
    }
}

#[cfg(test)]
mod tests {
    use estimation::perturbation::left::perturbation_between;

    use super::*;

    #[test]
    fn the_mean_of_poses_lies_between_them() {
        let mut smoothing = Smoothing::new(2);
        let pose = |x: f64, yaw: f64| Isometry3::new(Vector::x() * x, Vector::z() * yaw);
        assert_eq!(smoothing.smoothed(pose(0.0, 0.1)), pose(0.0, 0.1));
        let mean = smoothing.smoothed(pose(0.2, 0.3));
        assert!(perturbation_between(&mean, &pose(0.1, 0.2)).norm() < 1e-9);
        let later = smoothing.smoothed(pose(0.4, 0.5));
        assert!(perturbation_between(&later, &pose(0.3, 0.4)).norm() < 1e-9);
    }
}
