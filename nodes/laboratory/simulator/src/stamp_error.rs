//! Clocks that are not quite right.

use serde::{Deserialize, Serialize};

use crate::noise::{FrameNoise, Stream};

/// How the stamps of a sensor deviate from the moments at which it measured, on the clock of the poses.
/// Poses and the truth of a reading are those of the moment itself.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StampError {
    /// Every stamp is later by this much; earlier when negative.
    pub skew_s: f64,
    /// Standard deviation of a stamp around that: the driver's and the computer's delays. At most a tenth of
    /// the sensor's period, so that stamps stay in their order.
    pub jitter_s: f64,
}

impl StampError {
    /// How late the stamp of a frame is, in seconds.
    pub(crate) fn at(&self, seed: u64, stream: Stream, frame: u64) -> f64 {
        let draw = FrameNoise::new(seed, stream, frame).draw(0);
        self.skew_s + self.jitter_s * f64::from(draw.normal())
    }
}
