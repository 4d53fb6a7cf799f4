//! How the tree is made.

use std::num::NonZeroUsize;

use nalgebra::Point3;

use super::{KdTree, LEAF_POINTS, Split, middle};

/// Halves are given to another thread only while they hold at least so many points.
const LEAST_SHARED: usize = 2048;

impl KdTree {
    /// The tree of points whose coordinates are finite. The same points in the same order make the same tree, whatever
    /// the number of threads.
    pub(crate) fn new(points_m: &[Point3<f32>], threads: NonZeroUsize) -> Self {
        let mut points_m: Vec<[f32; 3]> =
            points_m.iter().map(|point| point.coords.into()).collect();
        let depth = points_m.len().div_ceil(LEAF_POINTS).next_power_of_two().trailing_zeros();
        let splits = subtree(&mut points_m, depth, threads.get());
        let along = |axis: usize| points_m.iter().map(|point| point[axis]).collect();
        Self { splits, depth, x_m: along(0), y_m: along(1), z_m: along(2) }
    }
}

/// Puts the points in the order of the leaves. The splits of the subtree, level by level.
fn subtree(points_m: &mut [[f32; 3]], depth: u32, threads: usize) -> Vec<Split> {
    if depth == 0 {
        return Vec::new();
    }
    let axis = widest_axis(points_m);
    let middle = middle(0, points_m.len());
    let (_, at, _) = points_m.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    let split = Split { axis, at_m: at[axis] };
    let (left, right) = points_m.split_at_mut(middle);
    let (left, right) = if threads > 1 && left.len() >= LEAST_SHARED {
        std::thread::scope(|scope| {
            let other = scope.spawn(|| subtree(right, depth - 1, threads / 2));
            let own = subtree(left, depth - 1, threads - threads / 2);
            (own, other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        })
    } else {
        (subtree(left, depth - 1, 1), subtree(right, depth - 1, 1))
    };
    let mut splits = Vec::with_capacity(2 * left.len() + 1);
    splits.push(split);
    for level in 0..depth - 1 {
        // Above a level there are so many nodes as it has, but for one.
        let nodes = 1 << level;
        splits.extend_from_slice(&left[nodes - 1..2 * nodes - 1]);
        splits.extend_from_slice(&right[nodes - 1..2 * nodes - 1]);
    }
    splits
}

/// The axis along which the points extend most.
fn widest_axis(points_m: &[[f32; 3]]) -> usize {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for point in points_m {
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }
    let extent = |axis: usize| high[axis] - low[axis];
    if extent(0) >= extent(1) && extent(0) >= extent(2) {
        0
    } else if extent(1) >= extent(2) {
        1
    } else {
        2
    }
}
