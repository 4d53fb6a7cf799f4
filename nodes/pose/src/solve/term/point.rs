//! The reprojection error of a point, and the error of its depth.

use geometry::CameraModel;
use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::{Block, Errors, MAX_ROWS, NEAREST_M, Placed, Term, by_perturbation};
use super::{is_finite_point, is_std_dev};
use crate::solve::PointObservation;

/// A point that can be used.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointTerm {
    in_map_m: Vector3<f64>,
    pixel_px: Point2<f64>,
    /// A unit vector of the image along which the point is least sure; what errors along and across it are weighed by.
    along: Vector2<f64>,
    per_px_along: f64,
    per_px_across: f64,
    /// The depth, and what it is weighed by.
    depth: Option<(f64, f64)>,
}

impl PointTerm {
    pub(crate) fn new(seen: &PointObservation) -> Option<Self> {
        let usable = is_finite_point(&seen.point_in_map_m)
            && seen.pixel_px.iter().all(|value| value.is_finite())
            && is_std_dev(seen.pixel_std_dev_px)
            && seen.spread_px.iter().all(|value| value.is_finite());
        let depth_usable = seen.depth_m.is_none_or(|depth_m| {
            depth_m.is_finite() && depth_m > NEAREST_M && is_std_dev(seen.depth_std_dev_m)
        });
        (usable && depth_usable).then(|| Self {
            in_map_m: seen.point_in_map_m.coords,
            pixel_px: seen.pixel_px,
            along: seen.spread_px.try_normalize(0.0).unwrap_or_else(Vector2::x),
            per_px_along: seen.pixel_std_dev_px.hypot(seen.spread_px.norm()).recip(),
            per_px_across: seen.pixel_std_dev_px.recip(),
            depth: seen.depth_m.map(|depth_m| (depth_m, seen.depth_std_dev_m.recip())),
        })
    }

    /// The same, were the point elsewhere.
    #[inline]
    pub(crate) fn moved(&self, in_map_m: &Point3<f64>) -> Self {
        Self { in_map_m: in_map_m.coords, ..*self }
    }

    /// An offset in the image in standard deviations, along the direction of the spread and across it.
    #[inline]
    fn weighed(&self, off_x: f64, off_y: f64) -> [f64; 2] {
        let (x, y) = (self.along.x, self.along.y);
        [(x * off_x + y * off_y) * self.per_px_along, (x * off_y - y * off_x) * self.per_px_across]
    }
}

impl Term for PointTerm {
    fn rows(&self) -> usize {
        2 + usize::from(self.depth.is_some())
    }

    #[inline]
    fn errors(&self, camera: &CameraModel, pose: &Placed) -> Option<Errors> {
        let place = pose.in_camera(&self.in_map_m);
        if place.z.is_nan() || place.z < NEAREST_M {
            return None;
        }
        let per_depth = place.z.recip();
        let off_x = camera.fx_px * place.x * per_depth + camera.cx_px - self.pixel_px.x;
        let off_y = camera.fy_px * place.y * per_depth + camera.cy_px - self.pixel_px.y;
        let [along, across] = self.weighed(off_x, off_y);
        let pixel_chi2 = along * along + across * across;
        let off_z = self.depth.map_or(0.0, |(depth_m, per_m)| (place.z - depth_m) * per_m);
        Some(Errors { pixel_chi2, chi2: pixel_chi2 + off_z * off_z })
    }

    #[inline]
    fn block(&self, camera: &CameraModel, pose: &Placed) -> Option<Block> {
        let place = pose.in_camera(&self.in_map_m);
        if place.z.is_nan() || place.z < NEAREST_M {
            return None;
        }
        let per_depth = place.z.recip();
        let (x, y) = (place.x * per_depth, place.y * per_depth);
        let (by_x, by_y) = (camera.fx_px * per_depth, camera.fy_px * per_depth);
        let mut block =
            Block { errors: [0.0; MAX_ROWS], jacobian: [[0.0; 6]; MAX_ROWS], rows: self.rows() };
        let off_x = camera.fx_px * x + camera.cx_px - self.pixel_px.x;
        let off_y = camera.fy_px * y + camera.cy_px - self.pixel_px.y;
        [block.errors[0], block.errors[1]] = self.weighed(off_x, off_y);
        // Each row of the weights, times how the image changes with the place in the camera frame.
        let slope = |[to_x, to_y]: [f64; 2]| {
            Vector3::new(to_x * by_x, to_y * by_y, -to_x * by_x * x - to_y * by_y * y)
        };
        let [of_x, of_y] = [self.weighed(1.0, 0.0), self.weighed(0.0, 1.0)];
        block.jacobian[0] = by_perturbation(&place, &slope([of_x[0], of_y[0]]));
        block.jacobian[1] = by_perturbation(&place, &slope([of_x[1], of_y[1]]));
        if let Some((depth_m, per_m)) = self.depth {
            block.errors[2] = (place.z - depth_m) * per_m;
            block.jacobian[2] = by_perturbation(&place, &Vector3::new(0.0, 0.0, per_m));
        }
        Some(block)
    }
}
