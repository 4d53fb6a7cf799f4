//! The filter by the ground's shape: needs no intensity.
//!
//! Space about the sensor is cut into sectors, and each of these into rings. From ring to ring outwards the ground continues
//! with the slope that a road may have; whatever lies low over it is ground (after Himmelsbach, von Hundelshausen and Wuensche
//! 2010, "Fast segmentation of 3D point clouds for ground vehicles", with the lowest point of each ring in place of fitted
//! lines).

use std::f64::consts::TAU;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::registration::{ParameterError, check, check_positive};

/// No more sectors or rings.
const MOST_CELLS: usize = 10_000;

/// Leaves out the ground.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GroundFilter {
    /// The sensor's height over the ground.
    pub sensor_height_m: f64,
    /// Sectors all round.
    pub sectors: usize,
    /// From one ring to the next.
    pub ring_width_m: f64,
    /// Farther points are kept.
    pub reach_m: f64,
    /// The ground is no steeper than this (metres up a metre on).
    pub max_slope: f64,
    /// It lies within this of where it is expected, for a kerb and noise.
    pub tolerance_m: f64,
    /// Points up to this high over it are ground.
    pub height_m: f64,
}

impl Default for GroundFilter {
    fn default() -> Self {
        Self {
            // KITTI's car (Geiger et al. 2012).
            sensor_height_m: 1.73,
            // Two degrees.
            sectors: 180,
            ring_width_m: 1.0,
            // Farther out a sensor at this height sees little of a road.
            reach_m: 60.0,
            // Roads rise by 15 % at most, but for ramps.
            max_slope: 0.15,
            // A kerb is 12 to 15 cm high.
            tolerance_m: 0.2,
            height_m: 0.2,
        }
    }
}

impl GroundFilter {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        check_positive(&[
            ("sensor_height_m", self.sensor_height_m),
            ("ring_width_m", self.ring_width_m),
            ("reach_m", self.reach_m),
            ("max_slope", self.max_slope),
            ("tolerance_m", self.tolerance_m),
            ("height_m", self.height_m),
        ])?;
        let sectors = self.sectors;
        check("sectors", "in 4 .. 10000", sectors as f64, (4..=MOST_CELLS).contains(&sectors))?;
        let rings = self.reach_m / self.ring_width_m;
        check(
            "reach_m / ring_width_m",
            "in 1 .. 10000",
            rings,
            (1.0..=MOST_CELLS as f64).contains(&rings),
        )
    }

    /// Whether each point is kept: neither ground nor below it. Points are in the sensor's frame, z up.
    #[must_use]
    pub fn keeps(&self, points_m: &[Point3<f32>]) -> Vec<bool> {
        if self.validate().is_err() {
            return vec![true; points_m.len()];
        }
        let rings = (self.reach_m / self.ring_width_m).ceil() as usize;
        let mut lowest_m = vec![f32::INFINITY; self.sectors * rings];
        let cells: Vec<Option<usize>> =
            points_m.iter().map(|point| self.cell(point, rings)).collect();
        for (cell, point) in cells.iter().zip(points_m) {
            if let Some(lowest) = cell.and_then(|cell| lowest_m.get_mut(cell)) {
                *lowest = lowest.min(point.z);
            }
        }
        let ground_m: Vec<f64> =
            lowest_m.chunks(rings).flat_map(|sector| self.ground_of_sector(sector)).collect();
        let keep = |(cell, point): (&Option<usize>, &Point3<f32>)| {
            let ground_m = cell.and_then(|cell| ground_m.get(cell));
            ground_m.is_none_or(|ground_m| f64::from(point.z) > ground_m + self.height_m)
        };
        cells.iter().zip(points_m).map(keep).collect()
    }

    /// `None` beyond the reach, and for what is not finite.
    fn cell(&self, point: &Point3<f32>, rings: usize) -> Option<usize> {
        let (x_m, y_m) = (f64::from(point.x), f64::from(point.y));
        let range_m = x_m.hypot(y_m);
        if !point.z.is_finite() || range_m.is_nan() || range_m >= self.reach_m {
            return None;
        }
        let ring = ((range_m / self.ring_width_m) as usize).min(rings - 1);
        let share = (y_m.atan2(x_m) / TAU).rem_euclid(1.0);
        let sector = ((share * self.sectors as f64) as usize).min(self.sectors - 1);
        Some(sector * rings + ring)
    }

    /// The height of the ground in each ring: where the lowest point continues from the ring before, that; otherwise as it was.
    fn ground_of_sector(&self, lowest_m: &[f32]) -> Vec<f64> {
        let mut ground_m = -self.sensor_height_m;
        let mut rings_since = 1.0;
        lowest_m
            .iter()
            .map(|lowest_m| {
                let off_m = f64::from(*lowest_m) - ground_m;
                let rise_m = self.max_slope * self.ring_width_m * rings_since;
                if off_m.abs() < self.tolerance_m + rise_m {
                    // A point within the tolerance may lie on a kerb: the ground itself rises no faster than it may.
                    ground_m += off_m.clamp(-rise_m - self.tolerance_m, rise_m);
                    rings_since = 1.0;
                } else {
                    rings_since += 1.0;
                }
                ground_m
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, seen, street};

    #[test]
    fn the_ground_of_a_street_goes_and_fronts_and_cars_stay() {
        let mut random = Random::new(3);
        // The street's first face is its ground.
        let scene = street(&mut random);
        let filter = GroundFilter { sensor_height_m: 1.7, ..Default::default() };
        let pose = nalgebra::Isometry3::identity();
        let ground = seen(&scene[..1], &pose, 20_000, 0.02, &mut random);
        let others = seen(&scene[1..], &pose, 40_000, 0.02, &mut random);
        let all: Vec<Point3<f32>> = ground.iter().chain(&others).copied().collect();
        let keep = filter.keeps(&all);
        let left =
            keep[..ground.len()].iter().filter(|keep| **keep).count() as f64 / ground.len() as f64;
        assert!(left < 0.02, "{left} of the ground is left");
        let high: Vec<bool> =
            (ground.len()..all.len()).filter(|at| all[*at].z > -1.3).map(|at| keep[at]).collect();
        let kept = high.iter().filter(|keep| **keep).count() as f64 / high.len() as f64;
        assert!(kept > 0.98, "{kept} of the points above it is kept");
    }

    #[test]
    fn a_hill_is_ground_and_a_wall_is_not() {
        let filter = GroundFilter::default();
        let hill = |x_m: f64| -1.73 + 0.1 * (x_m - 5.0).max(0.0);
        let road: Vec<Point3<f32>> = (4..59)
            .flat_map(|x| (0..10).map(move |y| (f64::from(x), 0.01 * f64::from(y))))
            .map(|(x, y)| Point3::new(x, y, hill(x)).cast())
            .collect();
        assert!(filter.keeps(&road).iter().all(|keep| !keep));
        let wall: Vec<Point3<f32>> = (0..40)
            .map(|up| Point3::new(30.5, 0.05, (hill(30.5) + 0.1 * f64::from(up)) as f32))
            .collect();
        let both: Vec<Point3<f32>> = road.iter().chain(&wall).copied().collect();
        let keep = filter.keeps(&both);
        assert!(keep[..road.len()].iter().all(|keep| !keep));
        assert!(keep[road.len() + 4..].iter().all(|keep| *keep));
    }

    #[test]
    fn what_is_nowhere_is_kept_for_others_to_judge() {
        let points = [
            Point3::new(f32::NAN, 0.0, -1.7),
            Point3::new(500.0, 0.0, -1.7),
            Point3::new(5.0, 0.0, f32::INFINITY),
        ];
        assert_eq!(GroundFilter::default().keeps(&points), [true; 3]);
        assert_eq!(GroundFilter::default().keeps(&[]), [] as [bool; 0]);
        let bad = GroundFilter { ring_width_m: 1e-9, ..Default::default() };
        assert!(bad.validate().is_err());
        assert_eq!(bad.keeps(&points), [true; 3]);
    }
}
