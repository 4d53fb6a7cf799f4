//! `stillmap import`: recorded data sets become bags.

mod depth;
mod depth_png;
mod ros1;
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
    /// A bag of ROS 1
    Ros1(ros1::Ros1Args),
}

/// Runs `stillmap import`.
pub(crate) fn run(args: ImportArgs) -> Result<Outcome, Failure> {
    match args {
        ImportArgs::Tum(args) => tum::import(&args),
        ImportArgs::Depth(args) => depth::import(&args),
        ImportArgs::Ros1(args) => ros1::import(&args),
    }
}
