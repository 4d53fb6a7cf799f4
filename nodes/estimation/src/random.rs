//! Random numbers that a seed decides.
//!
//! Sample consensus draws from them, and tests draw noise: the numbers must be the same on every machine and with every
//! version of every package. So the generator is a published one of a few lines, held by its test vector, and a normal
//! number is a sum of uniform ones, which every machine adds up alike. Packages give neither: `rand` and `rand_distr` keep
//! the right to change the values of a seed, and a normal number computed by a logarithm depends on the platform's
//! mathematical library.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};

/// 2^64 divided by the golden ratio, made odd: the step between counters (Steele et al. 2014).
pub const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014, with Stafford's constants): every bit of a counter decides about
/// every bit of the result.
#[must_use]
pub const fn mixed(bits: u64) -> u64 {
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// SplitMix64 (Steele, Lea and Flood 2014): one addition and a few multiplications a number, and any seed will do.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// The numbers of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN_GAMMA);
        mixed(self.state)
    }

    /// In `[0, 1)`.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// In `[low, high)`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// A number below `bound`; 0 when there is none. The high half of a product (Lemire 2019): its bias, `bound` in 2^64,
    /// is nothing for the size of a set of matches.
    pub fn below(&mut self, bound: usize) -> usize {
        ((u128::from(self.bits()) * bound as u128) >> 64) as usize
    }

    /// Three different numbers below `bound`; `None` when there are fewer.
    pub fn three_below(&mut self, bound: usize) -> Option<[usize; 3]> {
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

    /// Of mean 0 and standard deviation 1: the sum of twelve uniform numbers less 6 (Irwin and Hall). Close to normal, and
    /// never beyond 6.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    /// A direction, every one as likely as any other, but for what [`Random::normal`] lacks.
    pub fn direction(&mut self) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal()).normalize()
    }

    /// A perturbation with these standard deviations of its three shifts and its three turns.
    pub fn perturbation(&mut self, std_dev_m: f64, std_dev_rad: f64) -> Vector6<f64> {
        Vector6::from_fn(|row, _| self.normal() * if row < 3 { std_dev_m } else { std_dev_rad })
    }

    /// A motion of just this length and this angle.
    pub fn motion(&mut self, shift_m: f64, turn_rad: f64) -> Isometry3<f64> {
        let shift = shift_m * self.direction();
        let turn = turn_rad * self.direction();
        Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_sequence() {
        // The first numbers of the authors' program for the seed 1234567.
        let mut random = Random::new(1_234_567);
        assert_eq!(random.bits(), 6_457_827_717_110_365_317);
        assert_eq!(random.bits(), 3_203_168_211_198_807_973);
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

    #[test]
    fn normal_numbers_have_mean_0_and_deviation_1_and_belong_to_their_seed() {
        let numbers = |seed| -> Vec<f64> {
            let mut random = Random::new(seed);
            (0..100_000).map(|_| random.normal()).collect()
        };
        let drawn = numbers(1);
        let count = drawn.len() as f64;
        let mean = drawn.iter().sum::<f64>() / count;
        let variance = drawn.iter().map(|number| (number - mean).powi(2)).sum::<f64>() / count;
        assert!(mean.abs() < 0.01 && (variance - 1.0).abs() < 0.02, "{mean} {variance}");
        // 4.55 % of normal numbers are beyond two standard deviations.
        let beyond = drawn.iter().filter(|number| number.abs() > 2.0).count() as f64 / count;
        assert!((beyond - 0.0455).abs() < 0.003, "{beyond}");
        assert!(numbers(1) == drawn && numbers(2) != drawn);
    }

    #[test]
    fn of_three_three_are_drawn() {
        let mut three = Random::new(8).three_below(3).unwrap();
        three.sort_unstable();
        assert_eq!(three, [0, 1, 2]);
    }

    #[test]
    fn a_perturbation_has_its_deviations_and_a_motion_its_length_and_angle() {
        let mut random = Random::new(9);
        let mut squares = Vector6::<f64>::zeros();
        for _ in 0..10_000 {
            squares += random.perturbation(0.2, 0.03).map(|value| value * value) / 10_000.0;
        }
        let expected = Vector6::new(0.2, 0.2, 0.2, 0.03, 0.03, 0.03);
        let shares = squares.map(f64::sqrt).component_div(&expected);
        assert!(shares.iter().all(|share| (share - 1.0).abs() < 0.03), "{shares}");
        let motion = random.motion(1.5, 0.4);
        assert!((motion.translation.vector.norm() - 1.5).abs() < 1e-12);
        assert!((motion.rotation.angle() - 0.4).abs() < 1e-12);
    }
}
