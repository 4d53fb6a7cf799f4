//! How far the truth may be from what was predicted (KISS-ICP, Vizzo et al. 2023, section III.D).

use nalgebra::Isometry3;

/// Correspondences reach this many deviations (eq. 6).
const REACH_DEVIATIONS: f64 = 3.0;
/// ... and are doubted from this share of one on (eq. 7).
const KERNEL_WIDTH_SHARE: f64 = 1.0 / 3.0;

/// The standard deviation of the predictions so far.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct AdaptiveThreshold {
    min_deviation_m: f64,
    max_range_m: f64,
    squares_m2: f64,
    count: f64,
}

impl AdaptiveThreshold {
    pub(super) fn new(first_deviation_m: f64, min_deviation_m: f64, max_range_m: f64) -> Self {
        Self {
            min_deviation_m,
            max_range_m,
            squares_m2: first_deviation_m * first_deviation_m,
            count: 1.0,
        }
    }

    /// Takes in by how much a prediction was off, at the farthest point (eq. 4 and 5).
    pub(super) fn take_in(&mut self, predicted: &Isometry3<f64>, found: &Isometry3<f64>) {
        let between = predicted.inv_mul(found);
        let turn_m = 2.0 * self.max_range_m * (0.5 * between.rotation.angle()).sin();
        let deviation_m = turn_m + between.translation.vector.norm();
        if deviation_m > self.min_deviation_m {
            self.squares_m2 += deviation_m * deviation_m;
            self.count += 1.0;
        }
    }

    /// Points farther apart do not correspond.
    pub(super) fn reach_m(&self) -> f64 {
        REACH_DEVIATIONS * self.deviation_m()
    }

    /// From this distance on they are doubted.
    pub(super) fn kernel_width_m(&self) -> f64 {
        KERNEL_WIDTH_SHARE * self.deviation_m()
    }

    fn deviation_m(&self) -> f64 {
        (self.squares_m2 / self.count).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn good_predictions_narrow_it_and_no_motion_changes_nothing() {
        let mut threshold = AdaptiveThreshold::new(2.0, 0.1, 100.0);
        assert_eq!((threshold.reach_m(), threshold.kernel_width_m()), (6.0, 2.0 / 3.0));
        let identity = Isometry3::identity();
        threshold.take_in(&identity, &Isometry3::translation(0.09, 0.0, 0.0));
        assert_eq!(threshold.reach_m(), 6.0);
        for _ in 0..99 {
            threshold.take_in(&identity, &Isometry3::new(Vector3::x() * 0.1, Vector3::z() * 0.001));
        }
        assert!((threshold.reach_m() - 3.0 * (4.0_f64 / 100.0 + 0.99 * 0.04).sqrt()).abs() < 1e-4);
    }
}
