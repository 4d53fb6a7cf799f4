//! The detector as a whole.

mod accuracy;
mod any_input;
mod invariance;
mod kernels;
mod look;
mod noise;
