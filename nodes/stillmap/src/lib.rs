//! The front door of stillmap: one program, a file per subcommand. It composes the cores and the nodes
//! of the workspace; no method lives here.

mod bench;
mod calibrate;
mod console;
mod demo;
mod doctor;
mod eval;
mod experiments;
mod failure;
mod import;
mod info;
mod lidar;
mod node;
mod odometry;
mod pose_listener;
mod processes;
mod progress;
mod rig;
mod run;
mod sensor_bag;
mod simulate;
mod trial;
mod up;
mod visual;

use std::ffi::OsString;
use std::process::ExitCode;

use bag_player::shell::PlayOptions;
use bag_player::shell::record::{self, RecordOptions};
use clap::{Parser, Subcommand};
use node_shell::{NodeFailure, RosArguments};
use rustix::process::Signal;

use failure::{Failure, Outcome};

/// Set for a process that must not outlive the one that started it, not even one that was killed.
pub(crate) const END_WITH_PARENT: &str = "STILLMAP_END_WITH_PARENT";

/// The exit code of a job that was done as far as its input allowed, with part of that input lost.
const EXIT_WITH_LOSSES: u8 = 3;

/// Maps what stays still: finds what moves by how the ranges of a 2D LiDAR vary, cuts it out of the
/// cloud of an RGB-D camera, and builds the clean static 3D map.
#[derive(Parser, Debug)]
#[command(
    name = "stillmap",
    version,
    after_help = "Start with: stillmap demo
Exit codes: 0 done, 1 not done, 2 a command line that cannot be read, 3 done with losses (what there
is, is written), 130 playing was interrupted."
)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// The main job on a simulated room, over DDS: map, pictures, report
    Demo(demo::DemoArgs),
    /// A bag through the whole pipeline
    Run(run::RunArgs),
    /// Where the camera of a bag was, by the points and lines that it sees; or its LiDAR
    Odometry(odometry::OdometryArgs),
    /// Play a bag onto DDS
    Play(PlayOptions),
    /// Record the live graph into a bag
    #[command(after_help = record::EXAMPLES)]
    Record(RecordOptions),
    /// What is in a bag
    Info(info::InfoArgs),
    /// Turn recorded data sets into bags
    #[command(subcommand)]
    Import(import::ImportArgs),
    /// A simulated room as a bag, with its truth
    Simulate(simulate::SimulateArgs),
    /// Where the scanner is on the rig, by the surfaces that the depth camera sees
    Calibrate(calibrate::CalibrateArgs),
    /// Scores of results against a reference
    #[command(subcommand)]
    Eval(eval::EvalArgs),
    /// The eleven experiments of Rec-HV, run again: each published table beside ours
    Experiments(experiments::ExperimentsArgs),
    /// What is wrong with this machine and the live graph, or with a bag, and what mends it
    Doctor(doctor::DoctorArgs),
    /// What the transport of this machine carries, and what a cycle costs over an hour
    #[command(subcommand)]
    Bench(bench::BenchArgs),
    /// The whole suite live, in one process, as ROS 2 nodes
    Up(up::UpArgs),
    /// One node of the suite: detection, segmentation, reconstruction, pose, lidar-odometry or compression
    Node(node::NodeArgs),
}

/// Runs the program with its arguments, the program's own name first.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    if std::env::var_os(END_WITH_PARENT).is_some() {
        // Where the kernel cannot do it, an owner that ends in order still ends its processes.
        let _ = rustix::process::set_parent_process_death_signal(Some(Signal::TERM));
    }
    let (arguments, ros) = match split_ros_arguments(arguments) {
        Ok(split) => split,
        Err(failure) => return fail(&failure),
    };
    let command_line = match CommandLine::try_parse_from(arguments) {
        Ok(command_line) => command_line,
        Err(error) => {
            // Help and version come this way too, and are no errors.
            let printed = error.print();
            let code = u8::try_from(error.exit_code()).unwrap_or(1);
            return if printed.is_ok() { ExitCode::from(code) } else { ExitCode::FAILURE };
        }
    };
    let result = match command_line.command {
        Command::Demo(args) => demo::run(&args),
        Command::Run(args) => run::run(&args),
        Command::Odometry(args) => odometry::run(&args),
        Command::Play(options) => return code_of(bag_player::shell::run_options(options, &ros)),
        Command::Record(options) => return code_of(record::run(&options, &ros)),
        Command::Info(args) => info::run(&args),
        Command::Import(args) => import::run(args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::Eval(args) => eval::run(&args),
        Command::Experiments(args) => experiments::run(&args),
        Command::Doctor(args) => doctor::run(&args, &ros),
        Command::Bench(args) => bench::run(args, &ros),
        Command::Up(args) => up::run(&args, &ros),
        Command::Node(args) => return node::run(args),
    };
    match result {
        Ok(Outcome::Complete) => ExitCode::SUCCESS,
        Ok(Outcome::WithLosses) => ExitCode::from(EXIT_WITH_LOSSES),
        Err(failure) => fail(&failure),
    }
}

fn fail(failure: &Failure) -> ExitCode {
    console::complain(failure);
    ExitCode::FAILURE
}

/// The arguments of this program, and the ROS arguments that follow them. A node takes its own whole.
fn split_ros_arguments(
    arguments: impl IntoIterator<Item = OsString>,
) -> Result<(Vec<OsString>, RosArguments), Failure> {
    let mut own: Vec<OsString> = arguments.into_iter().collect();
    let is_node = own.get(1).is_some_and(|command| command == "node");
    let start = own.iter().position(|argument| argument == "--ros-args" && !is_node);
    let ros = own.split_off(start.unwrap_or(own.len()));
    // A path may be no UTF-8, a ROS argument always is.
    let ros = ros.iter().map(|argument| argument.to_string_lossy().into_owned());
    let mut ros = RosArguments::parse(ros).map_err(|error| Failure::new(error.to_string()))?;
    // What stands behind a `--` is the program's again.
    own.extend(std::mem::take(&mut ros.own).into_iter().map(OsString::from));
    Ok((own, ros))
}

fn code_of(result: Result<ExitCode, NodeFailure>) -> ExitCode {
    result.unwrap_or_else(|error| fail(&Failure::new(error.to_string())))
}
