//! Images as features are found in.

mod blur;
mod gray;
mod raw;
mod rectification;
mod registration;
mod resample;

pub use blur::blurred;
pub(crate) use blur::{Blur, blur_rows};
pub use gray::{GrayImage, GraySizeError};
pub use raw::{
    BayerPattern, PixelEncoding, RawImage, RawImageError, UnknownEncoding, gray_from_raw,
};
pub use rectification::{Rectification, RectificationError};
pub use registration::{DepthRegistration, DepthRegistrationError};
pub(crate) use resample::Resampler;
