//! The motion that odometry measured from one pose to another.
//!
//! A keyframe is one frame of dozens; odometry has seen all of them. Where keyframes share few landmarks, as in a bare
//! corridor, its motion between them is more accurate than their own observations.

use estimation::perturbation::is_rigid;
use estimation::perturbation::left::{adjoint, perturbation_between};
use nalgebra::{Isometry3, Matrix6, Vector6};
use pose_graph::blocks::BlockSystem;

use super::MotionStdDev;
use crate::solve::RobustKernel;

/// A motion between two poses.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Motion {
    /// The pose that it begins at.
    pub from: usize,
    /// The pose that it ends at.
    pub to: usize,
    /// The first camera's pose in the frame of the second.
    pub to_from_from: Isometry3<f64>,
    /// How well it is known.
    pub std_dev: MotionStdDev,
}

impl Motion {
    /// Whether there are this many poses, and all numbers are valid.
    pub(super) fn is_usable(&self, poses: usize) -> bool {
        let Self { from, to, to_from_from, std_dev: MotionStdDev { shift_m, turn_rad } } = self;
        let is_spread = |std_dev: &f64| std_dev.is_finite() && *std_dev > 0.0;
        from != to
            && *from < poses
            && *to < poses
            && is_rigid(to_from_from)
            && is_spread(shift_m)
            && is_spread(turn_rad)
    }

    /// How far the two poses are from it, as a perturbation of the second, in standard deviations.
    fn error(&self, poses: &[Isometry3<f64>]) -> Vector6<f64> {
        let expected = self.to_from_from * poses[self.from];
        perturbation_between(&expected, &poses[self.to]).component_mul(&self.weights())
    }

    fn weights(&self) -> Vector6<f64> {
        let MotionStdDev { shift_m, turn_rad } = self.std_dev;
        let (shift, turn) = (shift_m.recip(), turn_rad.recip());
        Vector6::new(shift, shift, shift, turn, turn, turn)
    }

    /// Its cost.
    pub(super) fn cost(&self, poses: &[Isometry3<f64>], kernel: RobustKernel, gate: f64) -> f64 {
        kernel.loss_and_weight(self.error(poses).norm_squared(), gate).0
    }

    /// Adds its normal equations.
    pub(super) fn linearise(
        &self,
        poses: &[Isometry3<f64>],
        kernel: RobustKernel,
        gate: f64,
        unknowns: &[Option<usize>],
        system: &mut BlockSystem,
    ) {
        let error = self.error(poses);
        let (_, weight) = kernel.loss_and_weight(error.norm_squared(), gate);
        let (by_from, by_to) = self.derivatives(poses);
        let (from, to) = (unknowns[self.from], unknowns[self.to]);
        for (unknown, by) in [(from, &by_from), (to, &by_to)] {
            if let Some(unknown) = unknown {
                system.add(unknown, unknown, &(weight * by.tr_mul(by)));
                system.add_right(unknown, &(-weight * by.tr_mul(&error)));
            }
        }
        if let Some((from, to)) = from.zip(to) {
            system.add(from, to, &(weight * by_from.tr_mul(&by_to)));
        }
    }

    /// The derivatives of the error by perturbations of the two poses, to first order of the error.
    fn derivatives(&self, poses: &[Isometry3<f64>]) -> (Matrix6<f64>, Matrix6<f64>) {
        let weights = Matrix6::from_diagonal(&self.weights());
        let between = poses[self.to] * poses[self.from].inverse();
        (-(weights * adjoint(&between)), weights)
    }
}

#[cfg(test)]
mod tests {
    use estimation::perturbation::left::perturbed;
    use proptest::prelude::*;

    use super::*;
    use crate::solve::testing::any_pose;

    proptest! {
        #[test]
        fn derivatives_are_those_of_the_error(
            from in any_pose(), to in any_pose(), direction in prop::array::uniform6(-1.0..1.0_f64),
            moves_first in any::<bool>(),
        ) {
            const SMALL: f64 = 1e-6;
            let motion = Motion {
                from: 0,
                to: 1,
                to_from_from: to * from.inverse(),
                std_dev: MotionStdDev { shift_m: 0.01, turn_rad: 0.02 },
            };
            let poses = [from, to];
            let direction = Vector6::from(direction);
            let mut moved = poses;
            let at = usize::from(!moves_first);
            moved[at] = perturbed(&poses[at], &(SMALL * direction));
            let slope = (motion.error(&moved) - motion.error(&poses)) / SMALL;
            let (by_from, by_to) = motion.derivatives(&poses);
            let expected = if moves_first { by_from } else { by_to } * direction;
            prop_assert!((slope - expected).norm() < 1e-3 * (1.0 + expected.norm()), "{slope} {expected}");
        }
    }
}
