//! The pixels of an image that can show a solid, and the hits of their rays.

use std::ops::Range;

use geometry::CameraModel;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::solid::Solid;
use crate::{Hit, Ray};

/// Solids are clipped in front of this plane.
const NEAR_PLANE_M: f64 = 0.01;

/// A solid projected into an image.
pub(crate) struct Projection<'a> {
    pub(crate) solid: &'a Solid,
    camera: CameraModel,
    bounds: Bounds,
    solid_from_camera: Isometry3<f64>,
    origin: Point3<f64>,
    /// The ray of a pixel is affine in its row and column.
    per_column: Vector3<f64>,
}

impl<'a> Projection<'a> {
    /// `None` when no pixel can show it.
    pub(crate) fn of(
        solid: &'a Solid,
        room_from_camera: &Isometry3<f64>,
        camera: &CameraModel,
    ) -> Option<Self> {
        let solid_from_camera = solid.solid_from_room * room_from_camera;
        let bounds = Bounds::of(solid, &solid_from_camera, camera)?;
        Some(Self {
            solid,
            camera: *camera,
            bounds,
            origin: solid_from_camera * Point3::origin(),
            per_column: solid_from_camera * (Vector3::x() / camera.fx_px),
            solid_from_camera,
        })
    }

    /// The ray of a pixel in the frame of the solid; its direction has depth 1, so that the parameter of a hit
    /// is the depth.
    pub(crate) fn ray(&self, row_px: usize, column_px: usize) -> Ray {
        let direction = self.row_start(row_px) + self.per_column * column_px as f64;
        Ray { origin: self.origin, direction }
    }

    /// Calls `visit` with each pixel of `rows` whose ray hits the solid: its index, counted from the first of
    /// these rows, the ray and the hit.
    pub(crate) fn for_each_hit(
        &self,
        rows: &Range<usize>,
        mut visit: impl FnMut(usize, &Ray, &Hit),
    ) {
        let within = self.bounds.rows.0.max(rows.start)..self.bounds.rows.1.min(rows.end);
        for row_px in within {
            let row_start = self.row_start(row_px);
            let first = (row_px - rows.start) * self.camera.width_px;
            for column_px in self.bounds.columns.0..self.bounds.columns.1 {
                let direction = row_start + self.per_column * column_px as f64;
                let ray = Ray { origin: self.origin, direction };
                if let Some(hit) = self.solid.shape.intersect(&ray) {
                    visit(first + column_px, &ray, &hit);
                }
            }
        }
    }

    /// Whether the solid can be visible at a pixel.
    pub(crate) fn covers(&self, row_px: usize, column_px: usize) -> bool {
        let Bounds { columns, rows } = &self.bounds;
        (rows.0..rows.1).contains(&row_px) && (columns.0..columns.1).contains(&column_px)
    }

    fn row_start(&self, row_px: usize) -> Vector3<f64> {
        let y = (row_px as f64 - self.camera.cy_px) / self.camera.fy_px;
        let x_of_column_0 = -self.camera.cx_px / self.camera.fx_px;
        self.solid_from_camera * Vector3::new(x_of_column_0, y, 1.0)
    }
}

/// The rows and columns that a solid's projection can cover; ends exclusive.
struct Bounds {
    columns: (usize, usize),
    rows: (usize, usize),
}

impl Bounds {
    fn of(solid: &Solid, solid_from_camera: &Isometry3<f64>, camera: &CameraModel) -> Option<Self> {
        let camera_from_solid = solid_from_camera.inverse();
        let half_m = solid.half_extent_m();
        let corners: [Point3<f64>; 8] = std::array::from_fn(|corner| {
            let sign = |axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
            camera_from_solid
                * Point3::new(sign(0) * half_m.x, sign(1) * half_m.y, sign(2) * half_m.z)
        });
        if corners.iter().all(|corner| corner.z < NEAR_PLANE_M) {
            return None;
        }
        let (mut columns, mut rows) = (Span::NONE, Span::NONE);
        let mut reach = |point: &Point3<f64>| {
            columns.reach(camera.fx_px * point.x / point.z + camera.cx_px);
            rows.reach(camera.fy_px * point.y / point.z + camera.cy_px);
        };
        for (index, corner) in corners.iter().enumerate() {
            if corner.z >= NEAR_PLANE_M {
                reach(corner);
            }
            // The part in front of the plane is the hull of its corners there and of the crossings of edges with the plane.
            for axis in 0..3 {
                let Some(other) = corners.get(index | 1 << axis) else { continue };
                if (corner.z < NEAR_PLANE_M) != (other.z < NEAR_PLANE_M) {
                    let share = (NEAR_PLANE_M - corner.z) / (other.z - corner.z);
                    let crossing = corner + (other - corner) * share;
                    reach(&Point3::new(crossing.x, crossing.y, NEAR_PLANE_M));
                }
            }
        }
        let bounds =
            Self { columns: columns.whole(camera.width_px), rows: rows.whole(camera.height_px) };
        (bounds.columns.0 < bounds.columns.1 && bounds.rows.0 < bounds.rows.1).then_some(bounds)
    }
}

/// The interval from the least to the largest number.
struct Span {
    least: f64,
    largest: f64,
}

impl Span {
    const NONE: Self = Self { least: f64::INFINITY, largest: f64::NEG_INFINITY };

    fn reach(&mut self, value: f64) {
        self.least = self.least.min(value);
        self.largest = self.largest.max(value);
    }

    /// The whole numbers within it and below `end`; end exclusive.
    fn whole(&self, end: usize) -> (usize, usize) {
        // The casts saturate: parts left of the image start at 0, parts right of it are cut off.
        (self.least.floor() as usize, ((self.largest.ceil() + 1.0) as usize).min(end))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{DepthCamera, Material, Shape};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// No pixel outside the bounds has a ray that hits the solid beyond the near plane.
        #[test]
        fn bounds_leave_nothing_out(
            size_m in [0.05..6.0_f64, 0.05..6.0, 0.05..6.0],
            place in [-4.0..4.0_f64, -4.0..4.0, -2.0..6.0],
            turn in [-2.0..2.0_f64, -2.0..2.0, -2.0..2.0],
        ) {
            let camera = DepthCamera::kinect_v1().with_size(64, 48).camera;
            let room_from_solid = Isometry3::new(place.into(), turn.into());
            let solid =
                Solid::new(Shape::Box { size_m }, &room_from_solid, &Material::PLASTER, 0, 0);
            let mut met = vec![false; 64 * 48];
            let projection = Projection::of(&solid, &Isometry3::identity(), &camera);
            if let Some(projection) = &projection {
                projection.for_each_hit(&(0..48), |index, _, _| met[index] = true);
            }
            for (index, met) in met.into_iter().enumerate() {
                let (row, column) = (index / 64, index % 64);
                let direction = Vector3::new(
                    (column as f64 - camera.cx_px) / camera.fx_px,
                    (row as f64 - camera.cy_px) / camera.fy_px,
                    1.0,
                );
                let ray = Ray { origin: Point3::origin(), direction }
                    .transformed(&solid.solid_from_room);
                let hit = solid.shape.intersect(&ray);
                if hit.is_some_and(|hit| hit.parameter > NEAR_PLANE_M) {
                    prop_assert!(met, "column {column}, row {row}");
                }
            }
        }
    }
}
