//! `stillmap import bag`: conversion of a bag of any readable format to an MCAP file.

use std::path::{Path, PathBuf};

use bag_player::{Bag, BagError, BagInfo, BagSummary, Messages, Selection, convert_ros1, is_ros1};
use clap::Args;

use super::added_scans::AddedScans;
use super::print_summary;
use super::scan_cut::ScanCutArgs;
use crate::bag_copy::BagCopy;
use crate::console;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::offer::Offer;
use crate::open_bag::open_bag_while;

/// Arguments of `stillmap import bag`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap import bag people.bag -o people.mcap         ROS 1 (format 2.0), also as `import ros1`
  stillmap import bag people -o people.mcap             a rosbag2 folder
  stillmap import bag people_0.db3 -o people.mcap
  stillmap import bag camera.mcap --scan-from-depth -o with_scan.mcap     without a scanner: scans of the depth images")]
pub struct BagArgs {
    /// A bag: ROS 1, sqlite3 or MCAP, recognised by its content, or a rosbag2 folder
    #[arg(value_name = "BAG")]
    bag: PathBuf,
    #[command(flatten)]
    scan: ScanCutArgs,
    #[command(flatten)]
    pub(super) output: BagOutput,
}

pub(crate) fn import(args: &BagArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    args.output.refuse_itself(&args.bag)?;
    if args.scan.is_requested() && is_ros1(&args.bag) {
        return Err(Failure::unusable("--scan-from-depth: not of a bag of ROS 1")
            .fix("import it first, and then import what comes out with --scan-from-depth"));
    }
    let (summary, lost) =
        if is_ros1(&args.bag) { from_ros1(args, interrupt)? } else { copy(args, interrupt)? };
    for line in &lost {
        console::print_failure(&Failure::new(line.clone()));
    }
    let outcome = if lost.is_empty() { Outcome::Complete } else { Outcome::WithLosses };
    print_summary(&args.output, &summary, interrupt, outcome)
}

/// Converts message by message, and prints the losses.
fn from_ros1(args: &BagArgs, interrupt: &Interrupt) -> Result<(BagSummary, Vec<String>), Failure> {
    let goes_on = || !interrupt.has_come();
    let conversion = convert_ros1(&args.bag, args.output.path(), goes_on)
        .map_err(|error| Failure::new(error.to_string()))?;
    let left_out = conversion.left_out.iter().map(|(topic, left_out)| {
        format!(
            "{topic} ({}): {} messages are left out: {}",
            left_out.type_name, left_out.messages, left_out.reason
        )
    });
    let mut lost: Vec<String> = left_out.collect();
    lost.extend(
        conversion
            .broken_off
            .as_ref()
            .map(|reason| format!("{} could not be read to its end: {reason}", args.bag.display())),
    );
    Ok((conversion.summary, lost))
}

/// Copies the messages unchanged, with the scans that are requested.
fn copy(args: &BagArgs, interrupt: &Interrupt) -> Result<(BagSummary, Vec<String>), Failure> {
    let failed = |error: BagError| Failure::new(error.to_string());
    let bag = open_bag_while(&args.bag, interrupt)?;
    let info = bag.info().map_err(failed)?;
    let offer = Offer::of_bag(&info);
    if offer.is_unread() {
        return Err(Failure::new(format!(
            "{} has no messages{}",
            args.bag.display(),
            offer.unread()
        )));
    }
    let added = AddedScans::new(&args.scan, &info)?;
    let (summary, messages) = copy_to(args.output.path(), (&bag, &info), added, interrupt)?;
    let mut lost: Vec<String> =
        messages.losses().iter().map(|loss| format!("lost: {loss}")).collect();
    lost.extend(messages.skipped().iter().map(|(topic, skipped)| {
        format!(
            "{topic}: {} messages are left out: they are encoded as {}, and only cdr (ROS 2) is read",
            skipped.messages, skipped.encoding
        )
    }));
    Ok((summary, lost))
}

/// Copies the messages of a bag to another one, with scans; returns the reader for what it could not read.
pub(crate) fn copy_to(
    output: &Path,
    (bag, info): (&Bag, &BagInfo),
    mut added: Option<AddedScans>,
    interrupt: &Interrupt,
) -> Result<(BagSummary, Messages), Failure> {
    let failed = |error: BagError| Failure::new(error.to_string());
    let mut messages = bag.messages(&Selection::default()).map_err(failed)?;
    let mut copy = BagCopy::begin(output, info).map_err(failed)?;
    for message in messages.by_ref() {
        if interrupt.has_come() {
            break;
        }
        let message = message.map_err(failed)?;
        let before = added.as_mut().map(|added| added.before(&message)).transpose()?;
        for added in before.into_iter().flatten() {
            copy.write(&added).map_err(failed)?;
        }
        copy.write(&message).map_err(failed)?;
    }
    Ok((copy.finish().map_err(failed)?, messages))
}
