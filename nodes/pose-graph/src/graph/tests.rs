//! Rings that have drifted, with one closure, and with others that are wrong.

use estimation::Random;
use nalgebra::{Isometry3, Matrix6, Vector3};

use super::*;
use crate::graph::optimise;

/// A motion with errors of its own frame.
fn noisy(
    random: &mut Random,
    motion: &Isometry3<f64>,
    std_dev_m: f64,
    std_dev_rad: f64,
) -> Isometry3<f64> {
    let shift = Vector3::from_fn(|_, _| std_dev_m * random.normal());
    let turn = Vector3::from_fn(|_, _| std_dev_rad * random.normal());
    motion * Isometry3::new(shift, turn)
}

const STEP_STD_DEV_M: f64 = 0.02;
const STEP_STD_DEV_RAD: f64 = 0.01;
const LOOP_STD_DEV_M: f64 = 0.01;
const LOOP_STD_DEV_RAD: f64 = 0.005;

/// A ring of this many nodes with a radius of 10 m, its poses as odometry has them, and the truth.
fn ring(nodes: usize, seed: u64) -> (PoseGraph, Vec<Isometry3<f64>>) {
    let truth: Vec<Isometry3<f64>> = (0..nodes)
        .map(|node| {
            let angle = std::f64::consts::TAU * node as f64 / nodes as f64;
            Isometry3::rotation(Vector3::z() * angle) * Isometry3::translation(10.0, 0.0, 0.0)
        })
        .collect();
    let mut random = Random::new(seed);
    let mut graph = PoseGraph { is_fixed: vec![true], ..PoseGraph::default() };
    graph.poses.push(truth[0]);
    for node in 1..nodes {
        let step = truth[node - 1].inverse() * truth[node];
        let from_to = noisy(&mut random, &step, STEP_STD_DEV_M, STEP_STD_DEV_RAD);
        graph.poses.push(graph.poses[node - 1] * from_to);
        let information = information(STEP_STD_DEV_M, STEP_STD_DEV_RAD);
        graph.edges.push(Edge {
            from: node - 1,
            to: node,
            from_to,
            information,
            is_doubtful: false,
        });
    }
    let closure = truth[nodes - 1].inverse() * truth[0];
    let from_to = noisy(&mut random, &closure, LOOP_STD_DEV_M, LOOP_STD_DEV_RAD);
    graph.edges.push(loop_edge(nodes - 1, 0, from_to));
    (graph, truth)
}

fn loop_edge(from: usize, to: usize, from_to: Isometry3<f64>) -> Edge {
    let information = information(LOOP_STD_DEV_M, LOOP_STD_DEV_RAD);
    Edge { from, to, from_to, information, is_doubtful: true }
}

fn rms_m(poses: &[Isometry3<f64>], truth: &[Isometry3<f64>]) -> f64 {
    let off = |(pose, truth): (&Isometry3<f64>, &Isometry3<f64>)| {
        (pose.translation.vector - truth.translation.vector).norm_squared()
    };
    (poses.iter().zip(truth).map(off).sum::<f64>() / truth.len() as f64).sqrt()
}

fn optimised(graph: &PoseGraph) -> OptimisedGraph {
    optimise(graph, &GraphConfig::default(), &|| false).unwrap()
}

/// Regression: it was optimised, to nodes 30 km away.
#[test]
fn an_edge_that_pushes_its_nodes_away_is_refused() {
    let edge = Edge {
        from: 0,
        to: 1,
        from_to: Isometry3::identity(),
        information: -Matrix6::identity(),
        is_doubtful: false,
    };
    let graph = PoseGraph {
        poses: vec![Isometry3::identity(); 2],
        is_fixed: vec![true, false],
        edges: vec![edge],
    };
    let refused = optimise(&graph, &GraphConfig::default(), &|| false).unwrap_err();
    assert_eq!(refused, GraphError::Information { edge: 0, value: -1.0 });
}

#[test]
fn a_ring_that_has_drifted_is_closed() {
    let (mut before, mut after, mut gaps) = (0.0, 0.0, 0.0_f64);
    for seed in 0..10 {
        let (graph, truth) = ring(100, seed);
        let found = optimised(&graph);
        assert!(found.edges.iter().all(|edge| edge.is_used) && !found.was_aborted);
        assert!(found.chi2 < found.chi2_before && found.chi2 < 60.0, "{}", found.chi2);
        before += rms_m(&graph.poses, &truth);
        after += rms_m(&found.poses, &truth);
        let gap = graph.edges[99].error(&found.poses);
        gaps = gaps.max(gap.fixed_rows::<3>(0).norm());
    }
    println!(
        "10 rings of 63 m: {:.3} m before, {:.3} m after, gaps {gaps:.3} m",
        before / 10.0,
        after / 10.0
    );
    assert!(after < 0.5 * before, "{before} {after}");
    assert!(gaps < 3.0 * LOOP_STD_DEV_M);
}

#[test]
fn without_noise_the_truth_is_found_from_anywhere_near() {
    let (mut graph, truth) = ring(40, 3);
    for edge in &mut graph.edges {
        edge.from_to = truth[edge.from].inverse() * truth[edge.to];
    }
    let found = optimised(&graph);
    assert!(rms_m(&found.poses, &truth) < 1e-6 && found.chi2 < 1e-6, "{}", found.chi2);
    // What is fixed stays, to the bit.
    assert_eq!(found.poses[0], graph.poses[0]);
}

#[test]
fn wrong_closures_are_found_out() {
    for seed in 0..10 {
        let (right, truth) = ring(100, seed);
        let closed = rms_m(&optimised(&right).poses, &truth);
        let mut graph = right.clone();
        // As many wrong as right, and twice as many.
        graph.edges.push(loop_edge(20, 70, Isometry3::translation(0.3, 0.0, 0.0)));
        graph.edges.push(loop_edge(5, 50, Isometry3::rotation(Vector3::new(0.0, 0.3, 1.0))));
        let found = optimised(&graph);
        let used: Vec<bool> = found.edges[99..].iter().map(|edge| edge.is_used).collect();
        assert_eq!(used, [true, false, false], "{seed}");
        assert!(found.edges[100].chi2 > 1e3 && found.edges[101].chi2 > 1e3);
        assert!((rms_m(&found.poses, &truth) - closed).abs() < 1e-3);
    }
}

#[test]
fn a_closure_is_not_charged_with_what_other_edges_contradict() {
    let (mut graph, _) = ring(40, 6);
    // A second measurement of a step, ten standard deviations from the first: chi2 50 at the best pose.
    let mut again = graph.edges[3];
    again.from_to.translation.vector.x += 10.0 * STEP_STD_DEV_M;
    graph.edges.push(again);
    let found = optimised(&graph);
    assert!(found.chi2 > 40.0 && found.chi2 > GraphConfig::default().max_rise_chi2);
    assert!(found.edges[39].is_used);
}

#[test]
fn a_closure_over_a_large_drift_is_right_when_the_drift_is_as_stated() {
    // Metres of drift: ten times the noise, and the edges say so.
    let (mut graph, truth) = ring(100, 5);
    let mut random = Random::new(7);
    for node in 1..100 {
        let step = truth[node - 1].inverse() * truth[node];
        graph.edges[node - 1].from_to = noisy(&mut random, &step, 0.05, 0.05);
        graph.edges[node - 1].information = information(0.05, 0.05);
        graph.poses[node] = graph.poses[node - 1] * graph.edges[node - 1].from_to;
    }
    let before = rms_m(&graph.poses, &truth);
    let found = optimised(&graph);
    assert!(found.edges[99].is_used);
    assert!(rms_m(&found.poses, &truth) < 0.5 * before, "{before}");
}

#[test]
fn one_that_is_stopped_is_no_worse_than_before() {
    let (graph, _) = ring(100, 1);
    let config = GraphConfig::default();
    let stopped = optimise(&graph, &config, &|| true).unwrap();
    assert!(stopped.was_aborted && stopped.poses == graph.poses);
    let asked = std::cell::Cell::new(0);
    let later = optimise(&graph, &config, &|| asked.replace(asked.get() + 1) >= 2).unwrap();
    assert!(later.was_aborted && later.chi2 < later.chi2_before && later.iterations == 2);
}

#[test]
fn the_same_graph_gives_the_same_result_to_the_bit() {
    let (graph, _) = ring(60, 2);
    assert_eq!(optimised(&graph), optimised(&graph));
}

#[test]
fn nodes_that_nothing_ties_stay_and_nonsense_is_named() {
    let (mut graph, _) = ring(10, 1);
    graph.poses.push(Isometry3::translation(7.0, 7.0, 7.0));
    let found = optimised(&graph);
    assert_eq!(found.poses[10], graph.poses[10]);
    let refused = |spoil: &dyn Fn(&mut PoseGraph)| {
        let mut spoilt = graph.clone();
        spoil(&mut spoilt);
        optimise(&spoilt, &GraphConfig::default(), &|| false).unwrap_err().to_string()
    };
    assert_eq!(refused(&|graph| graph.is_fixed[0] = false), "none of 11 nodes is fixed");
    assert_eq!(
        refused(&|graph| graph.edges[2].to = 2),
        "edge 2 ties node 2 to 2: there are 11 nodes"
    );
    assert_eq!(
        refused(&|graph| graph.edges[3].from = 90),
        "edge 3 ties node 90 to 4: there are 11 nodes"
    );
    assert_eq!(
        refused(&|graph| graph.poses[4].translation.vector.x = f64::NAN),
        "node 4 has a number that is not finite"
    );
    assert_eq!(
        refused(&|graph| graph.edges[4].information[(0, 0)] = f64::INFINITY),
        "edge 4 has a number that is not finite"
    );
    let nothing = optimised(&PoseGraph::default());
    assert!(nothing.poses.is_empty() && nothing.chi2 == 0.0);
}
