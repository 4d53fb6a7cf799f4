//! How well two maps agree where the one is laid upon the other: by their upright surfaces, since every building has a level floor.
//!
//! A surface of the one agrees where the other has the same surface. It contradicts where the other is free: was seen through, or has
//! floor and nothing upright near. Where the other never looked it says nothing.

use nalgebra::{Isometry3, Vector3};

use crate::nearby::Nearby;
use crate::plan::Plan;
use crate::saved_map::{Lie, PreparedMap};
use crate::seen_space::SeenSpace;

/// So many pieces of each map are looked at, at equal steps.
const MOST_PIECES: usize = 3000;
/// Surfaces agree within so many edges: the pieces of one surface are up to one apart, and half as much is the noise of depth.
const WITHIN_EDGES: f64 = 1.5;
/// A map without views contradicts by its floor alone, which is half as often as one with views does (measured on simulated flats): there
/// it counts so many times.
const BY_FLOOR_ALONE: usize = 2;

/// The upright surface that two maps have where the one is laid upon the other.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Agreement {
    /// What both have, in square metres: the mean of both.
    pub same_m2: f64,
    /// What one has where the other is free.
    pub contradicting_m2: f64,
    /// The level surface that both have. Floors meet wherever one map is laid upon another at the right height: it says nothing else.
    pub level_m2: f64,
    /// The share of the smaller map's upright surface of which the other says something.
    pub overlap: f64,
}

impl Agreement {
    /// The share of what is the same, of all that both maps say something of: from 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        let known_m2 = self.same_m2 + self.contradicting_m2;
        if known_m2 > 0.0 { self.same_m2 / known_m2 } else { 0.0 }
    }
}

/// A map as another one is compared with it.
pub(crate) struct Compared<'a> {
    pub(crate) map: &'a PreparedMap,
    pub(crate) plan: Plan,
    pub(crate) seen: SeenSpace,
    nearby: Nearby,
}

impl<'a> Compared<'a> {
    pub(crate) fn new(
        map: &'a PreparedMap,
        plan: Plan,
        seen: SeenSpace,
        edge_m: f64,
        is_sided: bool,
    ) -> Option<Self> {
        let normals: Vec<Vector3<f32>> =
            map.pieces.iter().map(|piece| piece.normal.cast()).collect();
        let places = map.pieces.iter().map(|piece| piece.place_m.cast());
        let nearby = Nearby::new(places, &normals, WITHIN_EDGES * edge_m, is_sided)?;
        Some(Self { map, plan, seen, nearby })
    }

    /// What this map says of the surfaces of the other, in square metres: the same, and contradicting. With the area of all that is
    /// upright, and what is level and the same.
    fn says_of(&self, other: &PreparedMap, own_from_other: &Isometry3<f64>) -> [f64; 4] {
        let facing =
            |normal: &Vector3<f64>| if other.is_sided { *normal } else { Vector3::zeros() };
        let step = other.pieces.len().div_ceil(MOST_PIECES).max(1);
        let (mut same, mut against, mut upright, mut level) = (0, 0, 0, 0);
        for piece in other.pieces.iter().step_by(step) {
            let is_upright = piece.lie() == Lie::Upright;
            upright += usize::from(is_upright);
            let (place_m, normal) = (own_from_other * piece.place_m, own_from_other * piece.normal);
            if self.nearby.has(&place_m.cast(), Some(&normal.cast())) {
                same += usize::from(is_upright);
                level += usize::from(!is_upright);
            } else if is_upright
                && (self.plan.is_free(&place_m)
                    || self.seen.is_free(&place_m, &facing(&normal), other.edge_m))
            {
                against += 1;
            }
        }
        let area_m2 = |pieces: usize| (pieces * step) as f64 * other.edge_m * other.edge_m;
        if self.seen.is_empty() {
            against *= BY_FLOOR_ALONE;
        }
        [area_m2(same), area_m2(against), area_m2(upright), area_m2(level)]
    }
}

/// How well two maps agree; the pose is that of the level frames.
pub(crate) fn agreement(
    a: &Compared<'_>,
    b: &Compared<'_>,
    a_from_b: &Isometry3<f64>,
) -> Agreement {
    let of_b = a.says_of(b.map, a_from_b);
    let of_a = b.says_of(a.map, &a_from_b.inverse());
    let mean = |index: usize| f64::midpoint(of_a[index], of_b[index]);
    let smaller = if of_a[2] < of_b[2] { of_a } else { of_b };
    let overlap = if smaller[2] > 0.0 { (smaller[0] + smaller[1]) / smaller[2] } else { 0.0 };
    Agreement {
        same_m2: mean(0),
        contradicting_m2: mean(1),
        level_m2: mean(3),
        overlap: overlap.min(1.0),
    }
}
