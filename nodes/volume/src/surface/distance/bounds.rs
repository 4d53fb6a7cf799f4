//! Boxes with sides along the axes, and how far they are apart.
//!
//! The least and the greatest distance are computed by the same operations in the same order as the distance of two points. Each
//! of these is rounded, and none ever falls when its operands grow: so the bounds hold for the computed distances, too.

/// A box, in metres.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Bounds {
    pub(super) least_m: [f32; 3],
    pub(super) most_m: [f32; 3],
}

/// Of three distances along the axes.
#[inline(always)]
pub(super) fn square_m2([x, y, z]: [f32; 3]) -> f32 {
    x * x + y * y + z * z
}

impl Bounds {
    /// Around nothing.
    pub(super) const EMPTY: Self =
        Self { least_m: [f32::INFINITY; 3], most_m: [f32::NEG_INFINITY; 3] };

    #[inline(always)]
    pub(super) fn of_point(point_m: [f32; 3]) -> Self {
        Self { least_m: point_m, most_m: point_m }
    }

    /// Around both.
    pub(super) fn with(&self, other: &Self) -> Self {
        let axes = [0, 1, 2];
        Self {
            least_m: axes.map(|axis: usize| self.least_m[axis].min(other.least_m[axis])),
            most_m: axes.map(|axis: usize| self.most_m[axis].max(other.most_m[axis])),
        }
    }

    /// The square of the least distance between a point of one and a point of the other.
    #[inline(always)]
    pub(super) fn nearest_m2(&self, other: &Self) -> f32 {
        square_m2([0, 1, 2].map(|axis: usize| {
            (self.least_m[axis] - other.most_m[axis])
                .max(other.least_m[axis] - self.most_m[axis])
                .max(0.0)
        }))
    }

    /// The square of the greatest distance between a point of one and a point of the other.
    #[inline(always)]
    pub(super) fn farthest_m2(&self, other: &Self) -> f32 {
        square_m2([0, 1, 2].map(|axis: usize| {
            (self.most_m[axis] - other.least_m[axis]).max(other.most_m[axis] - self.least_m[axis])
        }))
    }
}
