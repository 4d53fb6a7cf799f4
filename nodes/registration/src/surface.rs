//! The target of a registration.

use estimation::Symmetric3;
use nalgebra::Vector3;

/// A piece of a surface: a point on it, and its normal.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct SurfaceElement {
    /// In the frame of the surface.
    pub place_m: Vector3<f64>,
    /// The mean of `n n^T` over its normals; 0 where there is none, and in part where they differ.
    pub normals: Symmetric3,
}

/// Surfaces that are searched for the counterpart of a point.
pub trait Surface: Sync {
    /// The number of the element that corresponds to a place, if one is nearer than the limit. `before` is what
    /// corresponded to nearly the same place.
    fn corresponding(
        &self,
        place_m: &Vector3<f64>,
        limit_m: f64,
        before: Option<u32>,
    ) -> Option<u32>;

    /// An element by its number.
    fn element(&self, number: u32) -> SurfaceElement;
}
