//! `stillmap bench`: the throughput and latency of the transport on this machine, with separate publishing and subscribing
//! ends; the time of a cycle over an hour; and the suite live for as long.

mod figures;
mod latency;
mod pair;
mod publish;
mod reception;
mod sample;
mod soak;
mod subscribe;
mod tour;
mod transport;
mod usage;

use std::time::Duration;

use clap::{Args, Subcommand};
use node_shell::{Qos, RosArguments, ShellError};

use robot::{Failure, Outcome};

/// Threads of an end's runtime: one for discovery while the other one works.
const THREADS: usize = 2;
/// The longest run that is accepted: one day.
const LONGEST_RUN_S: f64 = 86_400.0;

/// Arguments of `stillmap bench`.
#[derive(Subcommand, Debug)]
pub enum BenchArgs {
    /// Publish images at a constant rate, and report the cost
    Publish(publish::PublishArgs),
    /// Receive images, and report their number, latency and cost
    Subscribe(subscribe::SubscribeArgs),
    /// Both ends as two nodes of one process
    Pair(pair::PairArgs),
    /// Payloads of 0.1 to 9.8 MB at 7, 10 and 30 Hz between processes of this machine, as a table
    Transport(transport::TransportArgs),
    /// An hour's tour through a simulated building: the time of a cycle in each minute, and the memory
    Tour(tour::TourArgs),
    /// The suite live for an hour: memory, open files and threads that grow
    Soak(soak::SoakArgs),
}

/// The QoS of the topic.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct DeliveryArgs {
    /// Reliable: lost messages are sent again
    #[arg(long)]
    reliable: bool,
    /// Transient local: late subscribers get the last messages; implies --reliable
    #[arg(long)]
    latched: bool,
    /// The queue depth [default: 5, 1 with --latched]
    #[arg(long, value_name = "MESSAGES")]
    depth: Option<usize>,
}

/// The depth of the suite's sensor topics.
const SENSOR_DEPTH: usize = 5;

impl DeliveryArgs {
    fn qos(self) -> Qos {
        let depth = self.depth.unwrap_or(if self.latched { 1 } else { SENSOR_DEPTH });
        Qos::new(self.reliable || self.latched, self.latched, depth)
    }
}

pub(crate) fn run(args: BenchArgs, ros: &RosArguments) -> Result<Outcome, Failure> {
    match args {
        BenchArgs::Publish(args) => publish::run(&args, ros),
        BenchArgs::Subscribe(args) => subscribe::run(&args, ros),
        BenchArgs::Pair(args) => pair::run(&args, ros),
        BenchArgs::Transport(args) => transport::run(&args),
        BenchArgs::Tour(args) => tour::run(&args),
        BenchArgs::Soak(args) => soak::run(&args, ros),
    }
}

/// Runs an end as the node `name`, like the nodes of the suite.
fn as_node<T>(
    name: &str,
    ros: &RosArguments,
    body: impl Future<Output = Result<T, Failure>>,
) -> Result<T, Failure> {
    let identity = ros.identity(name).map_err(|error| Failure::new(error.to_string()))?;
    node_shell::log::start(&identity.logger_name(), &ros.log, &ros.outputs);
    ros.warn_of_options_without_effect();
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(THREADS)
        .enable_all()
        .build()
        .map_err(|error| Failure::new(format!("cannot start threads: {error}")))?
        .block_on(body)
}

fn shell_failure(error: ShellError) -> Failure {
    Failure::new(error.to_string())
}

/// Prints the report of an end as one JSON object.
fn print_report(report: &impl serde::Serialize) -> Result<Outcome, Failure> {
    let json = serde_json::to_string(report)
        .map_err(|error| Failure::new(format!("cannot print the report: {error}")))?;
    robot::console::print(json)?;
    Ok(Outcome::Complete)
}

/// Prints that this end has found its first peer, for the process that started it.
fn tell_matched() {
    use std::io::Write;
    // Where stderr is closed, nobody reads it.
    let _ = writeln!(std::io::stderr(), "matched");
}

/// Parses a time on the command line.
fn seconds(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=LONGEST_RUN_S).contains(&seconds) => {
            Ok(Duration::from_secs_f64(seconds))
        }
        _ => Err(format!("accepted are seconds from 0 to {LONGEST_RUN_S}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_seconds_within_a_day() {
        assert_eq!(seconds("1.5"), Ok(Duration::from_millis(1500)));
        for bad in ["-1", "nan", "inf", "1e9", "soon", ""] {
            assert!(seconds(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_latched_topic_is_reliable_and_keeps_one() {
        let args = |reliable, latched, depth| DeliveryArgs { reliable, latched, depth };
        assert_eq!(args(false, false, None).qos(), Qos::sensor(5));
        assert_eq!(args(true, false, Some(7)).qos(), Qos::reliable(7));
        assert_eq!(args(false, true, None).qos(), Qos::latched());
    }
}
