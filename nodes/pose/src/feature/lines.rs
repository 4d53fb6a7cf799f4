//! Line segments.

mod anchor;
mod config;
mod descriptor;
mod detector;
mod false_alarms;
mod gradient;
mod growing;
mod in_space;
mod merging;
mod moments;
mod routing;
mod segment;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub use config::{LineConfig, LineConfigError};
pub use descriptor::{LineDescriptor, LineFeature};
pub use detector::{LineDetector, LineStep};
pub use in_space::{
    NoLineInSpace, SegmentDepthConfig, SegmentDepthConfigError, SegmentInSpace, segment_in_space,
};
pub use segment::LineSegment;
