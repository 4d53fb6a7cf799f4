//! The reprojection error of a point, and the error of its depth.

use geometry::CameraModel;
use nalgebra::{Point2, Point3, Vector3};

use super::{Block, Errors, MAX_ROWS, NEAREST_M, Placed, Term, by_perturbation};
use super::{is_finite_point, is_std_dev};
use crate::solve::PointObservation;

/// A point that can be used.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointTerm {
    in_map_m: Vector3<f64>,
    pixel_px: Point2<f64>,
    per_px: f64,
    /// The depth, and what it is weighed by.
    depth: Option<(f64, f64)>,
}

impl PointTerm {
    pub(crate) fn new(seen: &PointObservation) -> Option<Self> {
        let usable = is_finite_point(&seen.point_in_map_m)
            && seen.pixel_px.iter().all(|value| value.is_finite())
            && is_std_dev(seen.pixel_std_dev_px);
        let depth_usable = seen.depth_m.is_none_or(|depth_m| {
            depth_m.is_finite() && depth_m > NEAREST_M && is_std_dev(seen.depth_std_dev_m)
        });
        (usable && depth_usable).then(|| Self {
            in_map_m: seen.point_in_map_m.coords,
            pixel_px: seen.pixel_px,
            per_px: seen.pixel_std_dev_px.recip(),
            depth: seen.depth_m.map(|depth_m| (depth_m, seen.depth_std_dev_m.recip())),
        })
    }

    /// The same, were the point elsewhere.
    #[inline]
    pub(crate) fn moved(&self, in_map_m: &Point3<f64>) -> Self {
        Self { in_map_m: in_map_m.coords, ..*self }
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
        let pixel_chi2 = (off_x * off_x + off_y * off_y) * self.per_px * self.per_px;
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
        let by_x = camera.fx_px * per_depth * self.per_px;
        let by_y = camera.fy_px * per_depth * self.per_px;
        let mut block =
            Block { errors: [0.0; MAX_ROWS], jacobian: [[0.0; 6]; MAX_ROWS], rows: self.rows() };
        block.errors[0] = (camera.fx_px * x + camera.cx_px - self.pixel_px.x) * self.per_px;
        block.errors[1] = (camera.fy_px * y + camera.cy_px - self.pixel_px.y) * self.per_px;
        block.jacobian[0] = by_perturbation(&place, &Vector3::new(by_x, 0.0, -x * by_x));
        block.jacobian[1] = by_perturbation(&place, &Vector3::new(0.0, by_y, -y * by_y));
        if let Some((depth_m, per_m)) = self.depth {
            block.errors[2] = (place.z - depth_m) * per_m;
            block.jacobian[2] = by_perturbation(&place, &Vector3::new(0.0, 0.0, per_m));
        }
        Some(block)
    }
}
