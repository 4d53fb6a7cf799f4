//! Images as features are found in.

mod gray;

pub use gray::{GrayImage, GraySizeError};
