//! The evidence that a block is occupied: clamped log-odds.

/// The log-odds of OctoMap's probabilities, in steps of 0.05: in these a bounded sum fits into a byte. A test compares them
/// with the probabilities.
const HIT: i8 = 17;
const MISS: i8 = 8;
const BLANK: i8 = 4;
const MOST: i8 = 70;

/// Log-odds by the sensor model of OctoMap (Hornung et al., "OctoMap: an efficient probabilistic 3D mapping framework based
/// on octrees", Autonomous Robots 34, 2013, section 5.1 and eq. 2 to 4): an image that shows the surface adds `l(0.7) = 0.85`,
/// one that shows its place free subtracts `-l(0.4) = 0.4`, and the sum is clamped to `l(0.97) = 3.5`, so that the evidence
/// does not grow without bound. Below `l(0.5) = 0` the surface is removed.
///
/// After `n` images in a row that show it, it is removed by `floor(0.85 n / 0.4) + 1` that show its place free: 3, 5, 7, 9 for
/// `n` = 1 .. 4, and 9 for all `n` above. A surface that is seen in one of three images, and free in the others, stays.
///
/// An image without a return from its direction subtracts half of that, `-l(0.45) = 0.2`: a dark, slanted or distant surface
/// may be seen only in some images. One that is seen in one of five images stays; one that was seen in five needs 18.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub(crate) struct Evidence(i8);

impl Evidence {
    /// An image shows it.
    pub(crate) fn hit(&mut self) {
        self.0 = self.0.saturating_add(HIT).min(MOST);
    }

    /// An image shows that its place is free. Returns whether it is kept.
    pub(crate) fn miss(&mut self) -> bool {
        self.0 = self.0.saturating_sub(MISS);
        self.0 >= 0
    }

    /// There is no return from its direction, where there was one before. Returns whether it is kept.
    pub(crate) fn blank(&mut self) -> bool {
        // No lower: it may have to be missed for longer, and the next image that shows it says that it is there.
        self.0 = self.0.saturating_sub(BLANK).max(-BLANK);
        self.0 >= 0
    }

    /// The log-odds in steps of 0.05, for storage.
    pub(crate) fn steps(self) -> i8 {
        self.0
    }

    /// From the stored steps.
    pub(crate) fn of_steps(steps: i8) -> Self {
        Self(steps.min(MOST))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steps_are_those_of_the_probabilities() {
        for (steps, probability) in [(HIT, 0.7), (-MISS, 0.4), (-BLANK, 0.45), (MOST, 0.97_f64)] {
            let log_odds = (probability / (1.0 - probability)).ln();
            assert!((f64::from(steps) / 20.0 - log_odds).abs() <= 0.025, "{steps} steps");
        }
    }

    #[test]
    fn it_takes_more_misses_the_more_hits_there_were_up_to_nine() {
        for (hits, expected) in [(1, 3), (2, 5), (3, 7), (4, 9), (5, 9), (10_000, 9)] {
            let mut evidence = Evidence::default();
            (0..hits).for_each(|_| evidence.hit());
            let mut misses = 1;
            while evidence.miss() {
                misses += 1;
            }
            assert_eq!(misses, expected, "{hits} hits");
        }
    }
}
