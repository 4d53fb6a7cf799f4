//! The landmarks are eliminated, and found again from the poses.
//!
//! A landmark is tied to poses only, never to another landmark: its block of the normal equations is inverted by itself,
//! and what is left ties all poses that see it (the Schur complement; Triggs et al. 2000, "Bundle adjustment: a modern
//! synthesis", section 6.1).

use nalgebra::{SMatrix, SVector, Vector6};
use pose_graph::blocks::BlockSystem;

use super::landmark::Chart;
use super::problem::Linearised;

/// An unobserved direction of a landmark is held by this share of its information, times the damping.
const LEAST_SHARE: f64 = 1e-9;

impl<const N: usize, C: Chart<N>> Linearised<N, C> {
    /// Takes the landmarks out of the system. Returns the inverse of each one's block.
    pub(super) fn eliminate(
        &self,
        damping: f64,
        system: &mut BlockSystem,
    ) -> Vec<Option<SMatrix<f64, N, N>>> {
        let mut begin = 0;
        let eliminate = |normal: &super::problem::Normal<N>| {
            let ties = &self.ties[begin..normal.ties_end];
            begin = normal.ties_end;
            let mut damped = normal.own;
            let least = LEAST_SHARE * normal.own.trace();
            for axis in 0..N {
                damped[(axis, axis)] += damping * (damped[(axis, axis)] + least);
            }
            let inverse = damped.cholesky()?.inverse();
            for (index, (pose, tie)) in ties.iter().enumerate() {
                let through = tie * inverse;
                system.add_right(*pose, &-(through * normal.pull));
                system.add(*pose, *pose, &-(through * tie.transpose()));
                for (other, other_tie) in &ties[index + 1..] {
                    let block = -(through * other_tie.transpose());
                    system.add(*pose, *other, &block);
                    if pose == other {
                        system.add(*pose, *pose, &block.transpose());
                    }
                }
            }
            Some(inverse)
        };
        self.normals.iter().map(eliminate).collect()
    }

    /// The landmarks after the poses have been corrected so.
    pub(super) fn corrected(
        &self,
        before: &[C::Place],
        inverses: &[Option<SMatrix<f64, N, N>>],
        poses: &[Vector6<f64>],
    ) -> Vec<C::Place>
    where
        C::Place: Copy,
    {
        let mut begin = 0;
        let all = self.normals.iter().zip(inverses).zip(self.charts.iter().zip(before));
        let corrected = all.map(|((normal, inverse), (chart, before))| {
            let ties = &self.ties[begin..normal.ties_end];
            begin = normal.ties_end;
            let mut pull: SVector<f64, N> = normal.pull;
            for (pose, tie) in ties {
                if let Some(step) = poses.get(*pose) {
                    pull -= tie.tr_mul(step);
                }
            }
            let there = inverse.zip(chart.as_ref());
            there.and_then(|(inverse, chart)| chart.corrected(&(inverse * pull))).unwrap_or(*before)
        });
        corrected.collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector, Matrix6, Point3, Vector3};
    use proptest::prelude::*;

    use super::super::landmark::PointChart;
    use super::super::problem::Normal;
    use super::*;
    use crate::solve::testing::Random;

    const POSES: usize = 4;

    proptest! {
        #[test]
        fn what_is_eliminated_and_found_again_is_the_dense_solution(
            seed in any::<u64>(), landmarks in 1..12_usize, damping in 0.0..1.0_f64,
        ) {
            let mut random = Random::new(seed);
            let size = 6 * POSES + 3 * landmarks;
            let (mut dense, mut right) = (DMatrix::<f64>::zeros(size, size), DVector::<f64>::zeros(size));
            let pairs = (0..POSES).flat_map(|one| (0..one).map(move |other| (other, one)));
            let mut system = BlockSystem::new(POSES, pairs);
            let mut all = Linearised::<3, PointChart> {
                normals: Vec::new(), charts: Vec::new(), ties: Vec::new(),
            };
            let places = vec![Point3::origin(); landmarks];
            for pose in 0..POSES {
                let prior = Matrix6::identity();
                system.add(pose, pose, &prior);
                dense.view_mut((6 * pose, 6 * pose), (6, 6)).copy_from(&prior);
            }
            for landmark in 0..landmarks {
                let at = 6 * POSES + 3 * landmark;
                let (mut own, mut pull) = (nalgebra::Matrix3::zeros(), Vector3::zeros());
                for pose in 0..POSES {
                    if random.between(0.0, 1.0) < 0.3 { continue; }
                    // Three errors that depend on both.
                    let by_pose = SMatrix::<f64, 3, 6>::from_fn(|_, _| random.normal());
                    let by_landmark = SMatrix::<f64, 3, 3>::from_fn(|_, _| random.normal());
                    let error = Vector3::from_fn(|_, _| random.normal());
                    let mut whole = DMatrix::zeros(3, size);
                    whole.view_mut((0, 6 * pose), (3, 6)).copy_from(&by_pose);
                    whole.view_mut((0, at), (3, 3)).copy_from(&by_landmark);
                    dense += whole.transpose() * &whole;
                    right -= whole.transpose() * error;
                    system.add(pose, pose, &(by_pose.transpose() * by_pose));
                    system.add_right(pose, &-(by_pose.transpose() * error));
                    own += by_landmark.transpose() * by_landmark;
                    pull -= by_landmark.transpose() * error;
                    all.ties.push((pose, by_pose.transpose() * by_landmark));
                }
                all.normals.push(Normal { own, pull, ties_end: all.ties.len() });
                all.charts.push(PointChart::new(&Point3::origin()));
            }
            // As damped as the others are.
            for landmark in 0..landmarks {
                let least = LEAST_SHARE * all.normals[landmark].own.trace();
                for axis in 0..3 {
                    let at = 6 * POSES + 3 * landmark + axis;
                    dense[(at, at)] += damping * (dense[(at, at)] + least);
                }
            }
            system.damp(damping, 0.0);
            for at in 0..6 * POSES {
                dense[(at, at)] *= 1.0 + damping;
            }
            prop_assume!(all.normals.iter().all(|normal| normal.own.determinant() > 1e-3));
            let expected = dense.cholesky().unwrap().solve(&right);
            let inverses = all.eliminate(damping, &mut system);
            let steps = system.solve().unwrap();
            let found = all.corrected(&places, &inverses, &steps);
            for (pose, step) in steps.iter().enumerate() {
                let expected = expected.rows(6 * pose, 6);
                prop_assert!((step - expected).norm() < 1e-7 * (1.0 + expected.norm()));
            }
            for (landmark, place) in found.iter().enumerate() {
                let expected = expected.rows(6 * POSES + 3 * landmark, 3);
                prop_assert!((place.coords - expected).norm() < 1e-7 * (1.0 + expected.norm()));
            }
        }
    }
}
