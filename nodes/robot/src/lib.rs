//! The subcommands of `stillmap` that a robot needs: the suite live, recordings in and out and through the
//! pipeline, odometry, calibration, and the doctor. They compose the cores and the nodes of the workspace; the
//! methods are in those.
//!
//! Modules that the subcommands of the laboratory use as well are public.

mod bag_copy;
mod calibrate;
pub mod console;
mod doctor;
mod e57_file;
mod existing;
mod export;
mod failure;
mod filter;
pub mod import;
mod info;
mod interrupt;
mod known_parameters;
mod las_file;
pub mod lidar;
pub mod map_file;
mod merge;
mod node;
mod odometry;
mod offer;
mod open_bag;
mod pose_listener;
mod pose_numbers;
mod processes;
mod progress;
mod rig;
mod ros_words;
pub mod run;
pub mod sensor_bag;
mod unfinished;
mod up;
mod view;
pub mod visual;

use std::process::ExitCode;

use bag_player::shell::record::{self, RecordOptions};
use bag_player::shell::{EXAMPLES, PlayOptions};
use clap::Subcommand;
use node_shell::{NodeFailure, RosArguments};

pub use existing::{BagOutput, refuse_to_replace};
pub use failure::{Failure, Outcome};
pub use interrupt::Interrupt;
pub use offer::Offer;
pub use open_bag::refused as bag_refused;
pub use processes::{END_WITH_PARENT, Process};
pub use progress::Progress;
pub use rig::rig_from_camera;

/// The subcommands that a robot needs.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// A bag through the whole pipeline
    Run(run::RunArgs),
    /// A bag without what moves: all its messages, those of scanner and depth camera filtered
    Filter(filter::FilterArgs),
    /// The trajectory of a bag's camera, from the points and lines in its images; or of its LiDAR
    Odometry(odometry::OdometryArgs),
    /// A saved map as another file: points, an octomap, or the occupancy grid that Nav2 loads
    Export(export::ExportArgs),
    /// Two saved maps of one place as one, and what changed between them
    Merge(merge::MergeArgs),
    /// Play a bag onto DDS
    #[command(after_help = EXAMPLES.replace("bag-player", "stillmap play"))]
    Play(PlayOptions),
    /// Record the live graph into a bag
    #[command(after_help = record::EXAMPLES)]
    Record(RecordOptions),
    /// What is in a bag
    Info(info::InfoArgs),
    /// Turn recorded data sets into bags
    #[command(subcommand)]
    Import(import::ImportArgs),
    /// The pose of the scanner on the rig, from the surfaces that the depth camera sees
    Calibrate(calibrate::CalibrateArgs),
    /// What is wrong with this machine and the live graph, or with a bag, and how to fix it
    Doctor(doctor::DoctorArgs),
    /// The whole suite live, in one process, as ROS 2 nodes
    Up(up::UpArgs),
    /// The live view: a page in the browser with the map, what moves, and the state of the nodes of a running graph
    View(view::ViewArgs),
    /// One node of the suite: detection, segmentation, reconstruction, pose, lidar-odometry or compression
    Node(node::NodeArgs),
}

impl Command {
    /// Runs the subcommand. `scoring` scores `run` against the ground truth in its bag, if it has one.
    ///
    /// # Errors
    /// When the job could not be done.
    pub fn run(
        self,
        ros: &RosArguments,
        scoring: Option<run::Scoring>,
    ) -> Result<ExitCode, Failure> {
        if !self.takes_ros_arguments() {
            refuse_ros_arguments(ros)?;
        }
        let outcome = match self {
            Self::Run(args) => run::run(&args, scoring, &Interrupt::on_signals()?),
            Self::Filter(args) => filter::run(&args, &Interrupt::on_signals()?),
            Self::Odometry(args) => odometry::run(&args),
            Self::Export(args) => export::run(&args),
            Self::Merge(args) => merge::run(&args, &Interrupt::on_signals()?),
            Self::Play(options) => {
                open_bag::refuse_other_kinds(&options.bag)?;
                return code_of(bag_player::shell::run_options(options, ros));
            }
            Self::Record(options) => return code_of(record::run(&options, ros)),
            Self::Info(args) => info::run(&args),
            Self::Import(args) => import::run(args, &Interrupt::on_signals()?),
            Self::Calibrate(args) => calibrate::run(&args),
            Self::Doctor(args) => doctor::run(&args, ros),
            Self::Up(args) => up::run(&args, ros),
            Self::View(args) => view::run(&args, ros),
            Self::Node(args) => return Ok(node::run(args)),
        };
        let outcome = outcome.or_else(|failure| {
            if !failure.is_interruption() {
                return Err(failure);
            }
            console::note(format_args!("interrupted: {failure}; nothing is written"));
            Ok(Outcome::Interrupted)
        });
        outcome.map(Outcome::exit_code)
    }
}

impl Command {
    /// Whether it starts a node, or listens to a graph.
    fn takes_ros_arguments(&self) -> bool {
        match self {
            Self::Play(_) | Self::Record(_) | Self::Up(_) | Self::View(_) | Self::Node(_) => true,
            Self::Doctor(args) => args.is_of_a_graph(),
            _ => false,
        }
    }
}

/// Refuses what would have no effect.
///
/// # Errors
/// When there are ROS arguments.
pub fn refuse_ros_arguments(ros: &RosArguments) -> Result<(), Failure> {
    let none = RosArguments::parse(Vec::<String>::new());
    if none.is_ok_and(|none| none == *ros) {
        return Ok(());
    }
    Err(Failure::unusable("--ros-args is for nodes, and has no effect here")
        .fix("--params-file FILE gives parameters to those commands that take some, and --scan, --depth, --pose, ... name the topics of a bag"))
}

fn code_of(result: Result<ExitCode, NodeFailure>) -> Result<ExitCode, Failure> {
    result.map_err(|error| Failure::of_body(&error))
}
