//! Images as features are found in.

mod blur;
mod gray;
mod resample;

pub use blur::blurred;
pub(crate) use blur::{Blur, blur_rows};
pub use gray::{GrayImage, GraySizeError};
pub(crate) use resample::Resampler;
