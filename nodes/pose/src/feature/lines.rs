//! Line segments: EDLines (Akinlar and Topal 2011) on Edge Drawing (Topal and Akinlar 2012), with differences that are
//! named where they are; their binary descriptors (after Zhang and Koch 2013); and where they lie in space by depth.
//!
//! | module | step | source |
//! |---|---|---|
//! | `gradient` | smoothing by a 5 x 5 kernel of 1 pixel's deviation, Sobel operator | Edge Drawing, steps 1 and 2 |
//! | `anchor` | where edges are drawn from: maxima of the gradient across the edge | Edge Drawing, step 3 |
//! | `routing` | edges drawn along the ridge, the brighter side on the left | Edge Drawing, step 4 |
//! | `growing` | points between pixels, and straight parts of an edge by least squares | EDLines |
//! | `false_alarms` | how many segments as well aligned noise would have | EDLines |
//! | `merging` | parts of one line, joined where the whole is less likely by chance | |
//! | `descriptor` | 256 bits on the surroundings | Zhang and Koch 2013 |
//! | `in_space` | the line in the camera frame, by a depth image | |
//!
//! # How well
//!
//! 32 images of York Urban, all but the first row by OpenCV 5.0 with its defaults. The example `york_urban` defines the
//! measure and prints the figures; the times of the others are `time.thread_time` of the Python that it names, taken in
//! turn with ours: one thread, the least of ten rounds, the median of the images.
//!
//! | detector | recall | with 2 px of slack | segments an image | mean length | processor time |
//! |---|---|---|---|---|---|
//! | this | 0.828 | 0.846 | 492 | 60 px | 5.5 ms |
//! | EDLines | 0.763 | 0.796 | 738 | 32 px | 6.1 ms |
//! | LSD | 0.714 | 0.758 | 924 | 24 px | 18 ms |
//! | fast line detector | 0.748 | 0.785 | 938 | 27 px | 8.7 ms |
//!
//! Its limit is a single scale. A segment seen from half the distance is found, but its descriptor differs.

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

pub use config::LineConfig;
pub use descriptor::{LineDescriptor, LineFeature};
pub use detector::{LineDetector, LineStep};
pub use in_space::{
    DepthSensor, NoLineInSpace, SegmentDepthConfig, SegmentInSpace, segment_in_space,
};
pub use segment::LineSegment;
