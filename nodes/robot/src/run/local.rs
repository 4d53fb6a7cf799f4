//! A bag through the pipeline in one process: the same bag gives the same record, except for the times.

use std::collections::BTreeSet;

use bag_player::{Bag, BagMessage, Loss, Messages, Selection};
use geometry::{OccupancyGrid, TriangleMesh};
use msgs::RosMessage;
use msgs::geometry_msgs::PoseStamped;
use msgs::tf2_msgs::TFMessage;
use node_shell::{NodeFailure, Publisher};
use reconstruction::{BoundReached, GridError, GridSource, MeshError};
use report::RunRecord;

use super::findings::DoubtfulInput;
use super::inputs::{Inputs, TF_STATIC, ViewTopics};
use super::parameters::PipelineParameters;
use super::pipeline::{Pipeline, Sensors};
use super::pose_topics::{PoseSource, PoseTopicKind};
use crate::console;
use crate::failure::Failure;
use crate::import::AddedScans;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::visual::{FeedError, VisualOdometry};

/// The result of a run over a bag: the record, and the parts of the bag that could not be read.
pub(crate) struct LocalRun {
    pub(crate) record: RunRecord,
    pub(crate) losses: Vec<Loss>,
    pub(crate) doubtful: DoubtfulInput,
    /// The bounds that have kept something out of the map.
    pub(crate) bounds_reached: Vec<BoundReached>,
    /// The poses of the visual odometry, where it was asked for.
    pub(crate) poses: Option<Vec<PoseStamped>>,
    /// The occupancy grid, where one was asked for.
    pub(crate) grid: Option<Result<OccupancyGrid, GridError>>,
    /// The surface as triangles, where it was asked for.
    pub(crate) mesh: Option<Result<TriangleMesh, MeshError>>,
    /// Whether a signal has ended it before the end of the bag.
    pub(crate) is_interrupted: bool,
}

/// A bag on its way through the nodes.
pub(super) struct Passage {
    pub(super) pipeline: Pipeline,
    messages: Messages,
    inputs: Inputs,
    added_scans: Option<AddedScans>,
}

/// Passes the fixed transforms of a bag to the nodes, of each frame the first: they hold at all times, wherever they were recorded.
pub(crate) fn publish_fixed_transforms(
    bag: &Bag,
    inputs: &Inputs,
    sensors: &Sensors,
) -> Result<(), Failure> {
    if !inputs.transforms.contains(&TF_STATIC) {
        return Ok(());
    }
    let failed = |error: bag_player::BagError| Failure::new(error.to_string());
    let topics = Some(vec![TF_STATIC.to_owned()]);
    let messages = bag.messages(&Selection { topics, ..Selection::default() }).map_err(failed)?;
    let (mut known, mut first) = (BTreeSet::new(), TFMessage::default());
    for message in messages {
        // What cannot be used is reported in its place among the other messages.
        let Ok(message) = message.map_err(failed)?.decode::<TFMessage>() else { continue };
        for transform in message.transforms {
            if known.insert(transform.child_frame_id.clone()) {
                first.transforms.push(transform);
            }
        }
    }
    let passed = sensors.fixed_transforms.publish(first);
    passed.map_err(|error| Failure::new(error.to_string()))
}

impl Passage {
    /// Begins with the first message.
    pub(super) fn begin(
        bag: &Bag,
        (inputs, added_scans): (Inputs, Option<AddedScans>),
        parameters: &PipelineParameters,
    ) -> Result<Self, Failure> {
        let pipeline = pipeline_for(&inputs, parameters)
            .map_err(|error: NodeFailure| Failure::new(error.to_string()))?;
        let sensors = inputs.by_node_name().into_iter().map(|(_, topic)| topic);
        let topics: BTreeSet<String> =
            sensors.chain(inputs.transforms.iter().copied()).map(str::to_owned).collect();
        // Those of the scans that are added are not in the bag.
        let is_added = |topic: &String| added_scans.is_some() && *topic == inputs.scan;
        let topics = topics.into_iter().filter(|topic| !is_added(topic)).collect();
        let selection = Selection { topics: Some(topics), ..Selection::default() };
        let messages = bag.messages(&selection).map_err(|error| Failure::new(error.to_string()))?;
        publish_fixed_transforms(bag, &inputs, pipeline.sensors())?;
        Ok(Self { pipeline, messages, inputs, added_scans })
    }

    /// Passes the next message to the nodes and lets them process it; `false` after the last one.
    pub(super) fn advance(&mut self) -> Result<bool, Failure> {
        let Some(message) = self.messages.next() else { return Ok(false) };
        let message = message.map_err(|error| Failure::new(error.to_string()))?;
        let pipeline = &mut self.pipeline;
        match self.added_scans.as_mut().map(|added| added.before(&message)) {
            Some(Ok(before)) => {
                for added in before {
                    match publish(&added, &self.inputs, pipeline.sensors()) {
                        Ok(()) => pipeline.flow(),
                        Err(error) => pipeline.unusable_message(&added.topic, error.reason()),
                    }
                }
            }
            Some(Err(failure)) => pipeline.unusable_message(&self.inputs.scan, failure.to_string()),
            None => {}
        }
        let fed = pipeline.visual().map_or(Ok(()), |visual| visual.feed(&message));
        match fed.and_then(|()| publish(&message, &self.inputs, pipeline.sensors())) {
            Ok(()) => pipeline.flow(),
            Err(error) => pipeline.unusable_message(&message.topic, error.reason()),
        }
        Ok(true)
    }

    /// The topics that it reads.
    pub(super) fn inputs(&self) -> &Inputs {
        &self.inputs
    }

    /// The parts of the bag that could not be read so far.
    pub(super) fn losses(&self) -> &[Loss] {
        self.messages.losses()
    }
}

/// Runs a bag through the nodes.
pub(crate) fn run(
    bag: &Bag,
    (inputs, added_scans): (&Inputs, Option<AddedScans>),
    (parameters, wants_mesh): (&PipelineParameters, bool),
    bag_name: &str,
    (progress, interrupt): (&Progress, &Interrupt),
) -> Result<LocalRun, Failure> {
    let mut passage = Passage::begin(bag, (inputs.clone(), added_scans), parameters)?;
    let is_interrupted = loop {
        if interrupt.has_come() {
            break true;
        }
        if !passage.advance()? {
            break false;
        }
        progress.advance();
    };
    let losses = passage.losses().to_vec();
    let mut pipeline = passage.pipeline;
    pipeline.end_of_input();
    let (doubtful, bounds_reached) = (pipeline.doubtful(), pipeline.bounds_reached());
    let poses = pipeline.visual().map(|visual| visual.poses().to_vec());
    if let Some(doubt) = pipeline.visual().and_then(VisualOdometry::registration_doubt) {
        console::note(doubt);
    }
    let wants_grid = parameters.reconstruction().grid.grid != GridSource::None;
    let grid = wants_grid.then(|| pipeline.occupancy_grid());
    let mesh = wants_mesh.then(|| pipeline.mesh());
    let record = pipeline.finish(bag_name);
    Ok(LocalRun { record, losses, doubtful, bounds_reached, poses, grid, mesh, is_interrupted })
}

/// The pipeline for the inputs of a bag.
pub(crate) fn pipeline_for(
    inputs: &Inputs,
    parameters: &PipelineParameters,
) -> Result<Pipeline, NodeFailure> {
    let pipeline = Pipeline::new(inputs.view.input(), &inputs.by_node_name(), parameters)?;
    match &inputs.pose {
        PoseSource::Topic { .. } | PoseSource::Tf => Ok(pipeline),
        PoseSource::Visual(topics) => pipeline.with_visual_odometry(topics, parameters.pose_node()),
    }
}

/// Passes a message of an input to the nodes.
pub(crate) fn publish(
    message: &BagMessage,
    inputs: &Inputs,
    sensors: &Sensors,
) -> Result<(), FeedError> {
    let topic = &*message.topic;
    if inputs.transforms.contains(&topic) {
        let is_fixed = topic == TF_STATIC;
        let publisher = if is_fixed { &sensors.fixed_transforms } else { &sensors.transforms };
        return pass_on(message, publisher);
    }
    if topic == inputs.scan {
        return pass_on(message, &sensors.scans);
    }
    if let PoseSource::Topic { topic: poses, kind } = &inputs.pose
        && topic == poses
    {
        return match kind {
            PoseTopicKind::Pose => pass_on(message, &sensors.poses),
            PoseTopicKind::Odometry => pass_on(message, &sensors.odometry),
            PoseTopicKind::PoseWithCovariance => pass_on(message, &sensors.poses_with_covariance),
        };
    }
    if let Some(colour) = inputs.colour_of_map() {
        if topic == colour.image {
            return if colour.is_compressed {
                pass_on(message, &sensors.compressed_colours)
            } else {
                pass_on(message, &sensors.colours)
            };
        }
        // One that is that of the depth images, too, has both names.
        if topic == colour.camera_info && !inputs.view.has_camera_info(topic) {
            return pass_on(message, &sensors.colour_infos);
        }
    }
    match &inputs.view {
        ViewTopics::Depth { camera_info, .. } if topic == camera_info => {
            pass_on(message, &sensors.camera_infos)
        }
        ViewTopics::Depth { image, .. } if topic == image => {
            if inputs.view.is_compressed() {
                pass_on(message, &sensors.compressed_images)
            } else {
                pass_on(message, &sensors.images)
            }
        }
        // The visual odometry takes it.
        ViewTopics::Depth { .. } => Ok(()),
        ViewTopics::Points(_) => pass_on(message, &sensors.clouds),
    }
}

fn pass_on<M: RosMessage>(message: &BagMessage, publisher: &Publisher<M>) -> Result<(), FeedError> {
    Ok(publisher.publish(message.decode::<M>()?)?)
}
