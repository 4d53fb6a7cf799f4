//! `stillmap eval`: scores of results against a reference.

mod map;
mod scans;

use clap::Subcommand;

use crate::failure::{Failure, Outcome};

/// What is scored.
#[derive(Subcommand, Debug)]
pub(crate) enum EvalArgs {
    /// A map against the empty scene: correlation by localised views, accuracy, completeness, F-score
    Map(map::MapArgs),
    /// Detection on scans alone: zones where labelled legs move, and where nobody is
    Scans(scans::ScansArgs),
}

pub(crate) fn run(args: &EvalArgs) -> Result<Outcome, Failure> {
    match args {
        EvalArgs::Map(args) => map::run(args),
        EvalArgs::Scans(args) => scans::run(args),
    }
}
