//! The bag on its way through the pipeline: each message goes to the nodes that want it, and comes out filtered, or as it was.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use bag_player::{Bag, BagInfo, BagMessage};
use msgs::cdr;
use msgs::sensor_msgs::{Image, LaserScan, PointCloud2};
use node_shell::{NodeFailure, Qos, Subscription};

use super::queue::{Outgoing, Queue};
use super::{FilterArgs, Printed, failed};
use crate::bag_copy::BagCopy;
use crate::failure::Failure;
use crate::run::inputs::{Inputs, ViewTopics};
use crate::run::parameters::PipelineParameters;
use crate::run::pipeline::Pipeline;
use crate::run::{local, no_map, of_sensors};

/// Filtered messages that may wait: all are taken after each message of the bag.
const FILTERED_KEPT: usize = 1024;

/// The bag on its way through the pipeline.
pub(super) struct Job<'a> {
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

/// What came of it.
pub(super) struct Finished {
    pub(super) printed: Printed,
    pub(super) unfiltered: Vec<String>,
    /// What is doubtful of the readings that it was filtered by.
    pub(super) findings: Vec<Failure>,
}

impl<'a> Job<'a> {
    pub(super) fn begin(
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
    pub(super) fn take(&mut self, message: BagMessage) -> Result<(), Failure> {
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

    pub(super) fn finish(mut self, bag: &Path) -> Result<Finished, Failure> {
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
        let mut findings = of_sensors(&doubtful, &record, self.inputs);
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

fn of_node(error: NodeFailure) -> Failure {
    Failure::new(error.to_string())
}

fn encoded(error: cdr::CdrError) -> Failure {
    Failure::new(format!("cannot encode a filtered message: {error}"))
}
