//! The shapes of scenes, and their intersections with rays.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::{Hit, Mesh, Ray};

/// A shape in its own frame, centred on the origin. The body's pose moves and rotates it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// A cuboid with its edges along the axes.
    Box {
        /// The extent along x, y and z.
        size_m: [f64; 3],
    },
    /// A cylinder along z, closed at both ends.
    Cylinder {
        /// The radius.
        radius_m: f64,
        /// The extent along z.
        height_m: f64,
    },
    /// A cylinder along z with half spheres at its ends.
    Capsule {
        /// The radius of the cylinder and of the half spheres.
        radius_m: f64,
        /// The distance between the centres of the half spheres.
        length_m: f64,
    },
    /// A ball.
    Sphere {
        /// The radius.
        radius_m: f64,
    },
    /// A rectangle in the plane z = 0, visible from both sides.
    Rectangle {
        /// The extent along x and y.
        size_m: [f64; 2],
    },
    /// Triangles.
    Mesh(Mesh),
}

impl Shape {
    /// Half the extent of the shape along each axis of its frame; for a mesh, that of the box around the origin that contains
    /// it.
    #[must_use]
    pub fn half_extent_m(&self) -> Vector3<f64> {
        match *self {
            Self::Box { size_m: [x, y, z] } => Vector3::new(x, y, z) / 2.0,
            Self::Cylinder { radius_m, height_m } => {
                Vector3::new(radius_m, radius_m, height_m / 2.0)
            }
            Self::Capsule { radius_m, length_m } => {
                Vector3::new(radius_m, radius_m, length_m / 2.0 + radius_m)
            }
            Self::Sphere { radius_m } => Vector3::repeat(radius_m),
            Self::Rectangle { size_m: [x, y] } => Vector3::new(x / 2.0, y / 2.0, 0.0),
            Self::Mesh(ref mesh) => mesh.half_extent_m(),
        }
    }

    /// Whether it is convex.
    pub(crate) fn is_convex(&self) -> bool {
        match self {
            Self::Box { .. }
            | Self::Cylinder { .. }
            | Self::Capsule { .. }
            | Self::Sphere { .. }
            | Self::Rectangle { .. } => true,
            Self::Mesh(_) => false,
        }
    }

    /// The first hit of a ray, given in the shape's frame, on the surface. From inside that is the exit.
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        match *self {
            Self::Box { .. } => intersect_box(&self.half_extent_m(), ray),
            Self::Cylinder { radius_m, height_m } => {
                let half_m = height_m / 2.0;
                nearest([
                    intersect_side(radius_m, half_m, ray),
                    intersect_disc(radius_m, half_m, ray),
                    intersect_disc(radius_m, -half_m, ray),
                ])
            }
            Self::Capsule { radius_m, length_m } => {
                let half_m = length_m / 2.0;
                nearest([
                    intersect_side(radius_m, half_m, ray),
                    intersect_ball(radius_m, half_m, ray, |z_m| z_m >= half_m),
                    intersect_ball(radius_m, -half_m, ray, |z_m| z_m <= -half_m),
                ])
            }
            Self::Sphere { radius_m } => intersect_ball(radius_m, 0.0, ray, |_| true),
            Self::Rectangle { size_m: [x_m, y_m] } => {
                intersect_rectangle([x_m / 2.0, y_m / 2.0], ray)
            }
            Self::Mesh(ref mesh) => mesh.intersect(ray),
        }
    }
}

fn nearest(hits: [Option<Hit>; 3]) -> Option<Hit> {
    hits.into_iter().flatten().min_by(|a, b| a.parameter.total_cmp(&b.parameter))
}

/// The slab method: the ray is inside the box while it is inside all three slabs.
fn intersect_box(half_m: &Vector3<f64>, ray: &Ray) -> Option<Hit> {
    let (mut enter, mut enter_axis) = (f64::NEG_INFINITY, 0);
    let (mut leave, mut leave_axis) = (f64::INFINITY, 0);
    for axis in 0..3 {
        let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
        if direction == 0.0 {
            if origin.abs() > half_m[axis] {
                return None;
            }
            continue;
        }
        let reach = (half_m[axis] / direction).abs();
        let middle = -origin / direction;
        if middle - reach > enter {
            (enter, enter_axis) = (middle - reach, axis);
        }
        if middle + reach < leave {
            (leave, leave_axis) = (middle + reach, axis);
        }
    }
    if enter > leave {
        return None;
    }
    let (parameter, axis, outwards) =
        if enter > 0.0 { (enter, enter_axis, -1.0) } else { (leave, leave_axis, 1.0) };
    if !(parameter > 0.0 && parameter.is_finite()) {
        return None;
    }
    let mut normal = Vector3::zeros();
    normal[axis] = outwards * ray.direction[axis].signum();
    Some(Hit { parameter, normal })
}

/// The mantle of the cylinder of `radius_m` around z, between -`half_m` and `half_m`.
fn intersect_side(radius_m: f64, half_m: f64, ray: &Ray) -> Option<Hit> {
    let (origin, direction) = (ray.origin.xy().coords, ray.direction.xy());
    let roots = roots(direction.norm_squared(), origin.dot(&direction), origin, radius_m)?;
    let parameter = roots.into_iter().find(|&parameter| {
        parameter > 0.0 && (ray.origin.z + parameter * ray.direction.z).abs() <= half_m
    })?;
    let outwards = (origin + direction * parameter) / radius_m;
    Some(Hit { parameter, normal: Vector3::new(outwards.x, outwards.y, 0.0) })
}

/// The disc of `radius_m` around z at height `z_m`: an end of a cylinder.
fn intersect_disc(radius_m: f64, z_m: f64, ray: &Ray) -> Option<Hit> {
    let parameter = plane_parameter(z_m, ray)?;
    let inside = ray.at(parameter).xy().coords.norm_squared() <= radius_m * radius_m;
    inside.then_some(Hit { parameter, normal: Vector3::z() * z_m.signum() })
}

/// The part of the ball around `(0, 0, centre_z_m)` at the heights that `covers` accepts.
fn intersect_ball(
    radius_m: f64,
    centre_z_m: f64,
    ray: &Ray,
    covers: impl Fn(f64) -> bool,
) -> Option<Hit> {
    let origin = ray.origin.coords - Vector3::z() * centre_z_m;
    let roots = roots(ray.direction.norm_squared(), origin.dot(&ray.direction), origin, radius_m)?;
    let parameter = roots
        .into_iter()
        .find(|&parameter| parameter > 0.0 && covers(ray.origin.z + parameter * ray.direction.z))?;
    Some(Hit { parameter, normal: (origin + ray.direction * parameter) / radius_m })
}

fn intersect_rectangle(half_m: [f64; 2], ray: &Ray) -> Option<Hit> {
    let parameter = plane_parameter(0.0, ray)?;
    let point = ray.at(parameter);
    (point.x.abs() <= half_m[0] && point.y.abs() <= half_m[1])
        .then_some(Hit { parameter, normal: Vector3::z() * -ray.direction.z.signum() })
}

/// The intersection of the ray with the plane at height `z_m`.
fn plane_parameter(z_m: f64, ray: &Ray) -> Option<f64> {
    let parameter = (z_m - ray.origin.z) / ray.direction.z;
    (parameter > 0.0 && parameter.is_finite()).then_some(parameter)
}

/// The parameters, smaller first, at which `origin + parameter * direction` is `radius_m` from zero, with
/// `a` the squared length of the direction and `half_b` its product with the origin.
fn roots<const D: usize>(
    a: f64,
    half_b: f64,
    origin: nalgebra::SVector<f64, D>,
    radius_m: f64,
) -> Option<[f64; 2]> {
    if a <= 0.0 {
        return None;
    }
    let discriminant = half_b * half_b - a * (origin.norm_squared() - radius_m * radius_m);
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    Some([(-half_b - root) / a, (-half_b + root) / a])
}

#[cfg(test)]
mod tests;
