//! Noise as a function of its use, not of the order of calls.
//!
//! Every reading uses the noise of (seed, stream, frame, index); two readings never share a state,
//! so frames can be computed in any order, or only some of them, with the same result. The bits come
//! from the finaliser of SplitMix64 (Steele, Lea and Flood 2014, with Stafford's constants), one
//! multiplication chain a pixel: a cipher a pixel would cost more than casting the ray.

use estimation::random::{GOLDEN_GAMMA, mixed};

/// The use of the noise: the streams of one seed are independent of each other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Stream {
    /// The error of a depth pixel, and whether it returns anything.
    DepthPixel = 1,
    /// The error of a beam's range, and whether it returns anything.
    BeamRange = 2,
    /// The offset of a beam within its step of azimuth.
    BeamAzimuth = 3,
    /// The jitter of the start of a scanner's revolution.
    TurnStart = 4,
    /// The error of a pose.
    Pose = 5,
    /// The delay of a scan's stamp.
    ScanStamp = 6,
    /// The delay of an image's stamp.
    ImageStamp = 7,
    /// The variation between the runs of one experiment.
    Variation = 8,
    /// The error of a sensor's mount.
    Mounting = 9,
    /// The electrons of a channel of a colour pixel.
    ColourPixel = 10,
    /// The phases of a hand's tremor.
    Tremor = 11,
    /// The variation of the paths for odometry between seeds.
    Way = 12,
    /// The noise of an inertial reading.
    ImuReading = 13,
    /// The random walk of an IMU's biases.
    ImuBias = 14,
    /// The errors of a step of the wheels.
    WheelStep = 15,
    /// The error of the size of the wheels.
    WheelScale = 16,
    /// The error of a range of a 3D scanner, and whether anything returns.
    VelodyneRange = 17,
}

/// The noise of one frame of one stream.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameNoise {
    key: u64,
}

impl FrameNoise {
    pub(crate) fn new(seed: u64, stream: Stream, frame: u64) -> Self {
        let stream_key = mixed(seed ^ mixed((stream as u64).wrapping_mul(GOLDEN_GAMMA)));
        Self { key: mixed(stream_key.wrapping_add(frame.wrapping_mul(GOLDEN_GAMMA))) }
    }

    /// 64 bits for the reading `index` of this frame.
    pub(crate) fn draw(&self, index: usize) -> Draw {
        Draw(mixed(
            self.key.wrapping_add((index as u64).wrapping_add(1).wrapping_mul(GOLDEN_GAMMA)),
        ))
    }
}

/// The bits of one reading: one normal and one uniform number, independent of each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw(u64);

impl Draw {
    /// A number of mean 0 and standard deviation 1, close to normal and never beyond 3.47: the sum of four
    /// uniform ones (Irwin-Hall), from the lower 48 bits.
    pub(crate) fn normal(self) -> f32 {
        const LANE: u64 = 0xfff;
        const MEAN: f32 = 4.0 * 2047.5;
        /// sqrt(4 * (4096^2 - 1) / 12)
        const STD_DEV: f32 = 2_364.826_5;
        let sum =
            (self.0 & LANE) + (self.0 >> 12 & LANE) + (self.0 >> 24 & LANE) + (self.0 >> 36 & LANE);
        (sum as f32 - MEAN) / STD_DEV
    }

    /// A number in `[0, 1)` in steps of 2^-16, from the upper 16 bits.
    pub(crate) fn uniform(self) -> f32 {
        (self.0 >> 48) as f32 / 65_536.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(values: &[f64]) -> (f64, f64) {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance =
            values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64;
        (mean, variance)
    }

    #[test]
    fn draws_have_the_moments_they_promise() {
        let noise = FrameNoise::new(7, Stream::DepthPixel, 3);
        let normals: Vec<f64> =
            (0..200_000).map(|index| f64::from(noise.draw(index).normal())).collect();
        let (mean, variance) = moments(&normals);
        assert!(mean.abs() < 0.01, "mean {mean}");
        assert!((variance - 1.0).abs() < 0.02, "variance {variance}");
        let uniforms: Vec<f64> =
            (0..200_000).map(|index| f64::from(noise.draw(index).uniform())).collect();
        let (mean, variance) = moments(&uniforms);
        assert!((mean - 0.5).abs() < 0.004, "mean {mean}");
        assert!((variance - 1.0 / 12.0).abs() < 0.002, "variance {variance}");
    }

    #[test]
    fn neighbouring_readings_frames_seeds_and_streams_are_uncorrelated() {
        let series = |seed, stream, frame, first: usize| -> Vec<f64> {
            let noise = FrameNoise::new(seed, stream, frame);
            (first..first + 100_000).map(|i| f64::from(noise.draw(i).normal())).collect()
        };
        let base = series(1, Stream::DepthPixel, 0, 0);
        for other in [
            series(1, Stream::DepthPixel, 0, 1),
            series(1, Stream::DepthPixel, 1, 0),
            series(2, Stream::DepthPixel, 0, 0),
            series(1, Stream::BeamRange, 0, 0),
        ] {
            let correlation =
                base.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / base.len() as f64;
            assert!(correlation.abs() < 0.015, "correlation {correlation}");
        }
    }
}
