//! `stillmap eval`: scores of results against a reference.

mod grid;
mod kitti;
pub(crate) mod map;
mod scans;
mod trajectory;
mod tum;

use clap::Subcommand;

use robot::{Failure, Outcome};

pub use grid::read_grid;

/// The kind of result.
#[derive(Subcommand, Debug)]
pub enum EvalArgs {
    /// An occupancy grid against the true floor plan of the simulated scene that it was made in
    Grid(grid::GridArgs),
    /// LiDAR odometry on a sequence of KITTI: drift, ATE, and a comparison with the road thesis' tables
    Kitti(kitti::KittiArgs),
    /// A map against the empty scene: correlation by localised views, accuracy, completeness, F-score
    Map(map::MapArgs),
    /// Detection on scans alone: zones with and without labelled moving legs
    Scans(scans::ScansArgs),
    /// An estimated trajectory against a reference: ATE, RPE, KITTI drift, coverage
    Trajectory(trajectory::TrajectoryArgs),
    /// SLAM and odometry on sequences of TUM RGB-D, over several runs, with a comparison with the PL-SLAM thesis' tables
    Tum(tum::TumArgs),
}

pub(crate) fn run(args: &EvalArgs) -> Result<Outcome, Failure> {
    match args {
        EvalArgs::Grid(args) => grid::run(args),
        EvalArgs::Kitti(args) => kitti::run(args),
        EvalArgs::Map(args) => map::run(args),
        EvalArgs::Scans(args) => scans::run(args),
        EvalArgs::Trajectory(args) => trajectory::run(args),
        EvalArgs::Tum(args) => tum::run(args),
    }
}
