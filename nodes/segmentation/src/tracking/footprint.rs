//! What is visible of an object, from above: how long and how thick it is, and where its ends are.

use nalgebra::{Matrix2, Point2, Point3, Vector2};

/// The voxels of a plane lie within this of it (0.006 to 0.024 m were measured of a door's leaf at 4 m); the front of a body is
/// 0.04 to 0.15 m thick.
const FLAT_M: f64 = 0.03;
/// A sliver of a body at the border of the image is flat, and narrower; so is an arm, and no leaf of a cupboard.
const LEAST_LENGTH_M: f64 = 0.4;
/// An arm that is held out is flat, and lower.
const LEAST_HEIGHT_M: f64 = 0.5;

/// The line from above that fits best what is visible of an object.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Footprint {
    /// The ends of the line, in the map.
    pub(super) ends_m: [Point2<f64>; 2],
    /// The standard deviation across it.
    thickness_m: f64,
    height_m: f64,
}

impl Footprint {
    /// Of the points of an object in the map; `None` without any.
    pub(super) fn of(points_m: &[&Point3<f64>]) -> Option<Self> {
        let first = points_m.first()?;
        let count = points_m.len() as f64;
        let sum_m: Vector2<f64> = points_m.iter().map(|point| point.xy().coords).sum();
        let mean_m = Point2::from(sum_m / count);
        let offsets_m = || points_m.iter().map(|point| point.xy() - mean_m);
        let spread_m2: Matrix2<f64> = offsets_m().map(|offset| offset * offset.transpose()).sum();
        let eigen = (spread_m2 / count).symmetric_eigen();
        let longer = eigen.eigenvalues.imax();
        let along = Vector2::from(eigen.eigenvectors.column(longer));
        let (mut least_m, mut most_m) = (0.0_f64, 0.0_f64);
        for offset_m in offsets_m() {
            let at_m = along.dot(&offset_m);
            (least_m, most_m) = (least_m.min(at_m), most_m.max(at_m));
        }
        let (lowest_m, highest_m) = points_m
            .iter()
            .fold((first.z, first.z), |(low, high), point| (low.min(point.z), high.max(point.z)));
        Some(Self {
            ends_m: [mean_m + along * least_m, mean_m + along * most_m],
            thickness_m: eigen.eigenvalues[1 - longer].max(0.0).sqrt(),
            height_m: highest_m - lowest_m,
        })
    }

    /// Whether it is an upright plane, which no body is.
    pub(super) fn is_flat(&self) -> bool {
        let [from_m, to_m] = self.ends_m;
        self.thickness_m <= FLAT_M
            && (to_m - from_m).norm() >= LEAST_LENGTH_M
            && self.height_m >= LEAST_HEIGHT_M
    }

    /// How far the farther of its ends is from that of another.
    pub(super) fn distance_m(&self, other: &Self) -> f64 {
        let apart_m = |ends: [usize; 2]| {
            let apart_m = |end: usize| (self.ends_m[end] - other.ends_m[ends[end]]).norm();
            apart_m(0).max(apart_m(1))
        };
        apart_m([0, 1]).min(apart_m([1, 0]))
    }
}
