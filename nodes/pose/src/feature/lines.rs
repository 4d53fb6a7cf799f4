//! Line segments.

mod anchor;
mod config;
mod detector;
mod false_alarms;
mod gradient;
mod growing;
mod merging;
mod moments;
mod routing;
mod segment;

pub use config::{LineConfig, LineConfigError};
pub use detector::{LineDetector, LineStep};
pub use segment::LineSegment;
