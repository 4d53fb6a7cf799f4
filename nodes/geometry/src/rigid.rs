//! A rigid transform as the twelve numbers that a point is multiplied with.

use nalgebra::Isometry3;

/// Rotation and translation row by row, in the points' own precision. All clouds are moved by this
/// one function, so that a fused path and a stepwise one agree to the bit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct RigidTransform {
    rows: [[f32; 4]; 3],
}

impl RigidTransform {
    /// The numbers of `target_from_source`.
    pub(crate) fn new(target_from_source: &Isometry3<f64>) -> Self {
        let rotation = target_from_source.rotation.to_rotation_matrix();
        let translation = target_from_source.translation.vector;
        let row = |axis: usize| {
            let r = rotation.matrix().row(axis);
            [r[0] as f32, r[1] as f32, r[2] as f32, translation[axis] as f32]
        };
        Self { rows: [row(0), row(1), row(2)] }
    }

    /// Takes a point of the source frame to the target frame.
    #[inline(always)]
    pub(crate) fn apply(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        self.rows.map(|[rx, ry, rz, t]| rx * x + ry * y + rz * z + t)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;
    use crate::pose_from_vector;

    proptest! {
        #[test]
        fn moves_points_as_the_pose_does(
            vector in proptest::array::uniform6(-3.0..3.0_f64),
            point in proptest::array::uniform3(-8.0..8.0_f32),
        ) {
            let pose = pose_from_vector(&vector);
            let expected = pose * Point3::from(point.map(f64::from));
            let moved = RigidTransform::new(&pose).apply(point).map(f64::from);
            prop_assert!((Point3::from(moved) - expected).norm() < 1e-5);
        }
    }

    #[test]
    fn the_identity_changes_no_bit() {
        let point = [1.234_567_f32, -7.654_321, 3.3e-7];
        assert_eq!(RigidTransform::new(&Isometry3::identity()).apply(point), point);
    }
}
