//! How the tree is made.

use estimation::Executor;
use estimation::executor::for_each;
use nalgebra::Point3;

use super::{KdTree, LEAF_POINTS, Split, middle};

/// A half is worth a thread of its own when it holds this many points.
const LEAST_SHARED: usize = 2048;

impl KdTree {
    /// The tree of points whose coordinates are finite. The same points in the same order make the same tree, whatever
    /// the number of threads.
    pub(crate) fn new(points_m: &[Point3<f32>], executor: &dyn Executor) -> Self {
        let mut points_m: Vec<[f32; 3]> =
            points_m.iter().map(|point| point.coords.into()).collect();
        let depth = points_m.len().div_ceil(LEAF_POINTS).next_power_of_two().trailing_zeros();
        // The upper levels, until there is a part for each thread.
        let mut parts = vec![Part { points_m: &mut points_m, splits: Vec::new() }];
        let (mut splits, mut below) = (Vec::new(), depth);
        while below > 0 && parts.len() < executor.threads().get() && is_worth_sharing(&parts) {
            for_each(executor, &mut parts, |part| part.splits = vec![split(part.points_m)]);
            splits.extend(parts.iter().flat_map(|part| &part.splits));
            parts = parts.into_iter().flat_map(Part::halves).collect();
            below -= 1;
        }
        for_each(executor, &mut parts, |part| part.splits = subtree(part.points_m, below));
        // Level by level, those of each part after those of the part before.
        for level in 0..below {
            let nodes = (1 << level) - 1..(2 << level) - 1;
            splits.extend(parts.iter().flat_map(|part| &part.splits[nodes.clone()]));
        }
        let along = |axis: usize| points_m.iter().map(|point| point[axis]).collect();
        Self { splits, depth, x_m: along(0), y_m: along(1), z_m: along(2) }
    }
}

/// Points of one node of the tree, and the splits that were found for it.
struct Part<'a> {
    points_m: &'a mut [[f32; 3]],
    splits: Vec<Split>,
}

impl Part<'_> {
    /// The points of both children.
    fn halves(self) -> [Self; 2] {
        let (left, right) = self.points_m.split_at_mut(middle(0, self.points_m.len()));
        [left, right].map(|points_m| Self { points_m, splits: Vec::new() })
    }
}

fn is_worth_sharing(parts: &[Part<'_>]) -> bool {
    parts.iter().all(|part| part.points_m.len() >= 2 * LEAST_SHARED)
}

/// Puts points to either side of their median along the axis along which they extend most.
fn split(points_m: &mut [[f32; 3]]) -> Split {
    let axis = widest_axis(points_m);
    let middle = middle(0, points_m.len());
    let (_, at, _) = points_m.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    Split { axis, at_m: at[axis] }
}

/// Puts the points in the order of the leaves. The splits of the subtree, level by level.
fn subtree(points_m: &mut [[f32; 3]], depth: u32) -> Vec<Split> {
    if depth == 0 {
        return Vec::new();
    }
    let first = split(points_m);
    let (left, right) = points_m.split_at_mut(middle(0, points_m.len()));
    let (left, right) = (subtree(left, depth - 1), subtree(right, depth - 1));
    let mut splits = Vec::with_capacity(2 * left.len() + 1);
    splits.push(first);
    for level in 0..depth - 1 {
        let nodes = (1 << level) - 1..(2 << level) - 1;
        splits.extend_from_slice(&left[nodes.clone()]);
        splits.extend_from_slice(&right[nodes]);
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
