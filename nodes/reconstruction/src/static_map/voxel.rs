//! One voxel's sum of points.

use nalgebra::Point3;

use super::changes::Told;
use super::evidence::Evidence;

/// The sums count in units of 2^-60 m: every 32-bit coordinate of 2^-37 m or more is a whole number of
/// them, so that sums are exact and do not depend on their order. 2^67 m fit into 128 bits.
pub(super) const UNITS_PER_METRE: f64 = (1u64 << 60) as f64;

/// The points of one voxel, as much of them as their mean needs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct VoxelMean {
    sum_units: [i128; 3],
    points: u32,
    /// The cycle that touched the voxel last.
    pub(super) last_cycle: u32,
    /// What listeners know of the voxel.
    pub(super) told: Told,
    /// How sure it is that something stands there.
    pub(super) evidence: Evidence,
}

impl VoxelMean {
    /// Takes in a point whose coordinates are finite. Sums and count stop at the largest number rather
    /// than to turn around.
    pub(super) fn add(&mut self, point: &Point3<f32>) {
        for (sum, coordinate) in self.sum_units.iter_mut().zip(point.iter()) {
            // Rounded down as the grid does it, or the mean of points just below 0 would stand in the voxel
            // above. The cast saturates.
            let units = (f64::from(*coordinate) * UNITS_PER_METRE).floor() as i128;
            *sum = sum.saturating_add(units);
        }
        self.points = self.points.saturating_add(1);
    }

    /// The mean lies in the voxel of the points: each rounding on the way keeps the order of numbers, and the
    /// lowest and the highest of the points are 32-bit numbers themselves.
    pub(super) fn mean(&self) -> Point3<f32> {
        let units = f64::from(self.points.max(1)) * UNITS_PER_METRE;
        Point3::from(self.sum_units.map(|sum| (sum as f64 / units) as f32))
    }

    pub(super) fn points(&self) -> u32 {
        self.points
    }

    /// The sums along the axes, to be written.
    pub(super) fn sum_units(&self) -> [i128; 3] {
        self.sum_units
    }

    /// As it was written.
    pub(super) fn of(
        sum_units: [i128; 3],
        points: u32,
        last_cycle: u32,
        told: Told,
        evidence: Evidence,
    ) -> Self {
        Self { sum_units, points, last_cycle, told, evidence }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_voxel_is_exact() {
        let mut voxel = VoxelMean::default();
        for x in [0.1f32, 0.3, -7.5] {
            voxel.add(&Point3::new(x, 3.0e-9, -3.0e4));
        }
        let expected = (f64::from(0.1f32) + f64::from(0.3f32) - 7.5) / 3.0;
        assert_eq!(voxel.mean(), Point3::new(expected as f32, 3.0e-9, -3.0e4));
        assert_eq!(voxel.points(), 3);
    }

    #[test]
    fn coordinates_beyond_all_measure_do_no_harm() {
        let mut voxel = VoxelMean::default();
        for _ in 0..3 {
            voxel.add(&Point3::new(f32::MAX, f32::MIN, 1.0));
        }
        assert!(voxel.mean().iter().all(|coordinate| coordinate.is_finite()));
        assert_eq!(voxel.mean().z, 1.0);
    }
}
