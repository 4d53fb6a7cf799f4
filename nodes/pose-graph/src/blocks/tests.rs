//! Against the dense solution.

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use super::*;

/// A positive definite system whose pairs are tied, and its dense twin.
fn system(
    nodes: usize,
    pairs: &[(usize, usize)],
    numbers: &mut impl FnMut() -> f64,
) -> (BlockSystem, DMatrix<f64>, DVector<f64>) {
    let mut blocks = BlockSystem::new(nodes, pairs.iter().copied());
    let mut dense = DMatrix::zeros(6 * nodes, 6 * nodes);
    let mut right = DVector::zeros(6 * nodes);
    // Each pair is an error of 6 rows that depends on both nodes.
    for &(one, other) in pairs {
        let jacobians = [(); 2].map(|()| Matrix6::from_fn(|_, _| numbers()));
        for (row, of_row) in [one, other].into_iter().zip(&jacobians) {
            for (column, of_column) in [one, other].into_iter().zip(&jacobians) {
                let block = of_row.transpose() * of_column;
                let mut part = dense.fixed_view_mut::<6, 6>(6 * row, 6 * column);
                part += block;
                // Each block once, in whichever half it is.
                if row == column || (row, column) == (one, other) {
                    blocks.add(row, column, &block);
                }
            }
        }
    }
    for node in 0..nodes {
        let block = Matrix6::identity();
        let mut part = dense.fixed_view_mut::<6, 6>(6 * node, 6 * node);
        part += block;
        blocks.add(node, node, &block);
        let part = Vector6::from_fn(|_, _| numbers());
        right.fixed_rows_mut::<6>(6 * node).copy_from(&part);
        blocks.add_right(node, &part);
    }
    (blocks, dense, right)
}

fn numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut random = estimation::Random::new(seed);
    move || random.between(-1.0, 1.0)
}

proptest! {
    #[test]
    fn the_solution_is_the_dense_one(
        nodes in 1..20_usize, pairs in prop::collection::vec((0..20_usize, 0..20_usize), 0..60),
        seed in any::<u64>(),
    ) {
        let pairs: Vec<_> = pairs
            .into_iter()
            .map(|(one, other)| (one % nodes, other % nodes))
            .filter(|(one, other)| one != other)
            .collect();
        let (blocks, dense, right) = system(nodes, &pairs, &mut numbers(seed));
        let expected = dense.cholesky().unwrap().solve(&right);
        let found = blocks.solve().unwrap();
        for (node, part) in found.iter().enumerate() {
            let expected = expected.fixed_rows::<6>(6 * node).into_owned();
            prop_assert!((part - expected).norm() < 1e-9, "{node}");
        }
    }
}

#[test]
fn a_chain_and_a_ring_leave_few_blocks() {
    let chain = |nodes: usize| (1..nodes).map(|node| (node - 1, node));
    assert_eq!(BlockSystem::new(100, chain(100)).factor_blocks(), 99);
    // Around a ring, and with a chord, each elimination ties two others at most.
    let ring = BlockSystem::new(100, chain(100).chain([(0, 99), (20, 70)]));
    assert!(ring.factor_blocks() < 205, "{}", ring.factor_blocks());
    // A star: the node connected to all is last.
    let star = BlockSystem::new(50, (1..50).map(|node| (0, node)));
    assert_eq!(star.factor_blocks(), 49);
}

#[test]
fn what_is_not_positive_definite_has_no_solution() {
    let mut blocks = BlockSystem::new(2, [(0, 1)]);
    assert!(blocks.solve().is_none());
    blocks.add(0, 0, &Matrix6::identity());
    blocks.add(1, 1, &-Matrix6::identity());
    assert!(blocks.solve().is_none());
    blocks.clear();
    blocks.add(0, 0, &Matrix6::identity());
    blocks.add(1, 1, &Matrix6::identity());
    blocks.add_right(1, &Vector6::repeat(2.0));
    blocks.damp(1.0, 2.0);
    assert_eq!(blocks.largest_diagonal(), 4.0);
    assert_eq!(blocks.solve().unwrap(), [Vector6::zeros(), Vector6::repeat(0.5)]);
    blocks.add(0, 1, &Matrix6::repeat(f64::NAN));
    assert!(blocks.solve().is_none());
    assert_eq!(BlockSystem::new(0, []).solve().unwrap().len(), 0);
}

#[test]
fn ties_to_nodes_that_do_not_exist_are_ignored() {
    let mut blocks = BlockSystem::new(2, [(0, 0), (0, 2), (7, 9)]);
    blocks.add(0, 1, &Matrix6::identity());
    blocks.add(5, 5, &Matrix6::identity());
    blocks.add_right(9, &Vector6::zeros());
    assert_eq!((blocks.nodes(), blocks.factor_blocks(), blocks.largest_diagonal()), (2, 0, 0.0));
}
