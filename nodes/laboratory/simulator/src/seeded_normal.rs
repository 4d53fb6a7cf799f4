//! Noise one number after the other, for tests that make readings of their own.

/// Numbers of mean 0 and deviation 1, always the same (a linear congruential generator: 12 uniform numbers, less 6).
#[derive(Clone, Debug)]
pub struct SeededNormal(u64);

impl SeededNormal {
    /// The numbers of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    /// The next number.
    pub fn draw(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    fn uniform(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_of_mean_0_and_deviation_1_and_those_of_their_seed() {
        let numbers = |seed| -> Vec<f64> {
            let mut normal = SeededNormal::new(seed);
            (0..100_000).map(|_| normal.draw()).collect()
        };
        let drawn = numbers(1);
        let count = drawn.len() as f64;
        let mean = drawn.iter().sum::<f64>() / count;
        let variance = drawn.iter().map(|number| (number - mean).powi(2)).sum::<f64>() / count;
        assert!(mean.abs() < 0.01 && (variance - 1.0).abs() < 0.02, "{mean} {variance}");
        assert!(numbers(1) == drawn && numbers(2) != drawn);
    }
}
