//! `stillmap filter`: a recording without what moves.

mod queue;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use bag_player::{Bag, BagError, BagInfo, BagMessage, Selection};
use clap::Args;
use detection::shell::ColourInput;
use geometry::BeamFill;
use msgs::sensor_msgs::{CompressedImage, Image, LaserScan, PointCloud2};
use msgs::{RosMessage, cdr};
use node_shell::{NodeFailure, Qos, Subscription};
use serde::Serialize;

use self::queue::{Outgoing, Queue, Replaced};
use crate::bag_copy::BagCopy;
use crate::console;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::open_bag::open_bag_while;
use crate::progress::Progress;
use crate::run::colour_topics::ColourTopics;
use crate::run::inputs::{Inputs, TopicArgs, ViewTopics};
use crate::run::parameters::{ParameterArgs, PipelineParameters};
use crate::run::pipeline::Pipeline;
use crate::run::{are_many, choose_inputs, local, no_map, of_sensors};

/// Beyond detection's wait, in which a scan becomes a cycle or is dropped.
const SPARE_WAIT_S: f64 = 0.5;
/// Filtered messages that may wait: all are taken after each message of the bag.
const FILTERED_KEPT: usize = 1024;

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

fn of_node(error: NodeFailure) -> Failure {
    Failure::new(error.to_string())
}

/// The bag on its way through the pipeline.
struct Job<'a> {
    inputs: &'a Inputs,
    pipeline: Pipeline,
    scans: Subscription<LaserScan>,
    images: Subscription<Image>,
    /// None without --colour: the filter makes nothing of the colour images then.
    colours: Option<Subscription<Image>>,
    points: Subscription<PointCloud2>,
    queue: Queue,
    copy: BagCopy,
    /// Messages of a topic that cannot be used, and why the first cannot.
    unusable: BTreeMap<String, (u64, String)>,
}

struct Finished {
    printed: Printed,
    unfiltered: Vec<String>,
    /// What is doubtful of the readings that it was filtered by.
    findings: Vec<Failure>,
}

impl<'a> Job<'a> {
    fn begin(
        args: &FilterArgs,
        (bag, info): (&Bag, &BagInfo),
        inputs: &'a Inputs,
        parameters: &PipelineParameters,
    ) -> Result<Self, Failure> {
        let pipeline = local::pipeline_for(inputs, parameters).map_err(of_node)?;
        let listener = pipeline.listener().map_err(of_node)?;
        let qos = Qos::reliable(FILTERED_KEPT);
        let shell = |error: node_shell::ShellError| Failure::new(error.to_string());
        let mut job = Self {
            inputs,
            scans: listener.subscription("static_scan", &qos).map_err(shell)?,
            images: listener.subscription("static_depth/image", &qos).map_err(shell)?,
            colours: inputs
                .colour
                .as_ref()
                .map(|_| listener.subscription("static_rgb/image", &qos))
                .transpose()
                .map_err(shell)?,
            points: listener.subscription("static_points", &qos).map_err(shell)?,
            pipeline,
            queue: Queue::default(),
            copy: BagCopy::begin(args.output.path(), info).map_err(failed)?,
            unusable: BTreeMap::new(),
        };
        local::publish_fixed_transforms(bag, inputs, job.pipeline.sensors())?;
        // The nodes see that the filtered topics are wanted.
        job.pipeline.flow();
        Ok(job)
    }

    /// Passes a message to the nodes that want it, and writes what has become certain.
    fn take(&mut self, message: BagMessage) -> Result<(), Failure> {
        let fed = self.pipeline.visual().map_or(Ok(()), |visual| visual.feed(&message));
        let topic = &*message.topic;
        let sensors = self.pipeline.sensors();
        let passed = fed.and_then(|()| match &self.inputs.view {
            _ if topic == self.inputs.scan => {
                let scan = Arc::new(message.decode::<LaserScan>()?);
                sensors.scans.publish(Arc::clone(&scan))?;
                Ok(Some(Outgoing::Scan(scan)))
            }
            ViewTopics::Depth { image, .. }
                if topic == image && !self.inputs.view.is_compressed() =>
            {
                let image = Arc::new(message.decode::<Image>()?);
                sensors.images.publish(Arc::clone(&image))?;
                Ok(Some(Outgoing::Image(image)))
            }
            ViewTopics::Points(points) if topic == points => {
                let points = Arc::new(message.decode::<PointCloud2>()?);
                sensors.clouds.publish(Arc::clone(&points))?;
                Ok(Some(Outgoing::Points(points)))
            }
            _ if self.inputs.colour.as_ref().is_some_and(|colour| topic == colour.image) => {
                let colour = Arc::new(message.decode::<Image>()?);
                // The visual odometry has been fed already, on the same topic.
                if self.inputs.colour_of_map().is_some() {
                    sensors.colours.publish(Arc::clone(&colour))?;
                }
                Ok(Some(Outgoing::Colour(colour)))
            }
            _ if self.inputs.is_of(topic) => {
                local::publish(&message, self.inputs, sensors).map(|()| None)
            }
            _ => Ok(None),
        });
        match passed {
            Ok(outgoing) => self.queue.push(message, outgoing),
            Err(error) => {
                let topic = message.topic.to_string();
                self.pipeline.unusable_message(&topic, error.reason());
                let (count, _first) = self.unusable.entry(topic).or_insert((0, error.reason()));
                *count += 1;
                self.queue.push(message, None);
            }
        }
        self.pipeline.flow();
        self.collect()?;
        self.write()
    }

    /// Takes the filtered messages that have come.
    fn collect(&mut self) -> Result<(), Failure> {
        while let Some(received) = self.scans.try_next() {
            self.queue.scan_came(&received.message).map_err(encoded)?;
        }
        while let Some(received) = self.images.try_next() {
            self.queue.image_came(&received.message).map_err(encoded)?;
        }
        while let Some(received) = self.colours.as_ref().and_then(Subscription::try_next) {
            self.queue.colour_came(&received.message).map_err(encoded)?;
        }
        while let Some(received) = self.points.try_next() {
            self.queue.points_came(&received.message).map_err(encoded)?;
        }
        Ok(())
    }

    fn write(&mut self) -> Result<(), Failure> {
        while let Some(message) = self.queue.pop() {
            self.copy.write(&message).map_err(failed)?;
        }
        Ok(())
    }

    fn finish(mut self, bag: &std::path::Path) -> Result<Finished, Failure> {
        self.pipeline.end_of_input();
        self.collect()?;
        let mut unfiltered: Vec<String> = Vec::new();
        for (topic, (messages, first)) in &self.unusable {
            unfiltered.push(format!(
                "{topic}: {messages} messages cannot be used and are kept as they are; the first: {first}"
            ));
        }
        for (topic, messages) in self.queue.give_up() {
            unfiltered.push(format!("{topic}: {messages} messages are kept as they are"));
        }
        self.write()?;
        let [scans, views, colours] = self.queue.replaced();
        let doubtful = self.pipeline.doubtful();
        let record = self.pipeline.finish(&bag.to_string_lossy());
        if let Some(failure) = crate::run::no_cycle(&record) {
            return Err(failure);
        }
        let mut findings = of_sensors(doubtful, &record, self.inputs);
        findings.extend(no_map(&record));
        let of_detection = record.drops.iter().filter(|drop| drop.topic_or_stage == "detection");
        let scans_without_cycle = of_detection.map(|drop| drop.count).sum();
        let summary = self.copy.finish().map_err(failed)?;
        let printed = Printed {
            path: summary.path,
            messages: summary.message_count,
            cycles: record.cycles.len(),
            scans_without_cycle,
            scans,
            views,
            colours,
            not_filtered: Vec::new(),
        };
        Ok(Finished { printed, unfiltered, findings })
    }
}

fn encoded(error: cdr::CdrError) -> Failure {
    Failure::new(format!("cannot encode a filtered message: {error}"))
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
