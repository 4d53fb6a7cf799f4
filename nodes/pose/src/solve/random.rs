//! Random choices that a seed decides.

/// SplitMix64 (Steele, Lea and Flood 2014): one addition and a few multiplications a number, and any seed will do.
#[derive(Clone, Debug)]
pub(crate) struct Random {
    state: u64,
}

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A number below `bound`; 0 when there is none. The high half of a product (Lemire 2019): its bias, `bound` in 2^64,
    /// is nothing for the size of a set of matches.
    pub(crate) fn below(&mut self, bound: usize) -> usize {
        ((u128::from(self.next()) * bound as u128) >> 64) as usize
    }

    /// Three different numbers below `bound`; `None` when there are not so many.
    pub(crate) fn three_below(&mut self, bound: usize) -> Option<[usize; 3]> {
        if bound < 3 {
            return None;
        }
        // The second is drawn among those that are left, and so is the third (Floyd's sampling).
        let first = self.below(bound);
        let mut second = self.below(bound - 1);
        second += usize::from(second >= first);
        let mut third = self.below(bound - 2);
        for taken in [first.min(second), first.max(second)] {
            third += usize::from(third >= taken);
        }
        Some([first, second, third])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_sequence() {
        // The first numbers of the authors' program for the seed 1234567.
        let mut random = Random::new(1_234_567);
        assert_eq!(random.next(), 6_457_827_717_110_365_317);
        assert_eq!(random.next(), 3_203_168_211_198_807_973);
    }

    #[test]
    fn every_three_are_drawn_alike() {
        let mut random = Random::new(7);
        let mut counts = std::collections::BTreeMap::new();
        for _ in 0..60_000 {
            let three = random.three_below(5).unwrap();
            assert!(three.iter().all(|index| *index < 5));
            *counts.entry(three).or_insert(0) += 1;
        }
        assert_eq!(counts.len(), 60);
        assert!(counts.values().all(|count| (800..1200).contains(count)), "{counts:?}");
        assert_eq!(random.three_below(2), None);
    }
}
