//! The player of a bag over DDS, as `bag-player BAG` or `stillmap play BAG`; and the recorder, as `stillmap record`.

use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;

use clap::Parser;
use node_shell::parameters::NoParameters;
use node_shell::{Node, NodeFailure, RosArguments, ShellError, Unusable};
use serde::Serialize;

use crate::bag::Bag;
use crate::schedule::Schedule;

mod clock;
mod compress;
mod keys;
mod latched;
mod offers;
mod options;
#[cfg(test)]
mod over_dds;
mod pace;
mod play;
mod player;
mod read_ahead;
pub mod record;
mod status;
mod summary;
mod terminal_line;

pub use compress::{ColorCompression, ColorCompressionError, DepthFormat};
pub use options::{PlayOptions, Remap, RemapError};
pub use pace::{PaceBy, PaceByError};
pub use play::{PlayError, play};
pub use summary::{Ending, PlaySummary, TopicSummary};

/// Name of the node, unless the command line gives another.
const NODE_NAME: &str = "bag_player";

/// Exit code where the bag was played with losses.
const INCOMPLETE: u8 = 3;

/// Exit code of a process that was interrupted (128 + SIGINT, the convention of shells).
const INTERRUPTED: u8 = 130;

/// Threads of the runtime: one that publishes, one that answers the network.
const THREADS: usize = 2;

/// Plays a recorded bag over DDS.
///
/// Keys on a terminal: space to pause and continue, s or the right arrow for one message
/// while paused, q to quit. ROS arguments (-r FROM:=TO, -r __ns:=/NAMESPACE, --log-level LEVEL) follow
/// --ros-args.
#[derive(Parser, Debug)]
#[command(name = "bag-player", after_help = EXAMPLES, max_term_width = 100)]
struct Cli {
    #[command(flatten)]
    options: PlayOptions,
}

/// The text below the options in `--help`.
pub const EXAMPLES: &str = "\
Examples:
  bag-player kitchen.mcap --clock --wait-for /scan
  bag-player kitchen.mcap --rate 0.5 --start 10 --duration 5 --topics /scan,/depth/image
  bag-player kitchen.mcap --remap /camera/depth/image_raw:=/depth/image --json
  bag-player kitchen.mcap --compress-depth /camera/depth/image_raw --depth-format rvl
  bag-player kitchen.mcap --compress-color /camera/color/image_raw=80

Exit codes: 0 everything was played; 1 it could not be played; 2 wrong arguments; 3 it was played, but a
part of the bag could not be read or some messages were not sent; 130 interrupted.";

/// Runs the player with the arguments of a command line, without the program's own name.
pub fn run(arguments: impl IntoIterator<Item = String>) -> ExitCode {
    match try_run(arguments) {
        Ok(code) => code,
        Err(error) => {
            // The process ends here; where stderr is closed the error cannot be reported.
            let _ = writeln!(std::io::stderr(), "bag-player: {error}");
            ExitCode::FAILURE
        }
    }
}

fn try_run(arguments: impl IntoIterator<Item = String>) -> Result<ExitCode, NodeFailure> {
    let ros = RosArguments::parse(arguments).map_err(ShellError::from)?;
    let name = std::iter::once("bag-player".to_owned());
    let cli = match Cli::try_parse_from(name.chain(ros.own.iter().cloned())) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are such "errors" too; clap prints each to the right stream.
            error.print()?;
            return Ok(ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(1)));
        }
    };
    run_options(cli.options, &ros)
}

/// Runs the player with parsed options: prints the summary and returns the exit code.
///
/// # Errors
/// When the bag could not be played.
pub fn run_options(options: PlayOptions, ros: &RosArguments) -> Result<ExitCode, NodeFailure> {
    let identity = ros.identity(NODE_NAME).map_err(ShellError::from)?;
    node_shell::log::start(&identity.logger_name(), &ros.log, &ros.outputs);
    ros.warn_of_options_without_effect();
    // What cannot be played is reported without joining the network.
    Schedule::new(options.rate, options.looping)
        .map_err(|error| Unusable::new(error.to_string()))?;
    Bag::open(&options.bag)?;
    let json = options.json;
    let looping = options.looping;
    let summary = on_a_node(NODE_NAME, ros, async |node| play(options, node).await)?;
    print_summary(&summary, json)?;
    Ok(match summary.ending {
        // A loop can only end by being stopped.
        Ending::Interrupted if !looping => ExitCode::from(INTERRUPTED),
        _ if summary.is_complete() => ExitCode::SUCCESS,
        _ => ExitCode::from(INCOMPLETE),
    })
}

/// Runs a task with a new node, which is closed afterwards.
fn on_a_node<T, E>(
    name: &str,
    ros: &RosArguments,
    work: impl AsyncFnOnce(&Node) -> Result<T, E>,
) -> Result<T, NodeFailure>
where
    NodeFailure: From<E>,
{
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(THREADS)
        .enable_all()
        .build()
        .map_err(ShellError::Process)?;
    runtime.block_on(async {
        let node = Node::start(name, ros)?;
        // It has only the parameters of every node.
        node.serve_parameters(&NoParameters {})?;
        let result = work(&node).await;
        node.close().await;
        result.map_err(NodeFailure::from)
    })
}

/// Prints the summary.
fn print_summary(summary: &(impl Display + Serialize), json: bool) -> Result<(), NodeFailure> {
    let mut stdout = std::io::stdout();
    if json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(summary)?)?;
    } else {
        write!(stdout, "{summary}")?;
    }
    Ok(())
}

/// Whether stderr is a terminal.
fn is_watched() -> bool {
    std::io::stderr().is_terminal()
}
