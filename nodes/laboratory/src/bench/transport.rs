//! `stillmap bench transport`: losses, latency and cost of the transport on this machine with its
//! settings.

mod case;
mod cyclone;
mod end;
pub(super) mod machine;
mod measurement;
mod ours;
pub(super) mod pipe;
mod place;
mod scenario;
pub(super) mod table;

use clap::Args;
use serde::Serialize;

use self::case::{Case, Mode, PAYLOADS_MB, RATES_HZ, ReliabilityChoice, matrix};
use self::machine::Machine;
use self::measurement::{Measurement, Peers, Row};
use self::place::Place;
use self::scenario::{Scenario, ScenarioReport};
use super::figures::FigureArgs;
use robot::Progress;
use robot::console;
use robot::{Failure, Outcome};

/// The duration of a run of a case.
const RUN_S: f64 = 5.0;
/// The duration of a run with --quick.
const QUICK_RUN_S: f64 = 2.0;
/// The number of runs of a case; the table has the medians.
const RUNS: u32 = 3;
/// The duration of a scenario.
const SCENARIO_S: f64 = 600.0;
/// The payload of a scenario: a cloud of 307,200 points.
const SCENARIO_MB: f64 = 4.9;
/// The rate of a scenario, and with --quick: a Kinect's.
const KINECT_HZ: f64 = 30.0;
/// The largest accepted payload, more than any message of a robot: a limit, so that a typing error does not use up the machine's
/// memory.
const LARGEST_MB: f64 = 256.0;

/// Arguments of `stillmap bench transport`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap bench transport --quick
  stillmap bench transport --payload 4.9 9.8 --rate 30 --mode all-networks localhost composed -o figures.json
  stillmap bench transport --scenario reader-crash --seconds 60

Latency is from the stamp, taken before a message is published, to the moment when the subscriber takes it.
That of Cyclone DDS is half of the round trip of the tenth of the messages that come back at full size; its
p99 is the largest one of any second.")]
pub struct TransportArgs {
    /// One run of 2 s of each payload at 30 Hz
    #[arg(long)]
    quick: bool,
    /// Payloads in megabytes [default: 0.1 0.6 1 4.9 9.8; in a scenario 4.9]
    #[arg(long, value_name = "MB", num_args = 1.., value_parser = payload_mb)]
    payload: Vec<f64>,
    /// Messages per second [default: 7 10 30; in a scenario and with --quick 30]
    #[arg(long, value_name = "HZ", num_args = 1.., value_parser = super::publish::rate)]
    rate: Vec<f64>,
    /// The reliability of the topic
    #[arg(long, value_enum, default_value_t = ReliabilityChoice::Both)]
    reliability: ReliabilityChoice,
    /// The duration of a run in seconds [default: 5; 2 with --quick; in a scenario 600]
    #[arg(long, value_parser = run_seconds)]
    seconds: Option<f64>,
    /// Runs of each case; the table has the medians [default: 3; 1 with --quick and in a scenario]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: Option<u32>,
    /// How the ends are connected
    #[arg(long, value_enum, num_args = 1.., default_value = "all-networks")]
    mode: Vec<Mode>,
    /// Run these scenarios instead of the table
    #[arg(long, value_enum, num_args = 1..)]
    scenario: Vec<Scenario>,
    /// The receive buffer that sockets request, in KiB [default: 32768]
    #[arg(long, value_name = "KIB", value_parser = clap::value_parser!(u32).range(64..1_048_576))]
    buffer_kib: Option<u32>,
    /// Do not measure Cyclone DDS
    #[arg(long)]
    no_cyclone: bool,
    #[command(flatten)]
    figures: FigureArgs,
}

/// The report.
#[derive(Debug, Serialize)]
struct Report {
    machine: Machine,
    seconds: f64,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cases: Vec<Row>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    scenarios: Vec<ScenarioReport>,
}

pub(crate) fn run(args: &TransportArgs) -> Result<Outcome, Failure> {
    args.figures.check()?;
    let machine = Machine::here();
    let (report, table) = if args.scenario.is_empty() {
        let (seconds, cases) = measure(args, &machine)?;
        let table = table::of_rows(&cases);
        (Report { machine, seconds, cases, scenarios: Vec::new() }, table)
    } else {
        let (seconds, scenarios) = play(args)?;
        let table = scenario::table(&scenarios);
        (Report { machine, seconds, cases: Vec::new(), scenarios }, table)
    };
    args.figures.tell(&report, &report.machine, [table])?;
    Ok(Outcome::Complete)
}

/// The table: every case, with each DDS implementation, in the requested number of runs.
fn measure(args: &TransportArgs, machine: &Machine) -> Result<(f64, Vec<Row>), Failure> {
    let seconds = args.seconds.unwrap_or(if args.quick { QUICK_RUN_S } else { RUN_S });
    let runs = args.runs.unwrap_or(if args.quick { 1 } else { RUNS });
    let payloads = given(&args.payload, &PAYLOADS_MB);
    let rates = given(&args.rate, if args.quick { &[KINECT_HZ] } else { &RATES_HZ });
    let cases = matrix(&args.mode, args.reliability, payloads, rates);
    let cyclone = !args.no_cyclone && cyclone_is_here();
    let progress = Progress::new("bench", cases.len() as u64 * u64::from(runs));
    let mut rows = Vec::new();
    let mut place_number = 0;
    for case in &cases {
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        // Alternately, so that other load on the machine affects both equally.
        for _ in 0..runs {
            place_number += 1;
            let place = Place::new(place_number, case.mode, args.buffer_kib);
            let failed = |failure: Failure| failure.within(case);
            ours.push(ours::run(case, seconds, &place).map_err(failed)?);
            if cyclone {
                let run: Option<Measurement> =
                    cyclone::run(case, seconds, &place, args.buffer_kib, machine)
                        .map_err(failed)?;
                theirs.extend(run);
            }
            progress.advance();
        }
        rows.extend(Row::of(Peers::Stillmap, *case, ours));
        rows.extend(Row::of(Peers::CycloneDds, *case, theirs));
    }
    progress.finish();
    Ok((seconds, rows))
}

fn cyclone_is_here() -> bool {
    match cyclone::missing() {
        Some(why) => {
            console::note(why);
            false
        }
        None => true,
    }
}

/// The scenarios, one after the other.
fn play(args: &TransportArgs) -> Result<(f64, Vec<ScenarioReport>), Failure> {
    let seconds = args.seconds.unwrap_or(SCENARIO_S);
    let payloads = given(&args.payload, &[SCENARIO_MB]);
    let rates = given(&args.rate, &[KINECT_HZ]);
    if args.mode.contains(&Mode::Composed) {
        return Err(Failure::new(
            "a scenario has a process for each end; composed has one for both",
        )
        .fix("leave --mode away, or give all-networks or localhost"));
    }
    let cases: Vec<Case> = matrix(&args.mode, args.reliability, payloads, rates);
    let mut reports = Vec::new();
    let mut place_number = 0;
    for &scenario in &args.scenario {
        for case in &cases {
            place_number += 1;
            let place = Place::new(place_number, case.mode, args.buffer_kib);
            let progress = Progress::new("scenario", seconds as u64);
            let report = scenario::run(scenario, case, seconds, &place, &progress)
                .map_err(|failure| failure.within(case))?;
            progress.finish();
            reports.push(report);
        }
    }
    Ok((seconds, reports))
}

fn given<'a>(asked: &'a [f64], default: &'a [f64]) -> &'a [f64] {
    if asked.is_empty() { default } else { asked }
}

/// Parses a payload on the command line.
fn payload_mb(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(megabytes) if megabytes > 0.0 && megabytes <= LARGEST_MB => Ok(megabytes),
        _ => Err(format!("accepted are megabytes above 0, up to {LARGEST_MB}")),
    }
}

/// Parses the duration of a run, which has a minimum.
fn run_seconds(text: &str) -> Result<f64, String> {
    let seconds = super::seconds(text)?.as_secs_f64();
    if seconds < SHORTEST_RUN_S {
        return Err(format!("accepted are seconds from {SHORTEST_RUN_S}"));
    }
    Ok(seconds)
}

/// In a shorter run discovery would take most of the time.
const SHORTEST_RUN_S: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn payloads_and_times_are_within_their_bounds() {
        assert_eq!(payload_mb("4.9"), Ok(4.9));
        assert_eq!(run_seconds("600"), Ok(600.0));
        for bad in ["0", "-1", "257", "nan", "many"] {
            assert!(payload_mb(bad).is_err(), "{bad}");
        }
        for bad in ["0", "0.1", "nan", "1e9"] {
            assert!(run_seconds(bad).is_err(), "{bad}");
        }
    }
}
