//! `stillmap import`: recorded data sets become bags.

mod depth;
mod depth_png;
mod scan_cut;
mod tum;

use clap::Subcommand;

use crate::failure::{Failure, Outcome};

/// What to import.
#[derive(Subcommand, Debug)]
pub(crate) enum ImportArgs {
    /// A TUM RGB-D sequence: colour, depth and motion-capture poses
    Tum(tum::TumArgs),
    /// Numbered 16-bit depth pictures of a camera that stands still
    Depth(depth::DepthArgs),
}

/// Runs `stillmap import`.
pub(crate) fn run(args: ImportArgs) -> Result<Outcome, Failure> {
    match args {
        ImportArgs::Tum(args) => tum::import(&args),
        ImportArgs::Depth(args) => depth::import(&args),
    }
}
