//! `stillmap doctor`: what is wrong with this machine and the live graph, or with a bag; each finding with
//! its numbers, and with the command or the setting that fixes it.

mod bag;
mod checks;
mod content;
mod finding;
mod graph;
mod machine;
mod sizes;

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use node_shell::log::{LogDirective, LogLevel};
use node_shell::{RosArguments, ShellError, Transport, TransportError};
use serde::Serialize;

use crate::console;
use crate::failure::{Failure, Outcome};
use crate::open_bag::open_bag;
use crate::run::inputs::TopicArgs;
use crate::run::parameters::{ParameterArgs, PipelineParameters};
use crate::run::terminal::is_coloured;
use checks::Check;
pub(crate) use content::{CalibrationFault, FARTHEST_M, wrong_calibration};
use finding::{Finding, Severity, Tally};
use graph::{GraphView, TopicListing};
pub(crate) use graph::{Listening, Proposal};
use machine::{Machine, ReceiveBuffer};

/// The longest time that a command line may ask the doctor to listen.
const LONGEST_S: f64 = 3600.0;
/// The doctor's name in the log.
const LOGGER: &str = "doctor";

/// Arguments of `stillmap doctor`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap doctor                                       this machine and the live graph
  stillmap doctor --seconds 10 --measure                the same, with images and clouds
  stillmap doctor --ros-args -r __ns:=/robot -r scan:=/laser/scan
  stillmap doctor room.mcap                             a bag

Each finding is a line: ok, warn or error, what was found with its numbers, the consequence, and after an arrow the
fix.
Exit codes: 0 nothing was found, 1 at least one error or the checks could not run, 2 a command line that cannot be
read, 3 warnings and no error.")]
pub struct DoctorArgs {
    /// A bag (MCAP, sqlite3 or ROS 1, recognised by its content) or a rosbag2 folder; without one, this machine and the live graph
    bag: Option<PathBuf>,
    /// How long to listen to the live graph
    #[arg(long, value_name = "S", default_value = "3", value_parser = seconds, conflicts_with = "bag")]
    seconds: Duration,
    /// Subscribe to images and clouds too, to see their sizes and rates; a driver then sends them
    #[arg(long, conflicts_with = "bag")]
    measure: bool,
    /// A ROS 2 parameter file of detection, as for `stillmap run`; later ones override earlier ones
    #[arg(long = "params-file", value_name = "FILE", requires = "bag")]
    parameter_files: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Print a table of all checks, in Markdown, and end
    #[arg(long, exclusive = true)]
    checks: bool,
    #[command(flatten, next_help_heading = "Topics of the bag")]
    topics: TopicArgs,
}

impl DoctorArgs {
    /// Whether it listens to the live graph.
    pub(crate) fn is_of_a_graph(&self) -> bool {
        self.bag.is_none() && !self.checks
    }
}

/// The result of the checks.
#[derive(Debug, Default, Serialize)]
struct Report {
    findings: Vec<Finding>,
    /// The topics of the live graph.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    topics: Vec<TopicListing>,
    tally: Tally,
}

pub(crate) fn run(args: &DoctorArgs, ros: &RosArguments) -> Result<Outcome, Failure> {
    if args.checks {
        console::print(checks::table().trim_end())?;
        return Ok(Outcome::Complete);
    }
    let mut report = match &args.bag {
        Some(bag) => examine_bag(bag, args)?,
        None if args.topics.is_empty() => examine_graph(args, ros)?,
        None => {
            return Err(Failure::new("topics of a bag are named, but no bag")
                .fix("on the live graph, remap them: --ros-args -r scan:=/laser/scan"));
        }
    };
    report.tally = Tally::of(&report.findings);
    print_report(&report, args.json)?;
    if report.findings.iter().any(|finding| finding.severity == Severity::Error) {
        return Err(Failure::new(format!("{} found", report.tally)));
    }
    let warned = report.tally.warnings > 0;
    Ok(if warned { Outcome::WithLosses } else { Outcome::Complete })
}

fn print_report(report: &Report, json: bool) -> Result<(), Failure> {
    if json {
        let json = serde_json::to_string_pretty(report)
            .map_err(|error| Failure::new(format!("cannot print the findings: {error}")))?;
        return console::print(json);
    }
    let in_colour = is_coloured();
    for line in report.topics.iter().flat_map(TopicListing::lines) {
        console::print(line)?;
    }
    if !report.topics.is_empty() {
        console::print("")?;
    }
    for finding in &report.findings {
        console::print(finding.line(in_colour))?;
    }
    console::print(report.tally)
}

fn examine_bag(path: &Path, args: &DoctorArgs) -> Result<Report, Failure> {
    let files = args.parameter_files.clone();
    let parameters = PipelineParameters::load(&ParameterArgs { files, ..Default::default() })?;
    let bag = open_bag(path)?;
    // A bag can be checked on a machine where no node can start.
    let buffer = Transport::from_environment()
        .map_err(ShellError::from)
        .and_then(|transport| transport.probe_receive_buffer())
        .ok()
        .map(ReceiveBuffer::from);
    let parameters = (parameters, !args.parameter_files.is_empty());
    let findings = bag::findings(&bag, &args.topics, parameters, buffer.as_ref())?;
    Ok(Report { findings, ..Report::default() })
}

fn examine_graph(args: &DoctorArgs, ros: &RosArguments) -> Result<Report, Failure> {
    // What the node would log is among the findings.
    let quiet = [LogDirective { logger: None, level: LogLevel::Error }];
    let levels = if ros.log.is_empty() { &quiet[..] } else { &ros.log };
    node_shell::log::start(LOGGER, levels, &ros.outputs);
    let transport = match Transport::from_environment() {
        Ok(transport) => transport,
        Err(error) => return Ok(only(&error)),
    };
    let machine = match Machine::read(&transport) {
        Ok(machine) => machine,
        Err(error) => return Ok(only(&error)),
    };
    let listening = Listening { span: args.seconds, measure: args.measure };
    let is_zenoh = transport.is_zenoh();
    let (view, buffer) = listen(transport, ros, listening)?;
    let mut findings = if is_zenoh {
        // Interfaces, ports and buffers are the router's affair.
        let begin =
            Finding::ok(Check::Transport, format!("the environment selects {}", machine.transport));
        [begin].into_iter().chain(view.router()).collect()
    } else {
        machine.findings(&buffer)
    };
    findings.extend(view.findings(&machine, &buffer));
    // Where there is none, the findings say what is missing.
    if let Ok(proposal) = Proposal::of(&view) {
        if let Ok(command) = proposal.command(&[], ros) {
            findings.push(Finding::ok(Check::Inputs, format!("for this graph: {command}")));
        }
        if !proposal.knows_mounts() {
            // A preset may be what the suite is going to be started with.
            findings.push(Finding::ok(
                Check::Extrinsics,
                "tf does not say where scanner and camera are on the robot: `stillmap up --rig` takes a preset, or a parameter file with their \
                 mounts; where they are not known, `stillmap record -o rig.mcap`, with walls in view of both, then `stillmap calibrate \
                 rig.mcap -o extrinsics.yaml` and --rig extrinsics.yaml",
            ));
        }
    }
    Ok(Report { findings, topics: view.listing(), tally: Tally::default() })
}

/// With such an environment no node starts, so nothing else can be checked.
fn only(error: &TransportError) -> Report {
    let finding = Finding::error(
        Check::Environment,
        format!("no node can start: {}={} is not understood", error.variable, error.value),
        format!("export {}=... with {}; or unset it", error.variable, error.accepted),
    );
    Report { findings: vec![finding], ..Report::default() }
}

/// Listens to the graph; returns what was observed, and the receive buffer that the kernel granted.
pub(crate) fn listen(
    transport: Transport,
    ros: &RosArguments,
    listening: Listening,
) -> Result<(GraphView, ReceiveBuffer), Failure> {
    let (view, granted) = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .map_err(|error| Failure::new(format!("cannot start threads: {error}")))?
        .block_on(graph::listen(transport, ros, listening))
        .map_err(|error| Failure::new(error.to_string()))?;
    Ok((view, granted.map_or(ReceiveBuffer::OF_A_STREAM, ReceiveBuffer::from)))
}

fn seconds(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=LONGEST_S).contains(&seconds) => Ok(Duration::from_secs_f64(seconds)),
        _ => Err(format!("accepted are seconds from 0 to {LONGEST_S}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_seconds_within_an_hour() {
        assert_eq!(seconds("1.5"), Ok(Duration::from_millis(1500)));
        for bad in ["-1", "nan", "inf", "3601", "soon", ""] {
            assert!(seconds(bad).is_err(), "{bad}");
        }
    }
}
