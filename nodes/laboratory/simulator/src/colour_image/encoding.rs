//! sRGB.

/// Steps of the table: even the steepest part of the curve rises by less than one value per step.
const STEPS: usize = 4096;

/// The sRGB value of each brightness (IEC 61966-2-1).
#[derive(Clone, Debug)]
pub(super) struct SrgbTable(Vec<u8>);

impl SrgbTable {
    pub(super) fn new() -> Self {
        let shade = |step: usize| {
            let linear = step as f64 / (STEPS - 1) as f64;
            let encoded = if linear <= 0.003_130_8 {
                12.92 * linear
            } else {
                1.055 * linear.powf(1.0 / 2.4) - 0.055
            };
            (encoded * 255.0).round() as u8
        };
        Self((0..STEPS).map(shade).collect())
    }

    /// The sRGB value of a brightness; below 0 is black, above 1 white.
    pub(super) fn encode(&self, linear: f32) -> u8 {
        // The cast saturates at 0, and NaN becomes 0.
        let step = (linear * (STEPS - 1) as f32 + 0.5) as usize;
        self.0.get(step).copied().unwrap_or(u8::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shades_are_those_of_the_standard() {
        let table = SrgbTable::new();
        let shades = [-1.0, 0.0, 0.214, 0.5, 1.0, 7.0, f32::NAN].map(|linear| table.encode(linear));
        assert_eq!(shades, [0, 0, 127, 188, 255, 255, 0]);
    }
}
