//! The line through points.

use nalgebra::{Point2, Vector2};

/// Sums over points, from which the line through them follows. To add a point, to remove one or to join two sets costs
/// the same whatever their size.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub(super) struct Moments {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

/// The line of least squared distances perpendicular to it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct FittedLine {
    pub(super) centroid_px: Point2<f64>,
    /// Of length 1.
    pub(super) direction: Vector2<f64>,
}

/// Mean, and mean squared deviations, of points.
struct Scatter {
    mean: Point2<f64>,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Moments {
    pub(super) fn add(&mut self, point: Point2<f64>) {
        *self = self.joined(&Self::of(point, 1.0));
    }

    /// Takes back a point that was added.
    pub(super) fn remove(&mut self, point: Point2<f64>) {
        *self = self.joined(&Self::of(point, -1.0));
    }

    fn of(point: Point2<f64>, weight: f64) -> Self {
        let (x, y) = (weight * point.x, weight * point.y);
        Self { count: weight, x, y, xx: x * point.x, xy: x * point.y, yy: y * point.y }
    }

    /// Those of the points of both.
    pub(super) fn joined(&self, other: &Self) -> Self {
        Self {
            count: self.count + other.count,
            x: self.x + other.x,
            y: self.y + other.y,
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
        }
    }

    /// How many points there are.
    pub(super) fn count(&self) -> usize {
        self.count as usize
    }

    fn scatter(&self) -> Scatter {
        let share = 1.0 / self.count;
        let mean = Point2::new(self.x * share, self.y * share);
        Scatter {
            mean,
            xx: self.xx * share - mean.x * mean.x,
            xy: self.xy * share - mean.x * mean.y,
            yy: self.yy * share - mean.y * mean.y,
        }
    }

    /// Whether the points deviate from their line by at most this much, squared and in the mean: whether the smaller
    /// eigenvalue of their scatter is no larger. It is larger just if the scatter less this much is still positive
    /// definite, which takes no root.
    pub(super) fn lie_within(&self, mean_square_px2: f64) -> bool {
        let Scatter { xx, xy, yy, .. } = self.scatter();
        let (xx, yy) = (xx - mean_square_px2, yy - mean_square_px2);
        xx <= 0.0 || xx * yy <= xy * xy
    }

    /// The line through the points, directed as `towards` is.
    pub(super) fn line(&self, towards: Vector2<f64>) -> FittedLine {
        let Scatter { mean, xx, xy, yy } = self.scatter();
        let half = 0.5 * (xx - yy);
        let root = (half * half + xy * xy).sqrt();
        // The eigenvector of the larger eigenvalue, in that one of its two forms in which nothing cancels.
        let along =
            if half >= 0.0 { Vector2::new(half + root, xy) } else { Vector2::new(xy, root - half) };
        let direction = along.try_normalize(0.0).unwrap_or_else(Vector2::x);
        let direction = if direction.dot(&towards) < 0.0 { -direction } else { direction };
        FittedLine { centroid_px: mean, direction }
    }
}

impl FittedLine {
    /// How far a point is along the line, from its centroid.
    pub(super) fn along_px(&self, point: Point2<f64>) -> f64 {
        self.direction.dot(&(point - self.centroid_px))
    }

    /// How far a point is from the line, to the right of it positive.
    pub(super) fn across_px(&self, point: Point2<f64>) -> f64 {
        self.direction.perp(&(point - self.centroid_px))
    }

    /// The point at this distance along the line.
    pub(super) fn at(&self, along_px: f64) -> Point2<f64> {
        self.centroid_px + along_px * self.direction
    }
}
