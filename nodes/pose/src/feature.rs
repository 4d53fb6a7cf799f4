//! What is found in an image.

mod lines;

pub use lines::{
    LineConfig, LineConfigError, LineDescriptor, LineDetector, LineFeature, LineSegment, LineStep,
    NoLineInSpace, SegmentDepthConfig, SegmentDepthConfigError, SegmentInSpace, segment_in_space,
};
