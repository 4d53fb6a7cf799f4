//! `stillmap import bag`: a bag of any format that is read, as an MCAP file.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use bag_player::{
    Bag, BagError, BagInfo, BagMessage, BagSummary, BagWriter, ChannelId, Selection, convert_ros1,
    is_ros1,
};
use clap::Args;

use super::print_summary;
use crate::console;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;

/// Arguments of `stillmap import bag`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap import bag people.bag -o people.mcap         ROS 1 (format 2.0), also as `import ros1`
  stillmap import bag people -o people.mcap             a rosbag2 folder
  stillmap import bag people_0.db3 -o people.mcap")]
pub struct BagArgs {
    /// A bag: ROS 1, sqlite3 or MCAP, told by its content, or a rosbag2 folder
    #[arg(value_name = "BAG")]
    bag: PathBuf,
    #[command(flatten)]
    pub(super) output: BagOutput,
}

pub(crate) fn import(args: &BagArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let is_itself = |path: &PathBuf| {
        let real = path.canonicalize();
        real.is_ok_and(|real| args.output.path().canonicalize().is_ok_and(|output| output == real))
    };
    if is_itself(&args.bag) {
        return Err(Failure::new(format!("{} cannot replace itself", args.bag.display()))
            .fix("-o names another place"));
    }
    let (summary, lost) =
        if is_ros1(&args.bag) { from_ros1(args, interrupt)? } else { copy(args, interrupt)? };
    for line in &lost {
        console::print_failure(&Failure::new(line.clone()));
    }
    let outcome = if lost.is_empty() { Outcome::Complete } else { Outcome::WithLosses };
    print_summary(&args.output, &summary, interrupt, outcome)
}

/// Converts message by message, and says what does not come along.
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

/// Copies the messages as they are.
fn copy(args: &BagArgs, interrupt: &Interrupt) -> Result<(BagSummary, Vec<String>), Failure> {
    let failed = |error: BagError| Failure::new(error.to_string());
    let bag = Bag::open(&args.bag).map_err(failed)?;
    let info = bag.info().map_err(failed)?;
    let mut messages = bag.messages(&Selection::default()).map_err(failed)?;
    let mut copy = Copy::begin(args, &info).map_err(failed)?;
    for message in messages.by_ref() {
        if interrupt.has_come() {
            break;
        }
        copy.write(&message.map_err(failed)?).map_err(failed)?;
    }
    let mut lost: Vec<String> =
        messages.losses().iter().map(|loss| format!("lost: {loss}")).collect();
    lost.extend(messages.skipped().iter().map(|(topic, skipped)| {
        format!(
            "{topic}: {} messages are left out: they are encoded as {}, and only cdr (ROS 2) is read",
            skipped.messages, skipped.encoding
        )
    }));
    let summary = copy.writer.finish().map_err(failed)?;
    Ok((summary, lost))
}

struct Copy {
    writer: BagWriter,
    /// By topic and type.
    channels: BTreeMap<(Arc<str>, Arc<str>), ChannelId>,
}

impl Copy {
    /// Begins a bag with the playable topics of another, also those without messages.
    fn begin(args: &BagArgs, info: &BagInfo) -> Result<Self, BagError> {
        let mut copy =
            Self { writer: BagWriter::create(args.output.path())?, channels: BTreeMap::new() };
        for topic in info.topics.iter().filter(|topic| topic.is_playable()) {
            let key = (topic.topic.as_str().into(), topic.type_name.as_str().into());
            let known = || msgs::schema_of(&topic.type_name);
            let definition = topic.definition.clone().or_else(known).unwrap_or_default();
            let qos = topic.qos.map(|qos| qos.to_yaml()).unwrap_or_default();
            let id = copy.writer.raw_channel(&topic.topic, &topic.type_name, &definition, &qos)?;
            copy.channels.insert(key, id);
        }
        Ok(copy)
    }

    fn write(&mut self, message: &BagMessage) -> Result<(), BagError> {
        let key = (Arc::clone(&message.topic), Arc::clone(&message.type_name));
        let id = match self.channels.get(&key) {
            Some(id) => *id,
            None => {
                let id = self.writer.raw_channel(&message.topic, &message.type_name, "", "")?;
                self.channels.insert(key, id);
                id
            }
        };
        self.writer.write_raw(id, message.log_time, message.publish_time, &message.data)
    }
}
