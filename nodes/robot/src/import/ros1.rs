//! `stillmap import ros1`: a bag of ROS 1 as a bag of ROS 2.

use std::path::PathBuf;

use bag_player::convert_ros1;
use clap::Args;

use super::print_summary;
use crate::console;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;

/// Arguments of `stillmap import ros1`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap import ros1 people.bag -o people.mcap")]
pub struct Ros1Args {
    /// The bag of ROS 1 (format 2.0)
    #[arg(value_name = "FILE")]
    bag: PathBuf,
    #[command(flatten)]
    pub(super) output: BagOutput,
}

pub(crate) fn import(args: &Ros1Args, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let goes_on = || !interrupt.has_come();
    let conversion = convert_ros1(&args.bag, args.output.path(), goes_on).map_err(|error| {
        let cause = std::error::Error::source(&error).map(|cause| format!(": {cause}"));
        Failure::new(format!("{error}{}", cause.unwrap_or_default()))
    })?;
    for (topic, left_out) in &conversion.left_out {
        console::print_failure(&Failure::new(format!(
            "{topic} ({}): {} messages are left out: {}",
            left_out.type_name, left_out.messages, left_out.reason
        )));
    }
    if let Some(reason) = &conversion.broken_off {
        console::print_failure(&Failure::new(format!(
            "{} could not be read to its end: {reason}",
            args.bag.display()
        )));
    }
    let summary = &conversion.summary;
    let complete = conversion.left_out.is_empty() && conversion.broken_off.is_none();
    let outcome = if complete { Outcome::Complete } else { Outcome::WithLosses };
    print_summary(&args.output, summary, interrupt, outcome)
}
