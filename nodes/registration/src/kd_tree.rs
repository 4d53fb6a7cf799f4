//! The points of a cloud in an order in which neighbours are found quickly: a balanced k-d tree (Bentley 1975).

mod build;
mod search;
#[cfg(test)]
mod tests;

pub(crate) use search::{MOST_NEIGHBOURS, Neighbours};

/// A leaf has no more points than this. Distances to all of a leaf's points are computed together.
const LEAF_POINTS: usize = 16;

/// A balanced k-d tree over points that it keeps itself, leaf by leaf. A point's number is its place in that order, so
/// that points with neighbouring numbers are mostly neighbours in space.
#[derive(Clone, Debug, Default)]
pub(crate) struct KdTree {
    /// Node `i` has the children `2 i + 1` and `2 i + 2`; all leaves are equally deep, and no node is stored for them.
    splits: Vec<Split>,
    /// Splits above each leaf.
    depth: u32,
    x_m: Vec<f32>,
    y_m: Vec<f32>,
    z_m: Vec<f32>,
}

/// Points of the left child lie at or below it along an axis, those of the right one at or above it.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Split {
    axis: usize,
    at_m: f32,
}

impl KdTree {
    /// How many points it has.
    pub(crate) fn len(&self) -> usize {
        self.x_m.len()
    }

    /// A point by its number.
    #[inline]
    pub(crate) fn point_m(&self, number: usize) -> [f32; 3] {
        [self.x_m[number], self.y_m[number], self.z_m[number]]
    }
}

/// Where the right half of a range of points begins.
#[inline]
fn middle(from: usize, to: usize) -> usize {
    from + (to - from) / 2
}
