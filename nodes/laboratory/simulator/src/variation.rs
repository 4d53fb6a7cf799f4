//! The variation between the runs of one experiment.

use crate::noise::{FrameNoise, Stream};

/// Random draws for one moving object, a function of seed, object and quantity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variation {
    noise: FrameNoise,
}

/// The quantity.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Quantity {
    Speed,
    Offset,
    Start,
    Direction,
    GaitPhase,
    Height,
    ImagePhase,
    PlaceOfPause,
}

impl Variation {
    /// The id of the platform; objects have their own ids.
    pub(crate) const PLATFORM: u16 = 0;

    pub(crate) fn new(seed: u64, thing: u16) -> Self {
        Self { noise: FrameNoise::new(seed, Stream::Variation, u64::from(thing)) }
    }

    /// Within `[0, 1)`.
    pub(crate) fn unit(&self, quantity: Quantity) -> f64 {
        f64::from(self.noise.draw(quantity as usize).uniform())
    }

    /// Within `[-1, 1)`.
    pub(crate) fn symmetric(&self, quantity: Quantity) -> f64 {
        2.0 * self.unit(quantity) - 1.0
    }

    /// 1 or -1.
    pub(crate) fn side(&self, quantity: Quantity) -> f64 {
        if self.unit(quantity) < 0.5 { 1.0 } else { -1.0 }
    }
}
