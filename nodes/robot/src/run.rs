//! `stillmap run`: a bag through the whole pipeline.

mod bag_run;
mod chosen;
mod closing;
mod collector;
pub(crate) mod colour_topics;
pub mod cycles;
mod dds;
mod drawings;
mod findings;
pub mod inputs;
pub(crate) mod local;
mod mesh_output;
mod output;
pub mod parameters;
pub mod pipeline;
pub(crate) mod pose_topics;
mod recorder;
mod scanned_bag;
pub(crate) mod terminal;
#[cfg(test)]
pub(crate) mod tf_bag;
pub(crate) mod tf_frames;
mod trajectory;
mod transports;
pub mod view_topics;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use reconstruction::MeshForm;

pub use self::bag_run::{Scoring, run_bag};
pub(crate) use self::chosen::{SensorFrames, choose_inputs};
use self::drawings::DrawingArgs;
pub(crate) use self::findings::{SOUND_SHARE, are_many, no_cycle, no_map, of_sensors};
use self::inputs::TopicArgs;
use self::parameters::{ParameterArgs, PipelineParameters};
pub(crate) use self::pose_topics::{PoseSource, PoseTopicKind};
pub(crate) use self::recorder::Stage;
use self::scanned_bag::{folder_for_bag, has_scanner};
use crate::console;
use crate::existing::refuse_to_replace;
use crate::failure::{Failure, Outcome};
use crate::import::tum;
use crate::interrupt::Interrupt;
use crate::lidar::{self, LidarSource, RoadArgs};

/// Arguments of `stillmap run`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap run room.mcap --out room --scan /laser/scan
  stillmap run drive.pcap --pose lidar --out drive

With --pose lidar the scans of a turning LiDAR become a road map: those of a bag with its clouds or packets. The other topics of
the bag are not used. A capture of a Velodyne (pcap, pcapng) and a folder of KITTI's need no --pose. A sequence of the TUM benchmark is
imported to a temporary bag first. Scans of a recording without a 2D scanner are cut out of its depth images.")]
pub struct RunArgs {
    /// A bag (MCAP, sqlite3 or ROS 1, recognised by its content), a rosbag2 folder, a folder of the TUM benchmark, or a LiDAR's recording: a
    /// capture, or a folder of scans
    bag: PathBuf,
    /// Where the map, the removed clouds, the summary and the report go
    #[arg(short, long, value_name = "DIR", default_value = "stillmap-out")]
    out: PathBuf,
    #[command(flatten)]
    how: HowArgs,
    #[command(flatten)]
    topics: TopicArgs,
    #[command(flatten)]
    road: RoadArgs,
}

/// As recorded.
const DEFAULT_RATE: f64 = 1.0;

/// How a bag is run; `stillmap demo` has the same arguments.
#[derive(Args, Clone, Debug)]
pub struct HowArgs {
    /// Replace what another run has left in the folder
    #[arg(long)]
    pub overwrite: bool,
    /// How the stages are connected (default: local; of demo: dds)
    #[arg(long, value_enum)]
    pub transport: Option<TransportName>,
    /// Playback speed over DDS; a local run always goes as fast as it can
    #[arg(long, default_value_t = DEFAULT_RATE)]
    rate: f64,
    #[command(flatten)]
    parameters: ParameterArgs,
    /// Leave the colours of the bag's images and clouds out of the map
    #[arg(long)]
    no_colour: bool,
    /// Write the surface as triangles, too, to mesh.glb (binary glTF), mesh.ply or mesh.obj; of the method free_space
    #[arg(long, value_name = "FORM", value_parser = mesh_output::form_parser())]
    mesh: Option<MeshForm>,
    #[command(flatten)]
    drawings: DrawingArgs,
    /// Leave the times out of summary.json, so that two runs of one bag write the same bytes
    #[arg(long)]
    no_timing: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
    /// Open the report at the end, in the desktop's browser
    #[arg(long)]
    open: bool,
}

impl HowArgs {
    /// Refuses what may not or cannot be written into a folder of results, before any work is done.
    ///
    /// # Errors
    /// When something of it may not be replaced, or cannot be of this form.
    pub fn refuse_outputs(&self, out: &Path) -> Result<(), Failure> {
        output::refuse_results(out, self.overwrite)?;
        self.drawings.refuse(self.overwrite)
    }

    /// Refuses parameters and options that no bag can be run with.
    ///
    /// # Errors
    /// When a parameter file cannot be used, or an option does not go with them.
    pub fn check(&self) -> Result<(), Failure> {
        if !(self.rate.is_finite() && self.rate > 0.0) {
            return Err(Failure::unusable(format!(
                "--rate {} is not a positive number",
                self.rate
            ))
            .fix("1 plays as recorded, 0.5 half as fast"));
        }
        let parameters = PipelineParameters::load(&self.parameters)?;
        mesh_output::check(self.mesh, parameters.pipeline())
    }
}

/// How the stages of a run are connected.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum TransportName {
    /// In one process, deterministic, as fast as it goes
    Local,
    /// As ROS 2 nodes, each a process of its own, in a namespace of this run
    Dds,
}

pub(crate) fn run(
    args: &RunArgs,
    scoring: Option<Scoring>,
    interrupt: &Interrupt,
) -> Result<Outcome, Failure> {
    let transport = args.how.transport.unwrap_or(TransportName::Local);
    let is_lidar = args.topics.has_no_pose() && LidarSource::is_no_bag(&args.bag);
    if is_lidar {
        console::note("a LiDAR's recording: a road map is made of it, as with --pose lidar");
    }
    if is_lidar || args.topics.wants_lidar() {
        if args.how.mesh.is_some() {
            return Err(Failure::unusable("--mesh: a road map has no distances to make a mesh of"));
        }
        if transport == TransportName::Dds {
            return Err(Failure::unusable("a road map is made with --transport local only")
                .fix("over DDS start `stillmap up --pose lidar`, and play the recording"));
        }
        if let Some(option) = args.how.drawings.given() {
            return Err(Failure::unusable(format!("{option}: a road map has pictures of its own"))
                .fix("leave it out: the folder then holds the map and the drive from above"));
        }
        args.refuse_without_effect_on_a_road_map()?;
        let results = lidar::ROAD_RESULTS.map(|name| args.out.join(name));
        refuse_to_replace(results, args.how.overwrite, "--out")?;
        if has_scanner(&args.bag, interrupt)? {
            console::note(
                "the map is built from the 3D LiDAR alone, the 2D scanner is not used; `stillmap up --pose lidar` runs the nodes that remove \
                 moving objects with the LiDAR's pose",
            );
        }
        let how = (args.topics.lidar(), &args.road);
        return lidar::run_road(
            &args.bag,
            &args.out,
            how,
            args.how.parameters.files(),
            args.how.json,
            interrupt,
        );
    }
    if !args.topics.lidar().is_empty() || args.road != RoadArgs::default() {
        return Err(Failure::unusable(
            "--lidar, --calibration, --loop-closing, --road-voxel, --road-memory and --colour are for a LiDAR's road map",
        )
        .fix("leave them out, or add --pose lidar"));
    }
    let how = (&args.how, transport);
    if tum::is_sequence(&args.bag) {
        return run_sequence(args, how, scoring, interrupt);
    }
    run_bag(&args.bag, &args.out, &args.topics, how, scoring, interrupt)
}

impl RunArgs {
    /// Refuses options that a road map does not have.
    fn refuse_without_effect_on_a_road_map(&self) -> Result<(), Failure> {
        let HowArgs { rate, no_colour, open, .. } = &self.how;
        let of_run =
            [(*rate != DEFAULT_RATE, "--rate"), (*no_colour, "--no-colour"), (*open, "--open")];
        let given = of_run.into_iter().filter_map(|(is_given, name)| is_given.then_some(name));
        match self.topics.of_other_sensors().into_iter().chain(given).next() {
            Some(option) => {
                Err(Failure::unusable(format!("{option} has no effect on a LiDAR's road map"))
                    .fix("leave it out, or leave out --pose lidar"))
            }
            None => Ok(()),
        }
    }
}

/// Runs a sequence of the TUM benchmark by way of a bag, which is gone afterwards.
fn run_sequence(
    args: &RunArgs,
    how: (&HowArgs, TransportName),
    scoring: Option<Scoring>,
    interrupt: &Interrupt,
) -> Result<Outcome, Failure> {
    // What can be refused is refused before the import.
    args.how.refuse_outputs(&args.out)?;
    args.how.check()?;
    let folder = folder_for_bag()?;
    let bag = folder.path().join(format!("{}.mcap", bag_name(&args.bag)));
    console::note(
        "a sequence of the TUM benchmark: it is imported to a temporary bag first, with scans that are cut out of its depth images",
    );
    tum::import_to(&bag, &args.bag, interrupt)?;
    if interrupt.has_come() {
        console::note("interrupted before the first cycle: nothing is written");
        return Ok(Outcome::Interrupted);
    }
    run_bag(&bag, &args.out, &args.topics, how, scoring, interrupt)
}

/// The bag's name without its folder.
fn bag_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
