//! `stillmap run`: a bag through the whole pipeline.

mod chosen;
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
pub mod view_topics;

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use bag_player::{Bag, BagInfo};
use clap::{Args, ValueEnum};
use geometry::{OccupancyGrid, TriangleMesh};
use msgs::geometry_msgs::PoseStamped;
use nalgebra::Isometry3;
use reconstruction::{GridError, MeshError, MeshForm};
use report::{DynamicScore, RunRecord, Summary};

use self::chosen::Chosen;
pub(crate) use self::chosen::{SensorFrames, choose_inputs};
use self::drawings::{DrawingArgs, Drawings};
use self::findings::InputLosses;
pub(crate) use self::findings::{SOUND_SHARE, are_many, no_cycle, no_map, of_sensors};
use self::inputs::{Inputs, TopicArgs};
use self::local::LocalRun;
use self::output::OutputFolder;
use self::parameters::{ParameterArgs, PipelineParameters};
pub(crate) use self::pose_topics::{PoseSource, PoseTopicKind};
pub(crate) use self::recorder::Stage;
use self::scanned_bag::{ScannedBag, folder_for_bag, has_scanner};
use crate::console;
use crate::existing::refuse_to_replace;
use crate::failure::{Failure, Outcome};
use crate::import::{AddedScans, tum};
use crate::interrupt::Interrupt;
use crate::lidar::{self, LidarSource, RoadArgs};
use crate::progress::Progress;
use crate::visual::write_trajectory;

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
    /// How the stages are connected
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
            return Err(Failure::new(format!("--rate {} is not a positive number", self.rate))
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
            return Err(Failure::new("--mesh: a road map has no distances to make a mesh of"));
        }
        if transport == TransportName::Dds {
            return Err(Failure::new("a road map is made with --transport local only")
                .fix("over DDS start `stillmap up --pose lidar`, and play the recording"));
        }
        if let Some(option) = args.how.drawings.given() {
            return Err(Failure::new(format!("{option}: a road map has pictures of its own"))
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
        return Err(Failure::new(
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
                Err(Failure::new(format!("{option} has no effect on a LiDAR's road map"))
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

/// Scores a run against the ground truth in its bag; `None` if the bag has none.
pub type Scoring =
    fn(&Bag, &Inputs, &PipelineParameters, &RunRecord) -> Result<Option<DynamicScore>, Failure>;

/// Runs a bag and writes the results.
///
/// # Errors
/// When the bag cannot be read, or there is no result.
pub fn run_bag(
    bag_path: &Path,
    out: &Path,
    topics: &TopicArgs,
    (how, transport): (&HowArgs, TransportName),
    scoring: Option<Scoring>,
    interrupt: &Interrupt,
) -> Result<Outcome, Failure> {
    how.refuse_outputs(out)?;
    how.check()?;
    let chosen = Chosen::of(bag_path, topics, (&how.parameters, how.no_colour), interrupt)?;
    let Chosen { bag, info, added_scans, inputs, parameters, notes } = chosen;
    notes.into_iter().for_each(console::note);
    let yaml = parameters.to_yaml()?;
    let folder = OutputFolder::create(out, &yaml)?;
    let grid_file = parameters.wants_grid().then(|| folder.grid_file()).transpose()?;
    let map_file = folder.node_map_file()?;
    let grid_before = folder.grid_saved_at();
    let mesh_file = how.mesh.map(|form| folder.mesh_file(form)).transpose()?;
    let mesh_before = how.mesh.and_then(|form| folder.mesh_saved_at(form));

    let Finished { mut record, losses, failure, poses, grid, mesh, is_interrupted } =
        match transport {
            TransportName::Local => {
                let how = (&parameters, how.mesh.is_some());
                run_locally(&bag, &info, (&inputs, added_scans), how, interrupt)?
            }
            TransportName::Dds => {
                let bag_name = bag_name(bag_path);
                // The player needs them in a bag.
                let scanned = added_scans
                    .map(|added| ScannedBag::of((&bag, &info), &bag_name, added, interrupt))
                    .transpose()?;
                let playback = dds::Playback {
                    bag: scanned.as_ref().map_or(bag_path, |scanned| &scanned.bag),
                    bag_name: &bag_name,
                    rate: how.rate,
                    parameters: folder.parameters(),
                    map_file: &map_file,
                    grid_file: grid_file.as_deref(),
                    mesh_file: mesh_file.as_deref(),
                };
                run_over_dds(&playback, &info, &inputs, &parameters, interrupt)?
            }
        };
    if is_interrupted && record.cycles.is_empty() {
        console::note("interrupted before the first cycle: nothing is written");
        return Ok(Outcome::Interrupted);
    }
    let scored = scoring.map(|score| score(&bag, &inputs, &parameters, &record));
    let (score, unscored) = match scored.transpose() {
        Ok(score) => (score.flatten(), None),
        Err(failure) => (None, Some(failure)),
    };
    let summary = Summary::of_run(&record, score, !how.no_timing)
        .map_err(|error| Failure::new(error.to_string()))?;
    // The report has it as a layer.
    let mesh_error = match mesh {
        Some(Ok(mesh)) => {
            record.mesh = Some(mesh);
            None
        }
        Some(Err(error)) => Some(error),
        None => None,
    };
    folder.write(&record, &summary)?;
    let drawings = drawings::draw(&how.drawings, &folder, &record, how.json)?;
    if let Some(poses) = &poses {
        let trajectory = folder.path().join("trajectory.txt");
        write_trajectory(&trajectory, poses, &Isometry3::identity())?;
    }

    let mut findings = findings::findings(&losses, &record, &inputs);
    match grid {
        Some(Ok(grid)) => folder.write_grid(&grid)?,
        Some(Err(error)) => {
            folder.remove_grid()?;
            findings.push(Failure::new(error.to_string()));
        }
        // The node of the map has saved it, or said why not.
        None if grid_file.is_some() && folder.grid_saved_at() != grid_before => {}
        None => {
            folder.remove_grid()?;
            findings.extend(grid_file.map(|_| Failure::new(NO_GRID)));
        }
    }
    let mesh = mesh_error.map_or_else(|| record.mesh.as_ref().map(Ok), |error| Some(Err(error)));
    findings.extend(mesh_output::settle(&folder, how.mesh, mesh, mesh_before)?);
    findings.extend(unscored);
    for finding in &findings {
        console::print_failure(finding);
    }
    let no_result = || findings::no_result(&record).filter(|_| !is_interrupted);
    if let Some(failure) = failure.or_else(no_result) {
        return Err(failure);
    }
    print_summary(&folder, &summary, &drawings, how.json)?;
    if how.open {
        open_report(&folder);
    }
    if is_interrupted {
        console::note("interrupted: the results are of what was read until then");
        return Ok(Outcome::Interrupted);
    }
    Ok(if findings.is_empty() { Outcome::Complete } else { Outcome::WithLosses })
}

/// Over DDS the node of the map says why.
const NO_GRID: &str = "reconstruction has saved no occupancy grid: its log says why";

/// What either transport yields.
struct Finished {
    record: RunRecord,
    losses: InputLosses,
    /// Why the run ended before the end of the bag, if it did.
    failure: Option<Failure>,
    /// The rig's poses by the visual odometry, where it was asked for.
    poses: Option<Vec<PoseStamped>>,
    /// The occupancy grid, where one was asked for.
    grid: Option<Result<OccupancyGrid, GridError>>,
    /// The surface as triangles, where it was asked for, of a run in this process.
    mesh: Option<Result<TriangleMesh, MeshError>>,
    /// Whether a signal has ended it before the end of the bag.
    is_interrupted: bool,
}

fn run_locally(
    bag: &Bag,
    info: &BagInfo,
    (inputs, added_scans): (&Inputs, Option<AddedScans>),
    (parameters, wants_mesh): (&PipelineParameters, bool),
    interrupt: &Interrupt,
) -> Result<Finished, Failure> {
    let topics = inputs.by_node_name();
    let messages = topics.iter().map(|(_, topic)| messages_on(info, topic)).sum();
    let progress = Progress::new("mapping", messages);
    let how = (parameters, wants_mesh);
    let (name, inputs) = (bag_name(bag.path()), (inputs, added_scans));
    let run = local::run(bag, inputs, how, &name, (&progress, interrupt))?;
    progress.finish();
    let LocalRun { record, poses, grid, mesh, is_interrupted, .. } = run;
    let losses = InputLosses {
        bag: run.losses,
        doubtful: run.doubtful,
        lost: Vec::new(),
        bounds_reached: run.bounds_reached,
    };
    Ok(Finished { record, losses, failure: None, poses, grid, mesh, is_interrupted })
}

fn run_over_dds(
    playback: &dds::Playback<'_>,
    info: &BagInfo,
    inputs: &Inputs,
    parameters: &PipelineParameters,
    interrupt: &Interrupt,
) -> Result<Finished, Failure> {
    let progress = Progress::new("mapping", messages_on(info, &inputs.scan));
    let run = dds::run(playback, inputs, parameters, (&progress, interrupt))?;
    progress.finish();
    let losses = InputLosses {
        bag: info.losses.clone(),
        doubtful: run.doubtful,
        lost: run.lost,
        bounds_reached: run.bounds_reached,
    };
    let (record, poses, is_interrupted) = (run.record, run.poses, run.is_interrupted);
    let (failure, grid, mesh) = (run.failure, None, None);
    Ok(Finished { record, losses, failure, poses, grid, mesh, is_interrupted })
}

fn messages_on(info: &BagInfo, topic: &str) -> u64 {
    info.topics.iter().filter(|known| known.topic == topic).map(|known| known.message_count).sum()
}

/// Opens the report with the desktop's program (xdg-utils). Where there is none, that is said.
fn open_report(folder: &OutputFolder) {
    let report = folder.path().join(output::REPORT);
    let opened =
        Command::new("xdg-open").arg(&report).stdin(Stdio::null()).stdout(Stdio::null()).status();
    match opened {
        Ok(status) if status.success() => {}
        Ok(status) => console::note(format_args!("the report was not opened: xdg-open {status}")),
        Err(error) if error.kind() == ErrorKind::NotFound => console::note(format_args!(
            "the report was not opened, since there is no xdg-open here (package xdg-utils): open {} in a browser",
            report.display()
        )),
        Err(error) => console::note(format_args!("the report was not opened: xdg-open: {error}")),
    }
}

/// The bag's name without its folder.
fn bag_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn print_summary(
    folder: &OutputFolder,
    summary: &Summary,
    drawings: &Drawings,
    json: bool,
) -> Result<(), Failure> {
    if json {
        let json = summary
            .to_json()
            .map_err(|error| Failure::new(format!("cannot print the summary: {error}")))?;
        return console::print(json.trim_end());
    }
    if drawings.thumbnail.is_empty() {
        report::headline(summary).iter().try_for_each(console::print)?;
    } else {
        drawings.thumbnail.iter().try_for_each(console::print)?;
        console::print("")?;
        report::figures_table(summary).iter().try_for_each(console::print)?;
        console::print("")?;
    }
    let path = folder.path().display();
    let has_map = summary.map.points > 0;
    let map = if has_map { format!("map: {path}/map.ply, map.pcd; ") } else { String::new() };
    console::print(format_args!("{map}removed: {path}/dynamic/; figures: {path}/summary.json"))?;
    if let Some(pictures) = drawings.list(folder.path()) {
        console::print(format_args!("pictures: {pictures}"))?;
    }
    console::print(format_args!("report: {path}/report.html"))
}
