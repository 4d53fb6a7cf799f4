//! `stillmap up --detect`: what the live graph has for the suite.

use std::time::Duration;

use node_shell::{RosArguments, Transport};

use crate::console;
use crate::doctor::{Listening, Proposal, listen};
use crate::failure::Failure;

/// How long the graph is listened to: cameras and scanners are discovered within a second or two, and a scanner at 5 Hz sends
/// some messages. Where something is missing, once more and longer: drivers that have just been started need some seconds.
const LISTENING_S: [u64; 2] = [5, 15];

/// Listens to the graph, and prints what it has and the command for that; `None` where a signal ends it. `own` are the arguments for the
/// program itself.
///
/// # Errors
/// When an input is missing or not clear, or nothing can be heard.
pub(super) fn detect(ros: &RosArguments, own: &[String]) -> Result<Option<Proposal>, Failure> {
    let transport = Transport::from_environment()
        .map_err(|error| Failure::new(format!("no node can start: {error}")))?;
    let mut heard = Err(Failure::new("nothing was heard"));
    for span in LISTENING_S.map(Duration::from_secs) {
        let (graph, _) = listen(transport.clone(), ros, Listening { span, measure: true })?;
        // Who ends it while it listens does not want to hear what is missing, and no suite.
        if graph.is_interrupted {
            return Ok(None);
        }
        heard = Proposal::of(&graph);
        if heard.is_ok() {
            break;
        }
    }
    let proposal = heard?;
    for input in &proposal.inputs {
        let rate = input.rate_hz.map_or_else(
            || "published, nothing came".to_owned(),
            |rate_hz| format!("{rate_hz:.1} a second"),
        );
        console::print(format_args!("{:22} {}  {rate}", input.name, input.topic))?;
    }
    for note in &proposal.notes {
        console::note(note);
    }
    let command = proposal.command(own, ros).map_err(|error| Failure::new(error.to_string()))?;
    console::print(command)?;
    Ok(Some(proposal))
}

/// The arguments of the user with those of a proposal behind them: where both name a topic or a parameter, the user's holds.
///
/// # Errors
/// When the proposal is no arguments: a name of the graph that a command line cannot have.
pub(super) fn with_proposal(
    ros: &RosArguments,
    proposal: &Proposal,
) -> Result<RosArguments, Failure> {
    let words =
        std::iter::once("--ros-args").chain(proposal.ros_arguments.iter().map(String::as_str));
    let proposed = RosArguments::parse(words).map_err(|error| Failure::new(error.to_string()))?;
    let mut arguments = ros.clone();
    arguments.remappings.extend(proposed.remappings);
    // The last value of a parameter holds, and the first rule for a topic.
    arguments.parameters.splice(0..0, proposed.parameters);
    Ok(arguments)
}
