//! How well an estimated trajectory agrees with a reference: absolute and relative pose errors, the measure of
//! the KITTI odometry benchmark, and how much of the reference was covered at all.
//!
//! The measures are those of Sturm et al. 2012 (A Benchmark for the Evaluation of RGB-D SLAM Systems, section
//! IV), of Geiger et al. 2012 (Are we ready for Autonomous Driving?, section 3.2), and of Zhang and Scaramuzza
//! 2018 (A Tutorial on Quantitative Trajectory Evaluation). A tracker that stops when it is lost has small
//! errors where it still runs; therefore [`Coverage`] accompanies every error.
//!
//! No file access: parsers take text, and charts and pages are text too.

mod absolute;
mod alignment;
mod association;
mod charts;
mod coverage;
#[cfg(test)]
mod golden;
mod page;
mod parse;
mod path;
mod plane;
mod relative;
mod road;
mod score;
mod segments;
mod statistics;
#[cfg(test)]
mod testing;

pub use self::absolute::{AbsoluteScore, MatchedPose};
pub use self::alignment::{Alignment, AlignmentError, FoundAlignment};
pub use self::association::{AssociationConfig, AssociationSummary};
pub use self::charts::trajectory_charts;
pub use self::coverage::{Coverage, CoverageUnit, Gap};
pub use self::page::{TrajectoryPageFacts, trajectory_page};
pub use self::parse::{
    ParseError, ParsedTrajectory, TrajectoryFormat, parse_stamps, parse_trajectory,
};
pub use self::path::{LeftOut, RawPose, StampsError, Times, Trajectory};
pub use self::plane::Plane;
pub use self::relative::{Delta, DeltaUnit, Pairs, PairsFrom, RelativeConfig, RelativeScore};
pub use self::road::{RoadScore, road_score};
pub use self::score::{
    ScoredTrajectory, TrajectoryFacts, TrajectoryScore, TrajectoryScoreConfig,
    TrajectoryScoreError, score_trajectory,
};
pub use self::segments::{SegmentConfig, SegmentLengthScore, SegmentLengths, SegmentScore};
pub use self::statistics::Statistics;
