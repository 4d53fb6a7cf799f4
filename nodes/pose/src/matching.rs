//! Which feature of one image is which of another.

mod lines;

pub use lines::{
    DirectionBins, LineMatch, LineMatchConfig, LineMatchConfigError, ProjectedLine, match_lines,
    match_projected_lines,
};
