//! Errors of clocks and stamps.

use serde::{Deserialize, Serialize};

use crate::noise::{FrameNoise, Stream};

/// The errors of the stamps of a sensor against the time of measurement on the clock of the poses.
/// Poses and the ground truth of a reading are those of the time of measurement.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StampError {
    /// The constant delay of stamps; negative when they are early.
    pub skew_s: f64,
    /// Standard deviation of a stamp around that: the driver's and the computer's delays. At most a tenth of
    /// the sensor's period, so that stamps stay in their order.
    pub jitter_s: f64,
}

impl StampError {
    /// The delay of the stamp of a frame, in seconds.
    pub(crate) fn at(&self, seed: u64, stream: Stream, frame: u64) -> f64 {
        let draw = FrameNoise::new(seed, stream, frame).draw(0);
        self.skew_s + self.jitter_s * f64::from(draw.normal())
    }
}
