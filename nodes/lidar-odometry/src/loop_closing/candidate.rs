//! The earlier places that this one may be: those where the drift may have led, and of them the ones that look alike.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::{Keyframe, LoopCloser};

/// The scan contexts of this many places are compared, those whose rings differ least: a tree's answer in Kim and Kim 2018
/// (section III.D), who take ten to fifty.
const COMPARED: usize = 50;

/// A place that may be this one.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Candidate {
    /// Which keyframe it is.
    pub(super) keyframe: usize,
    /// Where the vehicle is thought to be, seen from there.
    pub(super) place_from_vehicle: Isometry3<f64>,
}

impl LoopCloser {
    /// The places to look at closely, the most likely one first: that which lies nearest by the odometry, then those that
    /// look alike. None unless one looks alike.
    pub(super) fn candidates(&self) -> Vec<Candidate> {
        let Some(now) = self.keyframes.back() else { return Vec::new() };
        let mut near: Vec<(usize, f64, f32)> = Vec::new();
        for (number, place) in self.keyframes.iter().enumerate() {
            let travelled_m = now.travelled_m - place.travelled_m;
            if travelled_m < self.config.min_travelled_m {
                break;
            }
            let apart_m = apart_m(place, now);
            if apart_m <= self.config.search_radius_m + self.drift(travelled_m).0 {
                near.push((number, apart_m, now.context.ring_distance(&place.context)));
            }
        }
        let nearest = near.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map(|near| near.0);
        near.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.0.cmp(&b.0)));
        let mut alike: Vec<(usize, f64, f64)> = near
            .iter()
            .take(COMPARED)
            .filter_map(|(number, ..)| {
                let found = self.keyframes.get(*number)?.context.distance(&now.context);
                let is_alike = found.distance <= self.config.max_context_distance;
                is_alike.then_some((*number, found.distance, found.yaw_rad))
            })
            .collect();
        alike.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        if alike.is_empty() {
            return Vec::new();
        }
        let expected = nearest.and_then(|number| {
            let place = self.keyframes.get(number)?;
            let place_from_vehicle = place.map_from_vehicle.inv_mul(&now.map_from_vehicle);
            Some(Candidate { keyframe: number, place_from_vehicle })
        });
        let mut chosen: Vec<Candidate> = Vec::new();
        for (number, _, yaw_rad) in alike {
            let is_new = chosen.iter().all(|other| {
                let places = self.keyframes.get(other.keyframe).zip(self.keyframes.get(number));
                places.is_none_or(|(a, b)| apart_m(a, b) >= self.config.distinct_m)
            });
            if is_new && chosen.len() < self.config.max_candidates {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad);
                let place_from_vehicle = Isometry3::from_parts(Vector3::zeros().into(), turn);
                chosen.push(Candidate { keyframe: number, place_from_vehicle });
            }
        }
        expected.into_iter().chain(chosen).collect()
    }
}

/// By what is known so far.
fn apart_m(a: &Keyframe, b: &Keyframe) -> f64 {
    (a.map_from_vehicle.translation.vector - b.map_from_vehicle.translation.vector).norm()
}
