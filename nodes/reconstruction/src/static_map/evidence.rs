//! How sure it is that something stands in a voxel: clamped log-odds.

/// The log-odds of OctoMap's probabilities, in steps of 0.05: in these, a bounded sum fits into a byte. Taken as
/// numbers, since the logarithm is no constant expression; a test holds them against the probabilities.
const HIT: i8 = 17;
const MISS: i8 = 8;
const BLANK: i8 = 4;
const MOST: i8 = 70;

/// The evidence for a voxel: log-odds of its being occupied, by the sensor model of OctoMap (Hornung et al., "OctoMap:
/// an efficient probabilistic 3D mapping framework based on octrees", Autonomous Robots 34, 2013, section 5.1 and
/// eq. 2 to 4): a cycle in which a point falls into the voxel adds `l(0.7) = 0.85`, one in which a ray passes it takes
/// `-l(0.4) = 0.4`, and the sum is held at or below `l(0.97) = 3.5`, so that a voxel does not defend itself the
/// longer the longer it stood. Below `l(0.5) = 0` the voxel goes.
///
/// After `n` cycles that hit it in a row a voxel needs `floor(0.85 n / 0.4) + 1` cycles that pass it until it is gone:
/// 3, 5, 7, 9 for `n` = 1 .. 4, and 9 for all `n` above, where the clamp holds. A voxel that is hit in one of
/// three cycles, and passed in the other two, stays.
///
/// A cycle in which its direction is blank (module `blanks`) takes half of that, `-l(0.45) = 0.2`: a surface that is dark,
/// slants or is far away may be seen now and then. One that is hit in one of five cycles, and blank in the others, stays;
/// what was hit in five cycles or more needs 18 that are blank, 2.6 s of the RPLIDAR A1.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub(super) struct Evidence(i8);

impl Evidence {
    /// A point fell into the voxel in this cycle.
    pub(super) fn hit(&mut self) {
        self.0 = self.0.saturating_add(HIT).min(MOST);
    }

    /// A ray passed the voxel in this cycle. Returns whether the voxel is still there.
    pub(super) fn miss(&mut self) -> bool {
        self.0 = self.0.saturating_sub(MISS);
        self.0 >= 0
    }

    /// Nothing came back from the voxel's direction, where it was seen before. Returns whether it is still there.
    pub(super) fn blank(&mut self) -> bool {
        self.0 = self.0.saturating_sub(BLANK);
        self.0 >= 0
    }

    /// Two voxels have come to the same place: what was seen of one was seen of the other.
    pub(super) fn merge(&mut self, other: Self) {
        self.0 = self.0.saturating_add(other.0).min(MOST);
    }

    /// The log-odds in steps of 0.05, to be written.
    pub(super) fn steps(self) -> i8 {
        self.0
    }

    /// As it was written.
    pub(super) fn of_steps(steps: i8) -> Self {
        Self(steps.min(MOST))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS_PER_UNIT: f64 = 20.0;

    #[test]
    fn the_steps_are_those_of_the_probabilities() {
        for (steps, probability) in [(HIT, 0.7), (-MISS, 0.4), (-BLANK, 0.45), (MOST, 0.97_f64)] {
            let log_odds = (probability / (1.0 - probability)).ln();
            let error = (f64::from(steps) / STEPS_PER_UNIT - log_odds).abs();
            assert!(error <= 0.5 / STEPS_PER_UNIT, "{steps} steps are not {log_odds}");
        }
    }

    #[test]
    fn a_voxel_needs_more_passes_the_more_hits_it_had_up_to_nine() {
        for (hits, expected) in [(1, 3), (2, 5), (3, 7), (4, 9), (5, 9), (10_000, 9)] {
            let mut evidence = Evidence::default();
            (0..hits).for_each(|_| evidence.hit());
            let mut passes = 1;
            while evidence.miss() {
                passes += 1;
            }
            assert_eq!(passes, expected, "{hits} hits");
        }
    }

    #[test]
    fn one_hit_in_five_cycles_keeps_a_voxel_that_is_blank_in_the_others() {
        let mut evidence = Evidence::default();
        for _ in 0..10_000 {
            evidence.hit();
            assert!((0..4).all(|_| evidence.blank()));
        }
        let until_gone = (1..).find(|_| !evidence.blank());
        assert!(until_gone.is_some_and(|cycles| cycles <= 18));
    }

    #[test]
    fn one_hit_in_three_cycles_keeps_a_voxel() {
        let mut evidence = Evidence::default();
        for _ in 0..10_000 {
            evidence.hit();
            assert!(evidence.miss() && evidence.miss());
        }
    }
}
