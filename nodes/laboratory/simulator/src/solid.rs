//! A body prepared for ray casting: its pose and its material's limits are precomputed.

use geometry::LabelImage;
use nalgebra::{Isometry3, Vector3};

use crate::{Hit, Material, Paint, Ray, Shape};

/// The label of the static scene.
pub(crate) const STATIC_ID: u16 = LabelImage::STATIC;

#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub(crate) shape: Shape,
    pub(crate) solid_from_room: Isometry3<f64>,
    /// The object that it belongs to; [`STATIC_ID`] for none.
    pub(crate) id: u16,
    reflectivity: f64,
    min_cos_incidence: f64,
    transmission: f64,
    pub(crate) paint: Paint,
    /// The seed of the pattern of its paint.
    pub(crate) pattern_seed: u32,
}

/// A hit of a ray in the room.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sighting {
    pub(crate) distance_m: f64,
    pub(crate) id: u16,
    /// See [`Solid::strength`].
    pub(crate) strength: f64,
    /// The brightness of the surface from there: 1 for albedo 1 at normal incidence.
    pub(crate) brightness: f64,
}

impl Solid {
    pub(crate) fn new(
        shape: Shape,
        room_from_solid: &Isometry3<f64>,
        material: &Material,
        id: u16,
        pattern_seed: u32,
    ) -> Self {
        Self {
            shape,
            solid_from_room: room_from_solid.inverse(),
            id,
            reflectivity: material.reflectivity,
            min_cos_incidence: material.max_incidence_rad.cos(),
            transmission: material.transmission,
            paint: material.visible_paint(),
            pattern_seed,
        }
    }

    /// The ratio of the returned light to the least that a sensor can use: 1 is just enough. The light falls with the cosine
    /// of the angle of incidence (Lambert) and the square of the distance, and there is no return beyond the material's
    /// largest angle. `min_signal` is the least usable reflectivity at one metre and normal incidence.
    pub(crate) fn strength(&self, cos_incidence: f64, distance_m: f64, min_signal: f64) -> f64 {
        let signal = self.reflectivity * cos_incidence / (distance_m * distance_m);
        (signal / min_signal).min(cos_incidence / self.min_cos_incidence)
    }

    /// The brightness, which does not depend on the distance. Rough surfaces at oblique incidence look brighter than by
    /// Lambert's cosine (Oren and Nayar 1994): its square root is taken.
    pub(crate) fn brightness(&self, cos_incidence: f64) -> f64 {
        self.reflectivity * cos_incidence.sqrt()
    }

    /// Whether it transmits light; see [`Material::transmission`].
    pub(crate) fn is_pane(&self) -> bool {
        self.transmission > 0.0
    }

    /// The attenuation of the signal from behind this pane, both ways: 0 when the pane reflects.
    pub(crate) fn weakening(&self, cos_incidence: f64) -> f64 {
        if cos_incidence < self.min_cos_incidence { 0.0 } else { self.transmission.powi(2) }
    }

    /// The half extents of the solid's cuboid hull, for bounds.
    pub(crate) fn half_extent_m(&self) -> Vector3<f64> {
        self.shape.half_extent_m()
    }
}

/// The nearest of `solids` along a ray of direction length 1, through the panes before it.
pub(crate) fn nearest_sighting<'a>(
    solids: impl Iterator<Item = &'a Solid>,
    ray_in_room: &Ray,
    min_signal: f64,
) -> Option<Sighting> {
    let mut nearest: Option<(Hit, Vector3<f64>, &Solid)> = None;
    let mut panes: Vec<(f64, f64)> = Vec::new();
    for solid in solids {
        let ray = ray_in_room.transformed(&solid.solid_from_room);
        let Some(hit) = solid.shape.intersect(&ray) else { continue };
        if solid.is_pane() {
            panes.push((hit.parameter, solid.weakening(hit.cos_incidence(&ray.direction))));
        } else if nearest.is_none_or(|(best, ..)| hit.parameter < best.parameter) {
            nearest = Some((hit, ray.direction, solid));
        }
    }
    nearest.map(|(hit, direction, solid)| {
        let cos_incidence = hit.cos_incidence(&direction);
        let strength = solid.strength(cos_incidence, hit.parameter, min_signal);
        let before = panes.iter().filter(|(parameter, _)| *parameter < hit.parameter);
        Sighting {
            distance_m: hit.parameter,
            id: solid.id,
            brightness: solid.brightness(cos_incidence),
            strength: before.fold(strength, |strength, (_, weakening)| strength * weakening),
        }
    })
}
