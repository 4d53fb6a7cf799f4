//! The filter by rays: as if the sensor had fewer of them.

use std::collections::BTreeMap;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::recorded::middle_elevation_rad;
use crate::registration::{ParameterError, check};

/// Leaves out points by the laser that measured them. The thesis leaves out the lowest ones, of 32 between 10 and 26, and
/// rejects the filter for what it does to the height; one of a few rays keeps the height.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RayFilter {
    /// This many of the lowest rays are left out.
    pub lowest_left_out: u16,
    /// Of the others one of this many is kept, from the lowest on.
    pub every: u16,
}

impl Default for RayFilter {
    fn default() -> Self {
        // Nothing is left out.
        Self { lowest_left_out: 0, every: 1 }
    }
}

impl RayFilter {
    /// Checks every parameter.
    ///
    /// # Errors
    /// When `every` is 0.
    pub fn validate(&self) -> Result<(), ParameterError> {
        check("every", "at least 1", f64::from(self.every), self.every > 0)
    }

    /// Whether each point is kept, by the ring that measured it: the lowest is the one that looks lowest, whatever numbers the
    /// driver gives them.
    #[must_use]
    pub fn keeps(&self, points_m: &[Point3<f32>], rings: &[u16]) -> Vec<bool> {
        let mut of_ring: BTreeMap<u16, Vec<Point3<f32>>> = BTreeMap::new();
        for (point_m, ring) in points_m.iter().zip(rings) {
            of_ring.entry(*ring).or_default().push(*point_m);
        }
        let elevation = |(ring, points_m): (u16, Vec<Point3<f32>>)| {
            (middle_elevation_rad(points_m.into_iter()), ring)
        };
        let mut from_lowest: Vec<(f32, u16)> = of_ring.into_iter().map(elevation).collect();
        from_lowest.sort_by(|a, b| a.0.total_cmp(&b.0));
        let kept: BTreeMap<u16, bool> = (0_u16..)
            .zip(&from_lowest)
            .map(|(place, (_, ring))| {
                let above = place.checked_sub(self.lowest_left_out);
                (*ring, above.is_some_and(|above| above % self.every.max(1) == 0))
            })
            .collect();
        rings.iter().map(|ring| kept.get(ring).copied().unwrap_or(false)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selection::kept;

    #[test]
    fn the_lowest_go_and_one_of_a_few_stays() {
        let rings: Vec<u16> = (0..10).collect();
        let points_m: Vec<Point3<f32>> = rings.iter().map(|ring| looking(*ring)).collect();
        let left = |lowest_left_out, every| {
            kept(&rings, &RayFilter { lowest_left_out, every }.keeps(&points_m, &rings))
        };
        assert_eq!(left(0, 1), rings);
        assert_eq!(left(6, 1), [6, 7, 8, 9]);
        assert_eq!(left(0, 4), [0, 4, 8]);
        assert_eq!(left(3, 3), [3, 6, 9]);
        assert!(RayFilter { lowest_left_out: 0, every: 0 }.validate().is_err());
    }

    /// A point of a ray, the higher the larger its number is.
    fn looking(height: u16) -> Point3<f32> {
        Point3::new(5.0, 1.0, 0.1 * f32::from(height) - 0.5)
    }

    /// Regression: drivers that count from the highest ray, as those of Ouster and Hesai do, had their highest rays left out.
    #[test]
    fn the_lowest_rays_are_those_that_look_lowest() {
        // From the highest down, and in no order.
        for rings in [[4_u16, 3, 2, 1, 0], [7, 1, 90, 3, 0]] {
            let points_m: Vec<Point3<f32>> = (0..5).map(looking).collect();
            let keep = RayFilter { lowest_left_out: 2, every: 2 }.keeps(&points_m, &rings);
            assert_eq!(keep, [false, false, true, false, true], "{rings:?}");
        }
    }
}
