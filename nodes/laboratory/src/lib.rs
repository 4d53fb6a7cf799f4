//! The subcommands of `stillmap` that a robot does not need: simulated recordings with their ground truth, scores of results
//! against a reference, the experiments of Rec-HV, and what the transport and a cycle cost.

mod bench;
mod demo;
mod eval;
mod experiments;
mod published_file;
mod simulate;
mod trial;
mod truth;

use std::process::ExitCode;

use clap::Subcommand;
use node_shell::RosArguments;
use robot::{Failure, Interrupt, Outcome};

pub use eval::read_grid;
pub use simulate::{read_mesh, write_bag};
pub use truth::score;

/// The subcommands that a robot does not need.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// The whole pipeline on a simulated room, over DDS: map, pictures, report
    #[command(display_order = 0)]
    Demo(demo::DemoArgs),
    /// A simulated room as a bag, with its ground truth
    Simulate(simulate::SimulateArgs),
    /// Scores of results against a reference
    #[command(subcommand)]
    Eval(eval::EvalArgs),
    /// The eleven experiments of Rec-HV, run again and compared with the published tables
    Experiments(experiments::ExperimentsArgs),
    /// Benchmarks: throughput and latency of the transport on this machine, and the cost of a cycle over an hour
    #[command(subcommand)]
    Bench(bench::BenchArgs),
}

impl Command {
    /// Runs the subcommand.
    ///
    /// # Errors
    /// When the subcommand fails.
    pub fn run(self, ros: &RosArguments) -> Result<ExitCode, Failure> {
        if !matches!(self, Self::Bench(_)) {
            robot::refuse_ros_arguments(ros)?;
        }
        let outcome = match self {
            Self::Demo(args) => demo::run(&args, &Interrupt::on_signals()?),
            Self::Simulate(args) => simulate::run(&args, &Interrupt::on_signals()?),
            Self::Eval(args) => eval::run(&args),
            Self::Experiments(args) => experiments::run(&args, &Interrupt::on_signals()?),
            Self::Bench(args) => bench::run(args, ros),
        };
        outcome.map(Outcome::exit_code)
    }
}
