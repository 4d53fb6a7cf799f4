//! The noise of depth.

use serde::{Deserialize, Serialize};

/// The standard deviation of a depth: `base_m + quadratic_per_m * depth_m^2`.
///
/// Of structured light and stereo it grows with the square of the depth, since disparity has a fixed resolution (Khoshelham
/// and Elberink, "Accuracy and resolution of Kinect depth data for indoor mapping applications", Sensors 12, 2012, eq. 10 and
/// figure 8); of times of flight it hardly grows.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct DepthNoise {
    /// At the camera.
    pub base_m: f32,
    /// What the square of the depth adds.
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
