//! How long a ring takes, and the systems of equations alone, beside the dense factorisation: `cargo bench -p pose-graph`.
// A benchmark may stop where it stands, and exports nothing.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Vector3, Vector6};
use pose_graph::blocks::BlockSystem;
use pose_graph::{Edge, GraphConfig, PoseGraph, information, optimise};

/// A matrix whose nodes are tied to those up to this many farther on, as keyframes that follow each other are.
fn banded(nodes: usize, reach: usize) -> (BlockSystem, DMatrix<f64>, DVector<f64>) {
    let pairs = (0..nodes).flat_map(|node| (1..=reach).map(move |step| (node, node + step)));
    let mut blocks = BlockSystem::new(nodes, pairs);
    let mut dense = DMatrix::zeros(6 * nodes, 6 * nodes);
    let diagonal = Matrix6::identity() * (4 * reach) as f64;
    for node in 0..nodes {
        blocks.add(node, node, &diagonal);
        dense.fixed_view_mut::<6, 6>(6 * node, 6 * node).copy_from(&diagonal);
        blocks.add_right(node, &Vector6::repeat(1.0));
        for other in node + 1..(node + reach + 1).min(nodes) {
            blocks.add(node, other, &Matrix6::identity());
            dense.fixed_view_mut::<6, 6>(6 * node, 6 * other).fill_with_identity();
            dense.fixed_view_mut::<6, 6>(6 * other, 6 * node).fill_with_identity();
        }
    }
    (blocks, dense, DVector::repeat(6 * nodes, 1.0))
}

fn ring(nodes: usize) -> PoseGraph {
    let step = Isometry3::rotation(Vector3::z() * std::f64::consts::TAU / nodes as f64)
        * Isometry3::translation(0.3, 0.0, 0.0);
    let mut graph = PoseGraph { is_fixed: vec![true], ..PoseGraph::default() };
    graph.poses.push(Isometry3::identity());
    let information = information(0.02, 0.01);
    for node in 1..nodes {
        let from_to = step * Isometry3::rotation(Vector3::x() * 1e-3);
        graph.poses.push(graph.poses[node - 1] * from_to);
        graph.edges.push(Edge {
            from: node - 1,
            to: node,
            from_to,
            information,
            is_doubtful: false,
        });
    }
    graph.edges.push(Edge {
        from: nodes - 1,
        to: 0,
        from_to: step,
        information,
        is_doubtful: true,
    });
    graph
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("system");
    for (nodes, reach) in [(5, 5), (10, 10), (20, 20), (50, 50), (50, 10), (200, 10)] {
        let (blocks, dense, right) = banded(nodes, reach);
        let name = format!("{nodes} nodes, each tied to {reach}");
        group.bench_function(BenchmarkId::new("blocks", &name), |bench| {
            bench.iter(|| black_box(blocks.solve().unwrap()));
        });
        group.bench_function(BenchmarkId::new("dense", &name), |bench| {
            bench.iter(|| black_box(dense.clone().cholesky().unwrap().solve(&right)));
        });
    }
    group.finish();
    for nodes in [100, 1000] {
        let graph = ring(nodes);
        criterion.bench_function(&format!("ring of {nodes}"), |bench| {
            bench.iter(|| black_box(optimise(&graph, &GraphConfig::default(), &|| false).unwrap()));
        });
    }
}

criterion_group!(all, benches);
criterion_main!(all);
