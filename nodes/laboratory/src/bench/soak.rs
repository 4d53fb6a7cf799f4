//! `stillmap bench soak`: the suite live, for as long as asked, in a simulated building without an end, and watched from
//! outside: memory, descriptors and threads that grow, cycles that grow older.

mod drift;
mod minute;
mod rig;
mod suite;
mod watch;

use std::time::Duration;

use clap::Args;
use geometry::PipelineConfig;
use node_shell::{Node, RosArguments};
use robot::{Failure, Outcome, Progress};
use serde::Serialize;

use self::drift::Drift;
use self::minute::{LENGTH_S, MinuteRow, Minutes};
use self::rig::SimulatedRig;
use self::suite::Suite;
use self::watch::Watch;
use super::figures::FigureArgs;
use super::tour::minutes;
use super::transport::machine::Machine;
use super::transport::table;

/// Arguments of `stillmap bench soak`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap bench soak
  stillmap bench soak --minutes 600 -o night.json

It starts `stillmap up` with a live view, a floor plan and a map file, and publishes what a robot would that drives round
the corridor of `bench tour`: scans at 7 Hz, depth images of 160 x 120 pixels at 14 Hz, poses. The map is at its bound
after a lap of four minutes. The figures are those of the process of `up`. It fails where the memory, the open files or
the threads grow from the second quarter of the run on.")]
pub struct SoakArgs {
    /// The duration
    #[arg(long, default_value_t = 60.0, value_parser = minutes)]
    minutes: f64,
    /// Edge of the map's voxels in metres
    #[arg(long, default_value_t = PipelineConfig::default().map_edge_m, value_name = "METRES")]
    map_edge: f64,
    /// The maximum number of the map's blocks; those seen longest ago are dropped
    #[arg(long, default_value_t = 10_000)]
    max_map_blocks: usize,
    #[command(flatten)]
    figures: FigureArgs,
}

/// The report.
#[derive(Debug, Serialize)]
struct Report {
    machine: Machine,
    map_edge_m: f64,
    max_map_blocks: usize,
    /// Absent where the run is too short to tell.
    drift: Option<Drift>,
    minutes: Vec<MinuteRow>,
}

pub(crate) fn run(args: &SoakArgs, ros: &RosArguments) -> Result<Outcome, Failure> {
    args.figures.check()?;
    let Soaked { minutes, end } = super::as_node("soak", ros, async {
        let node = Node::start("soak", ros).map_err(super::shell_failure)?;
        let soaked = soak(args, &node).await;
        node.close().await;
        soaked
    })?;
    let report = Report {
        machine: Machine::here(),
        map_edge_m: args.map_edge,
        max_map_blocks: args.max_map_blocks,
        drift: Drift::of(&minutes),
        minutes,
    };
    args.figures.tell(&report, &report.machine, [text(&report)])?;
    let outcome = end?;
    match report.drift.and_then(Drift::growth) {
        Some(growth) => Err(Failure::new(growth)),
        None => Ok(outcome),
    }
}

/// The minutes until the end, and how that came.
struct Soaked {
    minutes: Vec<MinuteRow>,
    end: Result<Outcome, Failure>,
}

/// Drives until the time is over, a signal comes, or the suite ends.
async fn soak(args: &SoakArgs, node: &Node) -> Result<Soaked, Failure> {
    let namespace = format!("/soak_{}", std::process::id());
    let watch = Watch::new(node, &namespace)?;
    let rig = SimulatedRig::new(node, &namespace)?;
    let mut suite = Suite::start(args, &namespace)?;
    let shutdown = node.shutdown_signal();
    let progress = Progress::new("minutes", args.minutes.ceil() as u64);
    let over = tokio::time::sleep(Duration::from_secs_f64(args.minutes * LENGTH_S));
    let mut minutes = Minutes::default();
    let end = tokio::select! {
        biased;
        () = shutdown.wait() => Ok(Outcome::Interrupted),
        () = over => Ok(Outcome::Complete),
        failed = rig.drive() => Err(failed),
        failed = watch.follow(&mut suite, &mut minutes, &progress) => Err(failed),
    };
    progress.finish();
    // Where it has ended by itself, this has its last words.
    let stopped = suite.stop();
    Ok(Soaked { minutes: minutes.rows(), end: stopped.and(end) })
}

/// The table, and what it says.
fn text(report: &Report) -> String {
    let mut lines = vec![MinuteRow::NAMES.map(str::to_owned).to_vec()];
    lines.extend(report.minutes.iter().map(MinuteRow::cells));
    let sum = report.drift.map_or_else(
        || format!("less than {} minutes are too short to tell what grows", drift::LEAST_MINUTES),
        |drift| drift.to_string(),
    );
    format!("{}{sum}", table::render(&lines))
}
