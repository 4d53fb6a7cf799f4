//! The three nodes in one process: the same nodes as over DDS, without a network, run in turn. The result depends
//! only on the published messages, so the same messages give the same record, except for the times.

use detection::shell::{CloudInput, DetectionParameters, Stage as Detection};
use geometry::{OccupancyGrid, TriangleMesh};
use msgs::geometry_msgs::{PoseStamped, PoseWithCovarianceStamped};
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use msgs::tf2_msgs::TFMessage;
use node_shell::{Counters, Host, Node, NodeFailure, Publisher, Qos, RosArguments, ShellError};
use reconstruction::shell::Stage as Reconstruction;
use reconstruction::{BoundReached, GridError, Map, MeshError};
use report::{RunRecord, Transport};
use segmentation::shell::Stage as Segmentation;

use pose::shell::PoseParameters;

use super::collector::Collector;
use super::findings::DoubtfulInput;
use super::parameters::PipelineParameters;
use super::recorder::{Recorder, RunName, Stage};
use crate::map_file::MapFile;
use crate::visual::{self, VisualOdometry, VisualTopics};

/// The namespace of the nodes, which keeps their topics apart from those of a bag.
const NAMESPACE: &str = "/stillmap_run";

/// The pipeline in one process.
pub struct Pipeline {
    host: Host,
    arguments: RosArguments,
    sensors: Sensors,
    visual: Option<VisualOdometry>,
    detection: Detection,
    segmentation: Segmentation,
    segmentation_node: Node,
    reconstruction: Reconstruction,
    collector: Collector,
    recorder: Recorder,
    counters: Counters,
}

impl Pipeline {
    /// A pipeline that takes points from `input`. `topics` renames topics of the sensors: pairs of the nodes' name and the one
    /// that appears in reports.
    pub fn new(
        input: CloudInput,
        topics: &[(&str, &str)],
        parameters: &PipelineParameters,
    ) -> Result<Self, NodeFailure> {
        let host = Host::in_process();
        let arguments = arguments(topics)?;
        let node = |name: &str| host.node(name, &arguments);
        let detection = node(Stage::Detection.name())?;
        let segmentation_node = node(Stage::Segmentation.name())?;
        let detection_parameters =
            DetectionParameters { input, ..parameters.detection_node().clone() };
        Ok(Self {
            counters: detection.counters(),
            detection: Detection::new(&detection, &detection_parameters)?,
            segmentation: Segmentation::new(&segmentation_node, parameters.segmentation_node())?,
            segmentation_node,
            reconstruction: Reconstruction::new(
                &node(Stage::Reconstruction.name())?,
                parameters.reconstruction_node(),
            )?,
            collector: Collector::on(node("collector")?, &detection_parameters)?,
            recorder: Recorder::new(parameters.reconstruction())?,
            sensors: Sensors::on(&node("sensors")?)?,
            visual: None,
            host,
            arguments,
        })
    }

    /// The same with the pose node, which takes its images from the sensors as well.
    pub(crate) fn with_visual_odometry(
        mut self,
        topics: &VisualTopics,
        parameters: &PoseParameters,
    ) -> Result<Self, NodeFailure> {
        let node = |name: &str| self.host.node(name, &self.arguments);
        let (pose, beside) = (node(visual::NODE)?, node("feed")?);
        self.visual = Some(VisualOdometry::new(&pose, &beside, topics.clone(), parameters)?);
        Ok(self)
    }

    /// The pose node, where there is one.
    pub(crate) fn visual(&self) -> Option<&VisualOdometry> {
        self.visual.as_ref()
    }

    /// One more node beside the three, for a caller that subscribes to their topics.
    pub fn listener(&self) -> Result<Node, NodeFailure> {
        Ok(self.host.node("listener", &self.arguments)?)
    }

    /// The publishers of the pipeline's input. Nothing is processed until [`Self::flow`].
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// Notes that a message of the bag cannot be passed on.
    pub(crate) fn unusable_message(&mut self, topic: &str, reason: String) {
        self.recorder.unusable_message(topic, reason);
    }

    /// Lets each stage in turn process all messages that wait for it.
    pub fn flow(&mut self) {
        if let Some(visual) = &mut self.visual {
            visual.flow();
        }
        self.detection.take_waiting();
        if let Err(error) = self.segmentation.follow_subscribers(&self.segmentation_node) {
            self.recorder.dropped(Stage::Segmentation.name(), &error.to_string(), 1);
        }
        self.segmentation.take_waiting();
        self.reconstruction.take_waiting();
        self.collector.receive_waiting(&mut self.recorder);
    }

    /// There is no more input: messages that wait for a matching one are dropped.
    pub fn end_of_input(&mut self) {
        self.detection.give_up_waiting();
        self.flow();
        self.segmentation.give_up_waiting();
    }

    /// The map so far.
    pub fn map(&self) -> &Map {
        self.reconstruction.map()
    }

    /// The occupancy grid of the map so far.
    pub(crate) fn occupancy_grid(&mut self) -> Result<OccupancyGrid, GridError> {
        self.reconstruction.occupancy_grid()
    }

    /// The map so far as triangles.
    pub(crate) fn mesh(&self) -> Result<TriangleMesh, MeshError> {
        self.reconstruction.mesh()
    }

    /// How often the input of a cycle is doubtful.
    pub(crate) fn doubtful(&self) -> DoubtfulInput {
        self.recorder.doubtful()
    }

    /// The bounds that have kept something out of the map.
    pub(crate) fn bounds_reached(&self) -> Vec<BoundReached> {
        self.recorder.bounds_reached()
    }

    /// The record of the run, with the name of the recording.
    pub fn finish(mut self, bag_name: &str) -> RunRecord {
        for (cause, count) in self.counters.drops() {
            self.recorder.unusable(&cause, count);
        }
        for (reason, count) in self.visual.iter().flat_map(VisualOdometry::losses) {
            self.recorder.dropped(visual::NODE, &reason, count);
        }
        let name = RunName {
            bag_name: bag_name.to_owned(),
            transport: Transport::Local,
            map_frame_id: self.recorder.map_frame_id(),
        };
        let map = MapFile::of(self.map().whole());
        self.recorder.finish(map, name)
    }
}

/// The arguments of nodes in the run's namespace.
fn arguments(topics: &[(&str, &str)]) -> Result<RosArguments, ShellError> {
    let mut arguments = vec!["--ros-args".to_owned()];
    arguments.extend(["-r".to_owned(), format!("__ns:={NAMESPACE}")]);
    for (name, topic) in topics {
        arguments.extend(["-r".to_owned(), format!("{name}:={topic}")]);
    }
    Ok(RosArguments::parse(arguments)?)
}

/// Publishers that replace the drivers of the sensors.
pub struct Sensors {
    /// `scan`.
    pub scans: Publisher<LaserScan>,
    /// `pose`.
    pub poses: Publisher<PoseStamped>,
    /// `depth/image`.
    pub images: Publisher<Image>,
    /// `depth/image/compressedDepth`.
    pub compressed_images: Publisher<CompressedImage>,
    /// `depth/camera_info`.
    pub camera_infos: Publisher<CameraInfo>,
    pub(crate) odometry: Publisher<Odometry>,
    pub(crate) poses_with_covariance: Publisher<PoseWithCovarianceStamped>,
    pub(crate) clouds: Publisher<PointCloud2>,
    pub(crate) colours: Publisher<Image>,
    pub(crate) compressed_colours: Publisher<CompressedImage>,
    pub(crate) colour_infos: Publisher<CameraInfo>,
    pub(crate) fixed_transforms: Publisher<TFMessage>,
    pub(crate) transforms: Publisher<TFMessage>,
}

impl Sensors {
    fn on(node: &Node) -> Result<Self, NodeFailure> {
        let qos = Qos::sensor(1);
        Ok(Self {
            scans: node.publisher("scan", &qos)?,
            poses: node.publisher("pose", &qos)?,
            odometry: node.publisher("odom", &qos)?,
            poses_with_covariance: node.publisher("pose_with_covariance", &qos)?,
            images: node.publisher("depth/image", &qos)?,
            compressed_images: node.publisher("depth/image/compressedDepth", &qos)?,
            camera_infos: node.publisher("depth/camera_info", &qos)?,
            clouds: node.publisher("points", &qos)?,
            colours: node.publisher("rgb/image", &qos)?,
            compressed_colours: node.publisher("rgb/image/compressed", &qos)?,
            colour_infos: node.publisher("rgb/camera_info", &qos)?,
            fixed_transforms: node.publisher("/tf_static", &Qos::latched())?,
            transforms: node.publisher("/tf", &qos)?,
        })
    }
}
