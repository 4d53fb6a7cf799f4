//! Rays and hits.

use nalgebra::{Isometry3, Point3, Vector3};

/// A half line: `origin + parameter * direction` for positive parameters.
///
/// The direction need not have length 1. A camera's ray has a direction with z = 1 in the optical frame,
/// so that the parameter of a hit is the depth of the pixel.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ray {
    /// The origin, in metres.
    pub origin: Point3<f64>,
    /// The direction; not zero.
    pub direction: Vector3<f64>,
}

impl Ray {
    /// The point at `parameter`.
    #[must_use]
    pub fn at(&self, parameter: f64) -> Point3<f64> {
        self.origin + self.direction * parameter
    }

    /// The ray in another frame; parameters do not change.
    #[must_use]
    pub fn transformed(&self, target_from_ray: &Isometry3<f64>) -> Self {
        Self { origin: target_from_ray * self.origin, direction: target_from_ray * self.direction }
    }
}

/// The first hit of a ray on a surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hit {
    /// The ray's parameter there; positive.
    pub parameter: f64,
    /// The surface's unit normal, pointing out of the body (for a rectangle: towards the ray's origin).
    pub normal: Vector3<f64>,
}

impl Hit {
    /// The cosine of the angle of incidence between the ray and the normal, in `[0, 1]`.
    #[must_use]
    pub fn cos_incidence(&self, direction: &Vector3<f64>) -> f64 {
        let length = direction.norm();
        if length > 0.0 { (self.normal.dot(direction) / length).abs().min(1.0) } else { 0.0 }
    }
}
