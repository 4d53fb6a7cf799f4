//! Each corner with each.

use multiversion::multiversion;

use super::{MatchConfig, PointMatch, rotation};
use crate::feature::points::{Corner, Descriptor};

/// The corners of `among` that those of `sought` are taken for: the nearest in descriptor, clearly nearer than the
/// next nearest, nearest to each other from both sides, and turned as most are. In the order of `sought`.
#[must_use]
pub fn match_all(sought: &[Corner], among: &[Corner], config: &MatchConfig) -> Vec<PointMatch> {
    let descriptors: Vec<Descriptor> = among.iter().map(|corner| corner.descriptor).collect();
    let mut distances = vec![0; among.len()];
    let mut back = vec![Nearest::default(); among.len()];
    let mut nearest = Vec::with_capacity(sought.len());
    for (index, corner) in sought.iter().enumerate() {
        measure(&corner.descriptor, &descriptors, &mut distances);
        nearest.push(choose(&distances, index as u32, &mut back));
    }
    let mut matches = Vec::new();
    for (index, nearest) in nearest.iter().enumerate() {
        let is_mutual =
            back.get(nearest.index as usize).is_some_and(|back| back.index == index as u32);
        let next = (nearest.next_distance != FAR).then_some(u32::from(nearest.next_distance));
        if is_mutual && config.accepts(u32::from(nearest.distance), next) {
            matches.push(PointMatch {
                sought: index,
                found: nearest.index as usize,
                distance: u32::from(nearest.distance),
            });
        }
    }
    let turns_rad: Vec<f32> = matches
        .iter()
        .map(|pair| among[pair.found].angle_rad - sought[pair.sought].angle_rad)
        .collect();
    let mut kept =
        rotation::consistent(&turns_rad, config.rotation_tolerance_rad as f32).into_iter();
    matches.retain(|_| kept.next().unwrap_or(true));
    matches
}

/// Farther than any descriptor.
const FAR: u16 = u16::MAX;

/// The nearest descriptor, and how far the next one is.
#[derive(Clone, Copy, Debug)]
struct Nearest {
    index: u32,
    distance: u16,
    next_distance: u16,
}

impl Default for Nearest {
    fn default() -> Self {
        Self { index: u32::MAX, distance: FAR, next_distance: FAR }
    }
}

/// The distances of a descriptor to many.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt"))]
fn measure(descriptor: &Descriptor, others: &[Descriptor], distances: &mut [u16]) {
    for (distance, other) in distances.iter_mut().zip(others) {
        *distance = descriptor.distance(other) as u16;
    }
}

/// The nearest by these distances, and the same in reverse: `back` of each of the others is updated by the
/// corner `index`. Of equally near ones the first counts.
fn choose(distances: &[u16], index: u32, back: &mut [Nearest]) -> Nearest {
    let mut nearest = Nearest::default();
    for (other, (&distance, back)) in distances.iter().zip(back).enumerate() {
        if distance < nearest.next_distance {
            if distance < nearest.distance {
                nearest.next_distance = nearest.distance;
                nearest.distance = distance;
                nearest.index = other as u32;
            } else {
                nearest.next_distance = distance;
            }
        }
        if distance < back.distance {
            back.distance = distance;
            back.index = index;
        }
    }
    nearest
}
