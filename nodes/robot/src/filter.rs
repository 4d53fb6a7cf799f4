//! `stillmap filter`: a recording without what moves.

mod job;
mod queue;

use std::path::PathBuf;

use bag_player::{BagError, BagInfo, Selection};
use clap::Args;
use detection::shell::ColourInput;
use geometry::BeamFill;
use msgs::RosMessage;
use msgs::sensor_msgs::{CompressedImage, Image, LaserScan, PointCloud2};
use serde::Serialize;

use self::job::Job;
use self::queue::Replaced;
use crate::console;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::open_bag::open_bag_while;
use crate::progress::Progress;
use crate::run::colour_topics::ColourTopics;
use crate::run::inputs::{Inputs, TopicArgs, ViewTopics};
use crate::run::parameters::{ParameterArgs, PipelineParameters};
use crate::run::{are_many, choose_inputs};

/// Beyond detection's wait, in which a scan becomes a cycle or is dropped.
const SPARE_WAIT_S: f64 = 0.5;

/// Arguments of `stillmap filter`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap filter room.mcap -o room_static.mcap --scan /laser/scan

Every message of the bag is in the other one, in its order and byte for byte, except those of the scanner and of the depth
camera (images, or clouds with --points): in their place, with their stamps, are the same without what moves. With --colour so
are the images of the colour camera, black where something moves.")]
pub struct FilterArgs {
    /// A bag (MCAP, sqlite3 or ROS 1, recognised by its content) or a rosbag2 folder
    bag: PathBuf,
    #[command(flatten)]
    output: BagOutput,
    #[command(flatten)]
    topics: TopicArgs,
    /// What a beam has that hit something moving: no measurement, or the range of the static surface behind it, where that is
    /// known
    #[arg(long, value_parser = ["nan", "background"])]
    fill: Option<String>,
    /// Make what moves black in the raw images of the colour camera, too (--image names their topic)
    #[arg(long)]
    colour: bool,
    #[command(flatten)]
    parameters: ParameterArgs,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// What is printed.
#[derive(Serialize)]
struct Printed {
    path: PathBuf,
    messages: u64,
    cycles: usize,
    /// Scans that became no cycle: they are filtered by the cycles beside them.
    scans_without_cycle: u64,
    scans: Replaced,
    views: Replaced,
    /// Of the colour camera; none without --colour.
    colours: Replaced,
    /// Topics of sensors that are as they were, though what moves may be in them.
    not_filtered: Vec<String>,
}

/// Runs `stillmap filter`.
pub(crate) fn run(args: &FilterArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    args.output.check()?;
    args.output.refuse_itself(&args.bag)?;
    let bag = open_bag_while(&args.bag, interrupt)?;
    let info = bag.info().map_err(failed)?;
    let mut parameters = PipelineParameters::load(&args.parameters)?;
    let (mut inputs, note) = choose_inputs(&bag, &info, &args.topics, &mut parameters)?;
    note.into_iter().chain(args.parameters.misspelt()?).for_each(console::note);
    if args.colour {
        inputs.colour = Some(ColourTopics::to_be_masked(&args.topics, &inputs.view, &bag, &info)?);
    }
    // The filtered messages are the bag's own.
    parameters.set_colour(ColourInput::None);
    let longest_s = parameters.detection().max_wait_s + SPARE_WAIT_S;
    let filter = parameters.filter_mut();
    // A recording has time: each message waits for its own cycle.
    (filter.static_scan_max_wait_s, filter.static_depth_max_wait_s) = (longest_s, longest_s);
    if let Some(fill) = &args.fill {
        filter.static_scan_fill =
            if fill == "background" { BeamFill::Background } else { BeamFill::Nan };
    }

    let mut job = Job::begin(args, (&bag, &info), &inputs, &parameters)?;
    let progress = Progress::new("filtering", info.message_count);
    let mut messages = bag.messages(&Selection::default()).map_err(failed)?;
    for message in messages.by_ref() {
        if interrupt.has_come() {
            break;
        }
        job.take(message.map_err(failed)?)?;
        progress.advance();
    }
    let finished = job.finish(&args.bag)?;
    progress.finish();
    let mut lost: Vec<Failure> =
        messages.losses().iter().map(|loss| Failure::new(format!("lost: {loss}"))).collect();
    lost.extend(messages.skipped().iter().map(|(topic, skipped)| {
        let (messages, encoding) = (skipped.messages, &skipped.encoding);
        Failure::new(format!("{topic}: {messages} messages are left out: they are encoded as {encoding}, and only cdr (ROS 2) is read"))
    }));
    lost.extend(finished.unfiltered.into_iter().map(Failure::new));
    lost.extend(left_in(&finished.printed, &inputs).into_iter().map(Failure::new));
    lost.extend(finished.findings);
    lost.iter().for_each(console::print_failure);
    let mut printed = finished.printed;
    printed.not_filtered = others(&info, &inputs);
    print(&printed, args.json)?;
    if interrupt.has_come() {
        let path = args.output.path().display();
        console::note(format_args!("interrupted: {path} has what was filtered until then"));
        return Ok(Outcome::Interrupted);
    }
    Ok(if lost.is_empty() { Outcome::Complete } else { Outcome::WithLosses })
}

fn failed(error: BagError) -> Failure {
    Failure::new(error.to_string())
}

/// What may still have what moves, of what the user asks to be filtered.
fn left_in(printed: &Printed, inputs: &Inputs) -> Vec<String> {
    let mut left_in = Vec::new();
    let (cycles, without) = (printed.cycles, printed.scans_without_cycle);
    if are_many(without, cycles) {
        left_in.push(format!(
            "{without} scans became no cycle, {cycles} did: what moves at other times is still in the bag; `stillmap doctor BAG` says what is \
             missing"
        ));
    }
    if let ViewTopics::Depth { image, .. } = &inputs.view
        && inputs.view.is_compressed()
    {
        left_in.push(format!(
            "{image}: compressed depth images are kept as they are, with what moves"
        ));
    }
    left_in
}

/// Topics of scanners and depth cameras that are not filtered.
fn others(info: &BagInfo, inputs: &Inputs) -> Vec<String> {
    let kinds = [
        LaserScan::TYPE_NAME,
        PointCloud2::TYPE_NAME,
        Image::TYPE_NAME,
        CompressedImage::TYPE_NAME,
    ];
    let is_other = |topic: &&bag_player::TopicInfo| {
        kinds.contains(&topic.type_name.as_str())
            && topic.message_count > 0
            && !topic.topic.starts_with("/truth/")
            && topic.topic != inputs.scan
            && !matches!(&inputs.view, ViewTopics::Depth { image, .. }
                if *image == topic.topic && !inputs.view.is_compressed())
            && !matches!(&inputs.view, ViewTopics::Points(points) if *points == topic.topic)
            && inputs.colour.as_ref().is_none_or(|colour| colour.image != topic.topic)
    };
    info.topics.iter().filter(is_other).map(|topic| topic.topic.clone()).collect()
}

fn print(printed: &Printed, json: bool) -> Result<(), Failure> {
    if json {
        let json = serde_json::to_string_pretty(printed)
            .map_err(|error| Failure::new(format!("cannot print the summary: {error}")))?;
        return console::print(json);
    }
    let Printed {
        path,
        messages,
        cycles,
        scans_without_cycle,
        scans,
        views,
        colours,
        not_filtered,
    } = printed;
    console::print(format_args!("{}: {messages} messages", path.display()))?;
    console::print(format_args!(
        "scans: {} of {} changed, {} beams taken out; {cycles} cycles, {scans_without_cycle} scans without one",
        scans.changed, scans.messages, scans.taken_out
    ))?;
    console::print(format_args!(
        "images or clouds: {} of {} changed, {} pixels or points taken out",
        views.changed, views.messages, views.taken_out
    ))?;
    if colours.messages > 0 {
        console::print(format_args!(
            "colour images: {} of {} changed, {} pixels made black",
            colours.changed, colours.messages, colours.taken_out
        ))?;
    }
    if !not_filtered.is_empty() {
        console::print(format_args!("as they were: {}", not_filtered.join(", ")))?;
    }
    Ok(())
}
