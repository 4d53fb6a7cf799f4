//! Images as features are found in.

mod blur;
mod gray;
mod resample;

pub(crate) use blur::{Blur, blur_rows};
pub use blur::blurred;
pub use gray::{GrayImage, GraySizeError};
pub(crate) use resample::Resampler;
