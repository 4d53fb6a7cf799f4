//! The pipeline in one process: the same nodes as over DDS, on no network, taken in turn. What happens
//! depends on the bag alone, so the same bag gives the same record, but for the times.

use bag_player::{Bag, BagError, BagMessage, Loss, Selection};
use detection::shell::{CloudInput, DetectionParameters, Stage as Detection};
use evaluation::{RunRecord, Transport};
use msgs::RosMessage;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan, PointCloud2};
use node_shell::{
    Counters, Host, Node, NodeFailure, PublishError, Publisher, Qos, RosArguments, ShellError,
};
use reconstruction::shell::Stage as Reconstruction;
use segmentation::shell::Stage as Segmentation;

use super::collector::Collector;
use super::inputs::{Inputs, ViewTopics};
use super::parameters::PipelineParameters;
use super::recorder::{Recorder, RunName, Stage};
use crate::failure::Failure;
use crate::progress::Progress;

/// The nodes' own topics are apart from those of the bag.
const NAMESPACE: &str = "/stillmap_run";

/// What a run over a bag yields: the record, and what of the bag could not be read.
pub(crate) struct LocalRun {
    pub(crate) record: RunRecord,
    pub(crate) losses: Vec<Loss>,
    pub(crate) blind_scans: usize,
}

/// Runs a bag through the nodes.
pub(crate) fn run(
    bag: &Bag,
    inputs: &Inputs,
    parameters: &PipelineParameters,
    bag_name: &str,
    progress: &Progress,
) -> Result<LocalRun, Failure> {
    let failed = |error: NodeFailure| Failure::new(error.to_string());
    let mut pipeline = LocalPipeline::new(inputs, parameters).map_err(failed)?;
    let topics = inputs.by_node_name().into_iter().map(|(_, topic)| topic.to_owned()).collect();
    let selection = Selection { topics: Some(topics), ..Selection::default() };
    let mut messages = bag.messages(&selection).map_err(|error| Failure::new(error.to_string()))?;
    for message in &mut messages {
        let message = message.map_err(|error| Failure::new(error.to_string()))?;
        pipeline.take(&message);
        progress.advance();
    }
    pipeline.end_of_bag();
    let losses = messages.losses().to_vec();
    let blind_scans = pipeline.recorder.blind_scans();
    Ok(LocalRun { record: pipeline.finish(bag_name), losses, blind_scans })
}

struct LocalPipeline {
    sensors: Sensors,
    detection: Detection,
    segmentation: Segmentation,
    reconstruction: Reconstruction,
    collector: Collector,
    recorder: Recorder,
    counters: Counters,
}

impl LocalPipeline {
    fn new(inputs: &Inputs, parameters: &PipelineParameters) -> Result<Self, NodeFailure> {
        let host = Host::in_process();
        let node = |stage: Stage| host.node(stage.name(), &arguments(inputs)?);
        let detection = node(Stage::Detection)?;
        let detection_parameters = DetectionParameters {
            input: match inputs.view {
                ViewTopics::Depth { .. } => CloudInput::Depth,
                ViewTopics::Points(_) => CloudInput::Points,
            },
            ..parameters.detection_node().clone()
        };
        Ok(Self {
            counters: detection.counters(),
            detection: Detection::new(&detection, &detection_parameters)?,
            segmentation: Segmentation::new(
                &node(Stage::Segmentation)?,
                parameters.segmentation_node(),
            )?,
            reconstruction: Reconstruction::new(
                &node(Stage::Reconstruction)?,
                parameters.reconstruction_node(),
            )?,
            collector: Collector::on(host.node("collector", &arguments(inputs)?)?)?,
            recorder: Recorder::new(parameters.reconstruction(), parameters.method_name())?,
            sensors: Sensors::new(&host.node("bag", &arguments(inputs)?)?, inputs)?,
        })
    }

    fn take(&mut self, message: &BagMessage) {
        match self.sensors.publish(message) {
            Ok(()) => self.flow(),
            Err(error) => self.recorder.dropped(&message.topic, &error.to_string(), 1),
        }
    }

    fn end_of_bag(&mut self) {
        self.detection.give_up_waiting();
        self.flow();
    }

    /// Lets each stage take what the one before it has left, until all is through.
    fn flow(&mut self) {
        self.detection.take_waiting();
        self.segmentation.take_waiting();
        self.reconstruction.take_waiting();
        self.collector.hear_waiting(&mut self.recorder);
    }

    fn finish(mut self, bag_name: &str) -> RunRecord {
        for (cause, count) in self.counters.drops() {
            self.recorder.unusable(&cause, count);
        }
        let name = RunName {
            bag_name: bag_name.to_owned(),
            transport: Transport::Local,
            map_frame_id: self.recorder.map_frame_id(),
        };
        self.recorder.finish(self.reconstruction.map().points(), name)
    }
}

/// A node in the run's namespace that knows the inputs by their names in the bag.
fn arguments(inputs: &Inputs) -> Result<RosArguments, ShellError> {
    let mut arguments = vec!["--ros-args".to_owned()];
    arguments.extend(["-r".to_owned(), format!("__ns:={NAMESPACE}")]);
    for (name, topic) in inputs.by_node_name() {
        arguments.extend(["-r".to_owned(), format!("{name}:={topic}")]);
    }
    Ok(RosArguments::parse(arguments)?)
}

/// The bag in the place of the sensors' drivers.
struct Sensors {
    inputs: Inputs,
    scans: Publisher<LaserScan>,
    poses: Publisher<PoseStamped>,
    images: Publisher<Image>,
    camera_infos: Publisher<CameraInfo>,
    clouds: Publisher<PointCloud2>,
}

/// Why a message of the bag reached no node.
#[derive(Debug, thiserror::Error)]
enum FeedError {
    #[error(transparent)]
    Bag(#[from] BagError),
    #[error(transparent)]
    Publish(#[from] PublishError),
}

impl Sensors {
    fn new(node: &Node, inputs: &Inputs) -> Result<Self, NodeFailure> {
        let qos = Qos::sensor(1);
        Ok(Self {
            inputs: inputs.clone(),
            scans: node.publisher("scan", &qos)?,
            poses: node.publisher("pose", &qos)?,
            images: node.publisher("depth/image", &qos)?,
            camera_infos: node.publisher("depth/camera_info", &qos)?,
            clouds: node.publisher("points", &qos)?,
        })
    }

    fn publish(&self, message: &BagMessage) -> Result<(), FeedError> {
        let topic = &*message.topic;
        if topic == self.inputs.scan {
            return pass_on(message, &self.scans);
        }
        if topic == self.inputs.pose {
            return pass_on(message, &self.poses);
        }
        match &self.inputs.view {
            ViewTopics::Depth { camera_info, .. } if topic == camera_info => {
                pass_on(message, &self.camera_infos)
            }
            ViewTopics::Depth { .. } => pass_on(message, &self.images),
            ViewTopics::Points(_) => pass_on(message, &self.clouds),
        }
    }
}

fn pass_on<M: RosMessage>(message: &BagMessage, publisher: &Publisher<M>) -> Result<(), FeedError> {
    Ok(publisher.publish(message.decode::<M>()?)?)
}
