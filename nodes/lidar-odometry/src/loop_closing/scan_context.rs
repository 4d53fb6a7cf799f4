//! The appearance of a place, as a small picture: the height of the surfaces by distance and direction (Kim and Kim 2018,
//! "Scan Context: Egocentric Spatial Descriptor for Place Recognition within 3D Point Cloud Map"). A vehicle that faces
//! elsewhere sees the same picture with its columns shifted.

use std::f64::consts::TAU;

use nalgebra::Point3;

/// Rings, sectors and reach are the paper's (section IV).
const RINGS: usize = 20;
const SECTORS: usize = 60;
const REACH_M: f64 = 80.0;
/// Heights count from here, in the vehicle's frame: below any road.
const LOWEST_M: f32 = -4.0;
/// Fewer sectors in which both pictures show something are not compared.
const LEAST_SECTORS: usize = SECTORS / 4;

/// The picture of a place.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct ScanContext {
    /// By sector, counter-clockwise from forward; in each the height of the highest point by ring, 0 where there is none.
    sectors: Vec<[f32; RINGS]>,
    /// The lengths of these as vectors.
    lengths: Vec<f32>,
    /// The mean over the sectors: the same for every heading of the vehicle (section III.D, as the later papers have it).
    rings: [f32; RINGS],
}

/// How much two places differ.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct ContextDistance {
    /// 0 for the same, 1 for nothing in common.
    pub(super) distance: f64,
    /// By how much the second vehicle is turned against the first: `first_from_second`.
    pub(super) yaw_rad: f64,
}

impl ScanContext {
    /// Of points in the vehicle's frame, z up (section III.A, eq. 1 to 3).
    pub(super) fn of(points_m: &[Point3<f32>]) -> Self {
        let mut sectors = vec![[0.0_f32; RINGS]; SECTORS];
        for point_m in points_m {
            let range_m = f64::from(point_m.coords.xy().norm());
            let height_m = point_m.z - LOWEST_M;
            // A number that is none is in no range.
            if !(range_m < REACH_M && height_m > 0.0) {
                continue;
            }
            let azimuth = f64::from(point_m.y).atan2(f64::from(point_m.x)).rem_euclid(TAU);
            // Rounding may make a whole turn of a little less than one.
            let sector = ((azimuth / TAU * SECTORS as f64) as usize).min(SECTORS - 1);
            let ring = ((range_m / REACH_M * RINGS as f64) as usize).min(RINGS - 1);
            if let Some(highest_m) = sectors.get_mut(sector).and_then(|sector| sector.get_mut(ring))
            {
                *highest_m = highest_m.max(height_m);
            }
        }
        let lengths = sectors.iter().map(|sector| dot(sector, sector).sqrt()).collect();
        let mut rings = [0.0; RINGS];
        for sector in &sectors {
            for (mean, height_m) in rings.iter_mut().zip(sector) {
                *mean += height_m / SECTORS as f32;
            }
        }
        Self { sectors, lengths, rings }
    }

    /// How much the rings differ: quick, and little where the places are the same.
    pub(super) fn ring_distance(&self, other: &Self) -> f32 {
        let squares = self.rings.iter().zip(&other.rings).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f32>().sqrt()
    }

    /// The least distance over all turns (eq. 6 and 7).
    pub(super) fn distance(&self, other: &Self) -> ContextDistance {
        let mut best = ContextDistance { distance: 1.0, yaw_rad: 0.0 };
        for shift in 0..SECTORS {
            let distance = self.distance_at(other, shift);
            if distance < best.distance {
                best = ContextDistance { distance, yaw_rad: yaw_rad(shift) };
            }
        }
        best
    }

    /// The mean over the sectors in which both show something, of one less the cosine.
    fn distance_at(&self, other: &Self, shift: usize) -> f64 {
        let own = self.sectors.iter().zip(&self.lengths);
        let others = other.sectors.iter().zip(&other.lengths).cycle();
        // A point at an azimuth of this one is at an azimuth of the other that is less by its own rotation.
        let (mut sum, mut count) = (0.0, 0_usize);
        for ((sector, length), (other, other_length)) in own.zip(others.skip(SECTORS - shift)) {
            let lengths = length * other_length;
            if lengths > 0.0 {
                sum += f64::from(1.0 - dot(sector, other) / lengths);
                count += 1;
            }
        }
        if count < LEAST_SECTORS { 1.0 } else { sum / count as f64 }
    }
}

fn dot(a: &[f32; RINGS], b: &[f32; RINGS]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Between half a turn to the right and to the left.
fn yaw_rad(shift: usize) -> f64 {
    let turned = TAU * shift as f64 / SECTORS as f64;
    if turned > TAU / 2.0 { turned - TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use crate::testing::{Random, seen, street};

    fn view(map_from_vehicle: &Isometry3<f64>, seed: u64) -> ScanContext {
        let scene = street(&mut Random::new(1));
        ScanContext::of(&seen(&scene, map_from_vehicle, 20_000, 0.02, &mut Random::new(seed)))
    }

    fn at(x_m: f64, yaw_rad: f64) -> Isometry3<f64> {
        Isometry3::new(Vector3::new(x_m, 0.0, 0.0), Vector3::z() * yaw_rad)
    }

    #[test]
    fn a_place_is_recognised_at_every_heading_of_the_vehicle() {
        let first = view(&at(0.0, 0.0), 5);
        for yaw_deg in [0.0_f64, 45.0, 93.0, 180.0, -120.0] {
            let again = view(&at(0.3, yaw_deg.to_radians()), 6);
            let found = first.distance(&again);
            let off_deg = (found.yaw_rad.to_degrees() - yaw_deg + 180.0).rem_euclid(360.0) - 180.0;
            assert!(off_deg.abs() <= 6.0, "{yaw_deg}: {off_deg}");
            assert!(found.distance < 0.1, "{yaw_deg}: {}", found.distance);
            let other = first.ring_distance(&view(&at(25.0, yaw_deg.to_radians()), 6));
            let same = first.ring_distance(&again);
            assert!(same < 0.5 * other, "{yaw_deg}: {same} {other}");
        }
    }

    #[test]
    fn another_place_looks_different() {
        let first = view(&at(0.0, 0.0), 5);
        let same = first.distance(&view(&at(0.5, 0.0), 6)).distance;
        for x_m in [-20.0, 15.0, 25.0] {
            let other = first.distance(&view(&at(x_m, 0.0), 6)).distance;
            assert!(other > 2.0 * same, "{x_m}: {other}, the same place {same}");
        }
    }

    #[test]
    fn nothing_looks_like_nothing() {
        let nothing = ScanContext::of(&[Point3::new(f32::NAN, 0.0, 0.0)]);
        assert_eq!(nothing, ScanContext::of(&[]));
        assert_eq!(nothing.distance(&nothing).distance, 1.0);
        assert_eq!(view(&at(0.0, 0.0), 5).distance(&nothing).distance, 1.0);
    }
}
