//! The error of an edge, and its derivatives by the poses of its nodes.
//!
//! A node is corrected in its own frame ([`estimation::perturbation::right`]).

use estimation::perturbation::parts;
use estimation::perturbation::right::perturbation_between;
use estimation::twist::inverse_right_jacobian;
use nalgebra::{Isometry3, Matrix6, Rotation3, Vector6};

use super::Edge;

/// The error of an edge with its derivatives by the corrections of both nodes.
pub(super) struct Linearised {
    pub(super) error: Vector6<f64>,
    pub(super) by_from: Matrix6<f64>,
    pub(super) by_to: Matrix6<f64>,
}

impl Edge {
    /// Where `to` is from where it was measured: a shift and a turn.
    pub(super) fn error(&self, poses: &[Isometry3<f64>]) -> Vector6<f64> {
        perturbation_between(&self.from_to, &(poses[self.from].inverse() * poses[self.to]))
    }

    /// The squared error in standard deviations.
    pub(super) fn chi2(&self, poses: &[Isometry3<f64>]) -> f64 {
        let error = self.error(poses);
        error.dot(&(self.information * error))
    }

    pub(super) fn linearised(&self, poses: &[Isometry3<f64>]) -> Linearised {
        let error = self.error(poses);
        let (_, turn) = parts(&error);
        let apart = poses[self.from].inverse() * poses[self.to];
        let back = self.from_to.rotation.inverse().to_rotation_matrix().into_inner();
        let off = Rotation3::from_scaled_axis(turn).into_inner();
        let by_turn = inverse_right_jacobian(&turn);
        let mut by_to = Matrix6::zeros();
        by_to.fixed_view_mut::<3, 3>(0, 0).copy_from(&off);
        by_to.fixed_view_mut::<3, 3>(3, 3).copy_from(&by_turn);
        let mut by_from = Matrix6::zeros();
        by_from.fixed_view_mut::<3, 3>(0, 0).copy_from(&-back);
        let lever = back * apart.translation.vector.cross_matrix();
        by_from.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
        let apart = apart.rotation.inverse().to_rotation_matrix().into_inner();
        by_from.fixed_view_mut::<3, 3>(3, 3).copy_from(&(-by_turn * apart));
        Linearised { error, by_from, by_to }
    }
}

#[cfg(test)]
mod tests {
    use estimation::perturbation::right::perturbed;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::*;

    fn any_pose() -> impl Strategy<Value = Isometry3<f64>> {
        prop::array::uniform6(-1.7..1.7_f64).prop_map(|[x, y, z, a, b, c]| {
            Isometry3::new(Vector3::new(x, y, z), Vector3::new(a, b, c))
        })
    }

    proptest! {
        #[test]
        fn derivatives_are_those_of_the_error(
            from in any_pose(), to in any_pose(), off in any_pose(), share in 0.0..0.9_f64,
        ) {
            const SMALL: f64 = 1e-6;
            let measured = from.inverse() * to;
            let off = Isometry3::new(share * off.translation.vector, share * off.rotation.scaled_axis());
            let edge = Edge {
                from: 0,
                to: 1,
                from_to: measured * off,
                information: Matrix6::identity(),
                is_doubtful: false,
            };
            let at = edge.linearised(&[from, to]);
            // Half a turn has two logarithms.
            prop_assume!(at.error.fixed_rows::<3>(3).norm() < 3.0);
            for column in 0..6 {
                let moved = |step: f64, node: usize| {
                    let mut correction = Vector6::zeros();
                    correction[column] = step;
                    let mut poses = [from, to];
                    poses[node] = perturbed(&poses[node], &correction);
                    edge.error(&poses)
                };
                for (node, found) in [at.by_from, at.by_to].iter().enumerate() {
                    let slope = (moved(SMALL, node) - moved(-SMALL, node)) / (2.0 * SMALL);
                    let off = (found.column(column) - slope).norm();
                    prop_assert!(off < 1e-6 * (1.0 + slope.norm()), "{} {}: {}", node, column, off);
                }
            }
        }
    }

    #[test]
    fn an_edge_that_was_measured_right_is_off_by_nothing() {
        let poses = [
            Isometry3::new(Vector3::new(1e5, 2.0, 3.0), Vector3::new(0.1, 2.0, 0.4)),
            Isometry3::new(Vector3::new(1e5 + 1.0, 2.0, 4.0), Vector3::new(0.4, -2.0, 1.4)),
        ];
        let from_to = poses[0].inverse() * poses[1];
        let information = Matrix6::identity();
        let edge = Edge { from: 0, to: 1, from_to, information, is_doubtful: false };
        assert!(edge.chi2(&poses) < 1e-18);
    }
}
