//! The noise of depth.

use serde::{Deserialize, Serialize};

/// The standard deviation of a depth: `base_m + quadratic_per_m * depth_m^2`.
///
/// With structured light and stereo it grows with the square of the depth, since disparity has a fixed resolution (Khoshelham
/// and Elberink, "Accuracy and resolution of Kinect depth data for indoor mapping applications", Sensors 12, 2012, eq. 10 and
/// figure 8); with time of flight it hardly grows.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct DepthNoise {
    /// At depth 0.
    pub base_m: f32,
    /// The factor of the square of the depth.
    pub quadratic_per_m: f32,
}

impl Default for DepthNoise {
    /// The Kinect's: 1.4 mm at 1 m.
    fn default() -> Self {
        Self { base_m: 0.0005, quadratic_per_m: 1.425e-3 }
    }
}

impl DepthNoise {
    /// The standard deviation at a depth, in metres.
    #[must_use]
    #[inline(always)]
    pub fn sigma_m(&self, depth_m: f32) -> f32 {
        self.base_m + self.quadratic_per_m * depth_m * depth_m
    }
}

/// The weight of a depth without noise.
pub(crate) const FULL_WEIGHT: f32 = 255.0;
/// The effect of the pose's error at the surface: more precise depths get no larger weight.
const POSE_SIGMA_M: f32 = 0.003;
/// The standard deviation of a position within a pixel, in pixels: that of a uniform distribution.
const IN_PIXEL: f32 = 0.289;

/// The weight of a depth, from 1 to 255: inverse to its variance. At a grazing angle or at an edge the unknown position within
/// the pixel adds to the variance: to the next pixel the depth changes by `slope_m`.
#[inline(always)]
pub(crate) fn weight_of(depth_m: f32, slope_m: f32, noise: &DepthNoise) -> u32 {
    const POSE_VARIANCE: f32 = POSE_SIGMA_M * POSE_SIGMA_M;
    let (sigma_m, in_pixel_m) = (noise.sigma_m(depth_m), IN_PIXEL * slope_m);
    let variance = sigma_m * sigma_m + in_pixel_m * in_pixel_m;
    let weight = FULL_WEIGHT * POSE_VARIANCE / (POSE_VARIANCE + variance);
    crate::projection::nearest(weight.max(1.0))
}
