//! Which corner of one image is which of another, by their descriptors.
//!
//! | function | when |
//! |---|---|
//! | [`match_all`] | nothing is known: each with each |
//! | [`match_guided`] | it is known about where each should appear: only those near by |

mod config;
mod exhaustive;
mod grid;
mod guided;
mod rotation;
#[cfg(test)]
mod tests;

pub use config::MatchConfig;
pub use exhaustive::match_all;
pub use grid::CornerGrid;
pub use guided::{GuidedConfig, PredictedCorner, match_guided};

/// Two corners that are taken for the same.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PointMatch {
    /// Which of the corners (or predictions) that were looked for.
    pub sought: usize,
    /// Which of the corners that they were looked for among.
    pub found: usize,
    /// In how many bits their descriptors differ.
    pub distance: u32,
}
