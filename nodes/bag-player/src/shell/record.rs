//! The recorder of the live graph, as `stillmap record`.

mod error;
mod options;
#[cfg(test)]
mod over_dds;
mod quality;
mod queue;
mod status;
mod subscriptions;
mod summary;
mod writing;

use std::process::ExitCode;
use std::time::{Duration, Instant};

use node_shell::{Node, NodeFailure, RosArguments, ShellError};

use crate::shell::{INCOMPLETE, on_a_node, print_summary};
use status::StatusLine;
use subscriptions::{Subscriptions, Wanted};
use writing::Writing;

pub use error::RecordError;
pub use options::RecordOptions;
pub use summary::{RecordSummary, RecordedTopic};

/// Name of the node, unless the command line gives another.
const NODE_NAME: &str = "bag_recorder";
/// How often the recorder looks for new topics.
const LOOK: Duration = Duration::from_millis(100);

/// The text below the options in `--help`.
pub const EXAMPLES: &str = "\
Examples:
  stillmap record -o room.mcap
  stillmap record -o room.mcap --topics /scan,/camera/depth/image_raw,/camera/depth/camera_info,/tf,/tf_static
  stillmap record -o room.mcap --exclude /camera/depth/points --duration 60 --json
  stillmap record -o replayed.mcap --ros-args -p use_sim_time:=true

Ctrl-C, SIGTERM or the end of its terminal ends the recording and closes the bag. Until then it is room.mcap.tmp, which can be read,
but for the last messages, of two seconds. With use_sim_time messages are logged at the time of /clock; before its first tick nothing is recorded.

Exit codes: 0 all was recorded; 1 it could not be recorded; 2 wrong arguments; 3 it was recorded, but messages were lost in
transit, or a topic of --topics never appeared.";

/// Runs the recorder: prints the summary and returns the exit code.
///
/// # Errors
/// When nothing can be recorded, or the bag cannot be written.
pub fn run(options: &RecordOptions, ros: &RosArguments) -> Result<ExitCode, NodeFailure> {
    options.check()?;
    let identity = ros.identity(NODE_NAME).map_err(ShellError::from)?;
    node_shell::log::start(&identity.logger_name(), &ros.log, &ros.outputs);
    ros.warn_of_options_without_effect();
    let summary = on_a_node(NODE_NAME, ros, async |node| record(options, node).await)?;
    print_summary(&summary, options.json)?;
    Ok(if summary.is_complete() { ExitCode::SUCCESS } else { ExitCode::from(INCOMPLETE) })
}

/// Records the topics on the network of `node`, until it is shut down or the duration of the options is over.
///
/// # Errors
/// When the bag already exists or cannot be written, or a name is invalid. Messages lost in transit and topics without a
/// publisher are not errors but part of the summary.
pub async fn record(options: &RecordOptions, node: &Node) -> Result<RecordSummary, RecordError> {
    options.check()?;
    let longest = options.longest()?;
    // Before the bag is created, so that a refused name leaves no file.
    let wanted = Wanted::new(node, options)?;
    let mut writing = Writing::start(options)?;
    let started = Instant::now();
    let mut subscriptions = Subscriptions::new(node, wanted, writing.queue());
    let mut status = StatusLine::new(started);
    let shutdown = node.shutdown_signal();
    loop {
        subscriptions.open_more(&node.survey());
        status.update(writing.written());
        writing.warn_if_behind();
        let left = longest.map_or(LOOK, |longest| longest.saturating_sub(started.elapsed()));
        if left.is_zero() {
            break;
        }
        tokio::select! {
            () = shutdown.wait() => break,
            // The disk may be full: the thread returns the error at its end.
            () = writing.has_failed() => break,
            () = tokio::time::sleep(left.min(LOOK)) => {}
        }
    }
    status.clear();
    let duration_s = started.elapsed().as_secs_f64();
    let (topics, not_recorded) = subscriptions.close().await;
    let bag = writing.finish().await?;
    Ok(RecordSummary::new(bag, topics, not_recorded, duration_s))
}
