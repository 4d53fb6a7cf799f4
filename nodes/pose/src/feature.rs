//! What is found in an image.

mod lines;

pub use lines::{LineConfig, LineConfigError, LineDetector, LineSegment, LineStep};
