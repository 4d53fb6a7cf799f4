//! The static solids, prepared for many rays.

use crate::Ray;
use crate::bvh::{Aabb, Bvh};
use crate::solid::{Sighting, Solid, nearest_sighting};
use crate::truth::Hull;

use nalgebra::Isometry3;

/// Static solids in a tree, and a list of panes.
#[derive(Clone, Debug)]
pub(crate) struct StillSolids {
    opaque: Vec<Solid>,
    panes: Vec<Solid>,
    tree: Bvh,
}

impl StillSolids {
    pub(crate) fn new(solids: &[Solid]) -> Self {
        let (panes, opaque): (Vec<Solid>, Vec<Solid>) =
            solids.iter().cloned().partition(Solid::is_pane);
        let boxes: Vec<Aabb> = opaque.iter().map(bounds).collect();
        Self { opaque, panes, tree: Bvh::new(&boxes) }
    }

    /// The nearest of these and of the moving solids along a ray of direction length 1, with the result of
    /// [`nearest_sighting`].
    pub(crate) fn nearest_sighting(
        &self,
        moving: &[Solid],
        ray: &Ray,
        min_signal: f64,
    ) -> Option<Sighting> {
        let still = self.tree.nearest(ray, |index| {
            let solid = self.opaque.get(index)?;
            let local = ray.transformed(&solid.solid_from_room);
            solid.shape.intersect(&local).map(|hit| hit.parameter)
        });
        let still = still.and_then(|(index, _)| self.opaque.get(index));
        nearest_sighting(still.into_iter().chain(moving).chain(&self.panes), ray, min_signal)
    }
}

/// A box slightly larger than the solid, since a rectangle has no thickness.
fn bounds(solid: &Solid) -> Aabb {
    const MARGIN_M: f64 = 1e-6;
    let hull = Hull::of(std::slice::from_ref(solid), &Isometry3::identity());
    let half_m = (hull.extent_m / 2.0).add_scalar(MARGIN_M);
    Aabb { least: hull.centre_m - half_m, most: hull.centre_m + half_m }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::{Scene, SceneName};

    #[test]
    fn the_tree_sees_what_asking_everything_sees() {
        for name in SceneName::ALL {
            let solids = Scene::of_table_2(name).static_solids();
            let still = StillSolids::new(&solids);
            for step in 0..2000 {
                let (azimuth, elevation) =
                    (f64::from(step) * 0.377, f64::from(step % 37) * 0.04 - 0.7);
                let direction = Vector3::new(
                    azimuth.cos() * elevation.cos(),
                    azimuth.sin() * elevation.cos(),
                    elevation.sin(),
                );
                let ray = Ray { origin: Point3::new(0.9, 0.2, 1.2), direction };
                let plain = nearest_sighting(solids.iter(), &ray, 0.01);
                let fast = still.nearest_sighting(&[], &ray, 0.01);
                let seen = |sighting: Option<Sighting>| {
                    // When two surfaces coincide, either may be hit.
                    sighting.map(|s| (s.distance_m.to_bits(), s.id))
                };
                assert_eq!(seen(fast), seen(plain), "{name}, step {step}");
            }
        }
    }
}
