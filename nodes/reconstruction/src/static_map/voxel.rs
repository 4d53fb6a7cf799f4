//! One voxel's sum of points.

use nalgebra::Point3;

use super::anchor::Anchor;
use super::changes::Told;

/// The sums count in units of 2^-60 m: every 32-bit coordinate of 2^-37 m or more is a whole number of
/// them, so that sums are exact and do not depend on their order. 2^67 m fit into 128 bits.
const UNITS_PER_METRE: f64 = (1u64 << 60) as f64;

/// Sums along the axes. Packed, so that what else is known of a voxel fits beside.
#[derive(Clone, Copy, Debug, Default)]
#[repr(Rust, packed(4))]
struct Sums([i128; 3]);

/// The points of one voxel, as much of them as their mean needs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct VoxelMean {
    sums: Sums,
    points: u32,
    /// The cycle that touched the voxel last.
    pub(super) last_cycle: u32,
    /// What listeners know of the voxel.
    pub(super) told: Told,
    /// With which part of the trajectory it moves.
    pub(super) anchor: Anchor,
}

impl VoxelMean {
    /// Without a point yet.
    pub(super) fn new(anchor: Anchor) -> Self {
        Self { anchor, ..Self::default() }
    }

    /// Takes in a point whose coordinates are finite. Sums and count stop at the largest number rather
    /// than to turn around.
    pub(super) fn add(&mut self, point: &Point3<f32>) {
        self.add_times(point, 1);
    }

    fn add_times(&mut self, point: &Point3<f32>, times: u32) {
        let Sums(mut sums) = self.sums;
        for (sum, coordinate) in sums.iter_mut().zip(point.iter()) {
            // Rounded down as the grid does it, or the mean of points just below 0 would stand in the voxel
            // above. The cast saturates.
            let units = (f64::from(*coordinate) * UNITS_PER_METRE).floor() as i128;
            *sum = sum.saturating_add(units.saturating_mul(i128::from(times)));
        }
        self.sums = Sums(sums);
        self.points = self.points.saturating_add(times);
    }

    /// All its points where `point` is, whose coordinates are finite. Nobody has been told of it there.
    pub(super) fn moved_to(&self, point: &Point3<f32>) -> Self {
        let mut moved = Self { sums: Sums::default(), points: 0, told: Told::default(), ..*self };
        moved.add_times(point, self.points);
        moved
    }

    /// Takes in another voxel that has come to the same place. In whatever order they come, the outcome is the same; the
    /// anchor stays. Nobody has been told of the outcome.
    pub(super) fn merge(&mut self, other: &Self) {
        let (Sums(mut sums), Sums(others)) = (self.sums, other.sums);
        for (sum, other) in sums.iter_mut().zip(others) {
            *sum = sum.saturating_add(other);
        }
        self.sums = Sums(sums);
        self.points = self.points.saturating_add(other.points);
        self.last_cycle = self.last_cycle.max(other.last_cycle);
        self.told = Told::default();
    }

    /// The mean lies in the voxel of the points: each rounding on the way keeps the order of numbers, and the
    /// lowest and the highest of the points are 32-bit numbers themselves.
    pub(super) fn mean(&self) -> Point3<f32> {
        let Sums(sums) = self.sums;
        let units = f64::from(self.points.max(1)) * UNITS_PER_METRE;
        Point3::from(sums.map(|sum| (sum as f64 / units) as f32))
    }

    pub(super) fn points(&self) -> u32 {
        self.points
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
