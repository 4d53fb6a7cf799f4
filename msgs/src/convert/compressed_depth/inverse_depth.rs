//! Inverse depth in 16 bits: finer the nearer the surface.

use crate::convert::CompressedImageError;

/// `depth_max` and `depth_quantization` of `compressed_depth_image_transport` where they are not set.
const USUAL_FARTHEST_M: f32 = 10.0;
const USUAL_QUANTISATION: f32 = 100.0;

/// How metres become 16 bits: a depth `d` is sent as `v = a / d + b`, rounded, and 0 means no
/// measurement. Depths are wrong by `d^2 / 2a` at most; those of `farthest_m` and beyond, and those too
/// near for 16 bits, are lost.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct InverseDepth {
    a: f32,
    b: f32,
}

impl InverseDepth {
    /// By the parameters `depth_max` (metres) and `depth_quantization` of
    /// `compressed_depth_image_transport`.
    ///
    /// # Errors
    /// When one of them is not finite and above 0.
    pub fn new(farthest_m: f32, quantisation: f32) -> Result<Self, CompressedImageError> {
        let a = quantisation * (quantisation + 1.0);
        let b = 1.0 - a / farthest_m;
        if quantisation > 0.0 && farthest_m > 0.0 {
            Self::from_header(a, b)
        } else {
            Err(CompressedImageError::Quantisation { a, b })
        }
    }

    /// By the two numbers of a message.
    pub(super) fn from_header(a: f32, b: f32) -> Result<Self, CompressedImageError> {
        // No finite depth comes out of others.
        if a.is_finite() && a > 0.0 && b.is_finite() {
            Ok(Self { a, b })
        } else {
            Err(CompressedImageError::Quantisation { a, b })
        }
    }

    /// The two numbers for a message.
    pub(super) fn header(self) -> [f32; 2] {
        [self.a, self.b]
    }

    /// The depth of a value; NaN for none.
    pub(super) fn metres(self, value: u16) -> f32 {
        let depth_m = self.a / (f32::from(value) - self.b);
        if value > 0 && depth_m.is_finite() && depth_m > 0.0 { depth_m } else { f32::NAN }
    }

    /// The value of a depth; 0 where there is none.
    pub(super) fn value(self, depth_m: f32) -> u16 {
        let value = (self.a / depth_m + self.b).round();
        // No range contains NaN.
        let fits = (1.0..=f32::from(u16::MAX)).contains(&value) && depth_m > 0.0;
        if fits { value as u16 } else { 0 }
    }
}

impl Default for InverseDepth {
    /// Up to 10 m, in steps of 0.1 mm at 1 m and of 5 mm at 7 m.
    fn default() -> Self {
        let a = USUAL_QUANTISATION * (USUAL_QUANTISATION + 1.0);
        Self { a, b: 1.0 - a / USUAL_FARTHEST_M }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_usual_parameters_are_those_of_the_transport() {
        assert_eq!(InverseDepth::default().header(), [10_100.0, -1009.0]);
        assert_eq!(InverseDepth::new(10.0, 100.0), Ok(InverseDepth::default()));
        for (farthest_m, quantisation) in
            [(0.0, 100.0), (-1.0, 100.0), (f32::NAN, 1.0), (10.0, 0.0), (10.0, -7.0), (1e-38, 1e30)]
        {
            let error = InverseDepth::new(farthest_m, quantisation).unwrap_err();
            assert!(matches!(error, CompressedImageError::Quantisation { .. }), "{error}");
        }
    }

    #[test]
    fn what_is_no_depth_or_does_not_fit_is_none() {
        let usual = InverseDepth::default();
        for depth_m in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 10.1, 0.15, 1e-30] {
            assert_eq!(usual.value(depth_m), 0, "{depth_m}");
        }
        assert_eq!((usual.value(10.0), usual.value(0.1518)), (1, 65_526));
        assert!(usual.metres(0).is_nan());
    }

    proptest! {
        #[test]
        fn depths_come_back_within_half_a_step(depth_m in 0.153_f32..9.9) {
            let usual = InverseDepth::default();
            let [a, _] = usual.header();
            let back_m = usual.metres(usual.value(depth_m));
            // Half a step, and what f32 rounds.
            let bound_m = depth_m * depth_m / (2.0 * a) * 1.01 + 1e-6 * depth_m;
            prop_assert!((back_m - depth_m).abs() <= bound_m, "{depth_m} became {back_m}");
        }

        #[test]
        fn every_value_comes_back(value in 1..=u16::MAX) {
            let usual = InverseDepth::default();
            prop_assert_eq!(usual.value(usual.metres(value)), value);
        }

        #[test]
        fn any_numbers_are_survived(bits in any::<[u32; 3]>(), value in any::<u16>()) {
            let [a, b, depth_m] = bits.map(f32::from_bits);
            if let Ok(inverse) = InverseDepth::from_header(a, b) {
                let back_m = inverse.metres(value);
                prop_assert!(back_m.is_nan() || (back_m.is_finite() && back_m > 0.0));
                let _ = inverse.value(depth_m);
            }
        }
    }
}
