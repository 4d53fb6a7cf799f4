//! `stillmap run`: a bag through the whole pipeline.

mod dds;
mod inputs;
mod local;
mod output;
mod parameters;
mod recorder;
mod truth;

use std::path::{Path, PathBuf};

use bag_player::{Bag, BagInfo, Loss};
use clap::{Args, ValueEnum};
use evaluation::{DynamicScoreRules, RunRecord, Summary};
use geometry::{DepthLimits, pose_from_vector};

use self::inputs::{Inputs, TopicArgs};
use self::output::OutputFolder;
use self::parameters::{ParameterArgs, PipelineParameters};
use self::truth::TruthReader;
use crate::failure::{Failure, Outcome};
use crate::progress::Progress;

/// Arguments of `stillmap run`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap run room.mcap --out room --scan /laser/scan")]
pub(crate) struct RunArgs {
    /// An MCAP file or a rosbag2 folder
    bag: PathBuf,
    /// Where the map, the removed clouds, the summary and the report go
    #[arg(short, long, value_name = "DIR", default_value = "stillmap-out")]
    out: PathBuf,
    #[command(flatten)]
    how: HowArgs,
    #[command(flatten)]
    topics: TopicArgs,
}

/// How a bag is run; `stillmap demo` shares these.
#[derive(Args, Debug)]
pub(crate) struct HowArgs {
    /// How the stages are connected
    #[arg(long, value_enum)]
    pub(crate) transport: Option<TransportName>,
    /// Playback speed over DDS; a local run always goes as fast as it can
    #[arg(long, default_value_t = 1.0)]
    rate: f64,
    #[command(flatten)]
    parameters: ParameterArgs,
    /// Leave the times out of summary.json, so that two runs of one bag write the same bytes
    #[arg(long)]
    no_timing: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// How the stages of a run are connected.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum TransportName {
    /// In one process, deterministic, as fast as it goes
    Local,
    /// As ROS 2 nodes, each a process of its own, in a namespace of this run
    Dds,
}

pub(crate) fn run(args: &RunArgs) -> Result<Outcome, Failure> {
    let transport = args.how.transport.unwrap_or(TransportName::Local);
    run_bag(&args.bag, &args.out, &args.topics, &args.how, transport)
}

/// Runs a bag and writes what comes of it.
pub(crate) fn run_bag(
    bag_path: &Path,
    out: &Path,
    topics: &TopicArgs,
    how: &HowArgs,
    transport: TransportName,
) -> Result<Outcome, Failure> {
    let bag = Bag::open(bag_path).map_err(|error| Failure::new(error.to_string()))?;
    let info = bag.info().map_err(|error| Failure::new(error.to_string()))?;
    let inputs = Inputs::choose(topics, &info)?;
    let parameters = PipelineParameters::load(&how.parameters)?;
    let folder = OutputFolder::create(out)?;

    let Finished { record, trouble, losses } = match transport {
        TransportName::Local => run_locally(&bag, &info, &inputs, &parameters)?,
        TransportName::Dds => run_over_dds(bag_path, &info, &inputs, &parameters, how.rate)?,
    };
    for loss in &losses {
        eprintln!("stillmap: {}: {loss}", bag_path.display());
    }

    let summary = summarise(&bag, &inputs, &parameters, &record, !how.no_timing)?;
    folder.write(&record, &summary)?;
    tell(&folder, &summary, how.json)?;

    if let Some(trouble) = trouble {
        return Err(trouble);
    }
    if record.cycles.is_empty() {
        return Err(no_cycle(&record));
    }
    Ok(if losses.is_empty() { Outcome::Complete } else { Outcome::WithLosses })
}

/// What either transport yields.
struct Finished {
    record: RunRecord,
    trouble: Option<Failure>,
    losses: Vec<Loss>,
}

fn run_locally(
    bag: &Bag,
    info: &BagInfo,
    inputs: &Inputs,
    parameters: &PipelineParameters,
) -> Result<Finished, Failure> {
    let topics = inputs.by_node_name();
    let messages = topics.iter().map(|(_, topic)| messages_on(info, topic)).sum();
    let progress = Progress::new("mapping", messages);
    let run = local::run(bag, inputs, parameters, &bag_name(bag.path()), &progress)?;
    progress.finish();
    Ok(Finished { record: run.record, trouble: None, losses: run.losses })
}

fn run_over_dds(
    bag_path: &Path,
    info: &BagInfo,
    inputs: &Inputs,
    parameters: &PipelineParameters,
    rate: f64,
) -> Result<Finished, Failure> {
    let progress = Progress::new("mapping", messages_on(info, &inputs.scan));
    let playback = dds::Playback { bag: bag_path, bag_name: &bag_name(bag_path), rate };
    let run = dds::run(&playback, inputs, parameters, &progress)?;
    progress.finish();
    Ok(Finished { record: run.record, trouble: run.trouble, losses: info.losses.clone() })
}

fn messages_on(info: &BagInfo, topic: &str) -> u64 {
    info.topics.iter().filter(|known| known.topic == topic).map(|known| known.message_count).sum()
}

/// The bag's own name: the folders that lead to it say nothing about it.
fn bag_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn summarise(
    bag: &Bag,
    inputs: &Inputs,
    parameters: &PipelineParameters,
    record: &RunRecord,
    with_timing: bool,
) -> Result<Summary, Failure> {
    let wrong = |error: &dyn std::error::Error| {
        Failure::new(format!("the truth in the bag cannot be used: {error}"))
    };
    let rig_from_camera = pose_from_vector(&parameters.detection().rig_from_camera);
    let truth = TruthReader::open(bag, inputs, rig_from_camera, DepthLimits::default())
        .map_err(|error| wrong(&error))?;
    let score = match truth {
        Some(mut truth) => {
            let names = truth::object_names(bag).map_err(|error| wrong(&error))?;
            let rules = DynamicScoreRules::default();
            let score = evaluation::score_dynamic(record, &rules, &names, |stamp| truth.at(stamp))
                .map_err(|error| wrong(&error))?;
            Some(score)
        }
        None => None,
    };
    Summary::of_run(record, score, with_timing).map_err(|error| Failure::new(error.to_string()))
}

fn tell(folder: &OutputFolder, summary: &Summary, json: bool) -> Result<(), Failure> {
    if json {
        let json = summary
            .to_json()
            .map_err(|error| Failure::new(format!("cannot print the summary: {error}")))?;
        print!("{json}");
        return Ok(());
    }
    for line in evaluation::headline(summary) {
        println!("{line}");
    }
    let path = folder.path().display();
    println!(
        "map: {path}/map.ply, map.pcd; removed: {path}/dynamic/; figures: {path}/summary.json"
    );
    println!("report: {path}/report.html");
    Ok(())
}

fn no_cycle(record: &RunRecord) -> Failure {
    let reasons: Vec<String> = record
        .drops
        .iter()
        .map(|drop| format!("{}: {} ({} times)", drop.topic_or_stage, drop.reason, drop.count))
        .collect();
    let what = "no scan became a cycle, so there is no map".to_owned();
    if reasons.is_empty() {
        Failure::new(what)
    } else {
        Failure::new(what).mend(reasons.join("\n  "))
    }
}
