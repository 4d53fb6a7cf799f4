//! The pipeline in one process: the cores called one after the other, as fast as they go. The same bag
//! gives the same record, but for the times.

use std::collections::VecDeque;
use std::sync::Arc;

use bag_player::{Bag, BagError, BagMessage, Loss, Selection};
use detection::{
    CycleInput, DetectionError, Detector, Dropped, Input, MatchEvent, Matched, Matcher, View,
};
use evaluation::{RunRecord, Transport};
use geometry::{CameraModel, CameraModelError, DepthProjector, DetectedCycle, Scan, Stamp};
use msgs::convert::{self, ConvertError};
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan, PointCloud2};
use node_shell::StepTimer;
use reconstruction::{MapError, StaticMap};
use segmentation::{SegmentationError, Segmenter};

use super::inputs::{Inputs, ViewTopics};
use super::parameters::PipelineParameters;
use super::recorder::{Recorder, RunName, Stage};
use crate::failure::Failure;
use crate::progress::Progress;

/// What a run over a bag yields: the record, and what of the bag could not be read.
pub(crate) struct LocalRun {
    pub(crate) record: RunRecord,
    pub(crate) losses: Vec<Loss>,
    pub(crate) blind_scans: usize,
}

/// Runs a bag through the cores.
pub(crate) fn run(
    bag: &Bag,
    inputs: &Inputs,
    parameters: &PipelineParameters,
    bag_name: &str,
    progress: &Progress,
) -> Result<LocalRun, Failure> {
    let mut pipeline = LocalPipeline::new(inputs, parameters)?;
    let topics = inputs.by_node_name().into_iter().map(|(_, topic)| topic.to_owned()).collect();
    let selection = Selection { topics: Some(topics), ..Selection::default() };
    let mut messages = bag.messages(&selection).map_err(|error| Failure::new(error.to_string()))?;
    for message in &mut messages {
        let message = message.map_err(|error| Failure::new(error.to_string()))?;
        pipeline.take(message);
        progress.advance();
    }
    pipeline.flush();
    let losses = messages.losses().to_vec();
    let blind_scans = pipeline.recorder.blind_scans();
    Ok(LocalRun { record: pipeline.finish(bag_name), losses, blind_scans })
}

/// Why a message or a cycle came to nothing. The run goes on; the record counts it.
#[derive(Debug, thiserror::Error)]
enum CycleError {
    #[error(transparent)]
    Bag(#[from] BagError),
    #[error(transparent)]
    Convert(#[from] ConvertError),
    #[error(transparent)]
    Camera(#[from] CameraModelError),
    #[error("no camera calibration came before the image")]
    NoCamera,
    #[error(transparent)]
    Detection(#[from] DetectionError),
    #[error(transparent)]
    Segmentation(#[from] SegmentationError),
    #[error(transparent)]
    Map(#[from] MapError),
}

/// What the camera published. It becomes geometry when a scan needs it: of a camera's thirty images a
/// second a scanner uses seven.
enum ViewMessage {
    Depth(Image),
    Points(PointCloud2),
}

type Event = MatchEvent<Scan, Arc<ViewMessage>>;

struct LocalPipeline<'a> {
    inputs: &'a Inputs,
    matcher: Matcher<Scan, Arc<ViewMessage>>,
    detector: Detector,
    segmenter: Segmenter,
    map: StaticMap,
    projector: Option<(CameraModel, DepthProjector)>,
    /// Images that came before the calibration of their camera, which many drivers send after them; the
    /// oldest goes when there are too many, as in the node.
    uncalibrated: VecDeque<(Stamp, Arc<ViewMessage>)>,
    most_uncalibrated: usize,
    recorder: Recorder,
}

impl<'a> LocalPipeline<'a> {
    fn new(inputs: &'a Inputs, parameters: &PipelineParameters) -> Result<Self, Failure> {
        let wrong = |error: &dyn std::error::Error| Failure::new(error.to_string());
        Ok(Self {
            inputs,
            matcher: Matcher::new(parameters.detection()),
            detector: Detector::new(parameters.detection().clone())
                .map_err(|error| wrong(&error))?,
            segmenter: Segmenter::new(*parameters.segmentation()).map_err(|error| wrong(&error))?,
            map: StaticMap::new(*parameters.reconstruction()).map_err(|error| wrong(&error))?,
            projector: None,
            uncalibrated: VecDeque::new(),
            most_uncalibrated: parameters.detection().max_waiting_clouds,
            recorder: Recorder::new(parameters.reconstruction()).map_err(|error| wrong(&error))?,
        })
    }

    fn take(&mut self, message: BagMessage) {
        let topic = message.topic.to_string();
        match self.admit(message) {
            Ok(events) => self.handle(events),
            Err(error) => self.recorder.dropped(&topic, &error.to_string(), 1),
        }
    }

    /// Hands a message to the matcher; what that decides comes back.
    fn admit(&mut self, message: BagMessage) -> Result<Vec<Event>, CycleError> {
        let topic = &*message.topic;
        if topic == self.inputs.scan {
            let scan = convert::scan_from_message(&message.decode::<LaserScan>()?)?;
            return Ok(self.matcher.push_scan(scan.stamp, scan));
        }
        if topic == self.inputs.pose {
            let pose = convert::pose_from_message(&message.decode::<PoseStamped>()?)?;
            return Ok(self.matcher.push_pose(pose));
        }
        match &self.inputs.view {
            ViewTopics::Depth { camera_info, .. } if topic == camera_info => {
                self.take_camera(&message.decode::<CameraInfo>()?)
            }
            ViewTopics::Depth { .. } => {
                let image = message.decode::<Image>()?;
                let stamp = convert::stamp_from_time(image.header.stamp);
                Ok(self.take_image(stamp, Arc::new(ViewMessage::Depth(image))))
            }
            ViewTopics::Points(_) => {
                let cloud = message.decode::<PointCloud2>()?;
                let stamp = convert::stamp_from_time(cloud.header.stamp);
                Ok(self.matcher.push_cloud(stamp, Arc::new(ViewMessage::Points(cloud))))
            }
        }
    }

    fn take_image(&mut self, stamp: Stamp, image: Arc<ViewMessage>) -> Vec<Event> {
        if self.projector.is_some() {
            return self.matcher.push_cloud(stamp, image);
        }
        if self.uncalibrated.len() >= self.most_uncalibrated {
            self.uncalibrated.pop_front();
        }
        self.uncalibrated.push_back((stamp, image));
        Vec::new()
    }

    fn take_camera(&mut self, message: &CameraInfo) -> Result<Vec<Event>, CycleError> {
        let camera = convert::camera_from_message(message)?;
        if self.projector.as_ref().is_none_or(|(known, _)| *known != camera) {
            self.projector = Some((camera, self.detector.depth_projector(&camera)?));
        }
        let waiting = std::mem::take(&mut self.uncalibrated);
        Ok(waiting.into_iter().flat_map(|(stamp, image)| self.take_image(stamp, image)).collect())
    }

    fn flush(&mut self) {
        let events = self.matcher.flush();
        self.handle(events);
    }

    fn handle(&mut self, events: Vec<Event>) {
        for event in events {
            match event {
                MatchEvent::Matched(matched) => {
                    if let Err((stage, error)) = self.cycle(&matched) {
                        self.recorder.dropped(stage.name(), &error.to_string(), 1);
                    }
                }
                MatchEvent::Dropped(dropped) => {
                    let reason = format!("missing {}", self.missing_topics(&dropped));
                    self.recorder.dropped(Stage::Detection.name(), &reason, 1);
                }
                MatchEvent::Ignored { input, .. } => {
                    let reason = "its stamp is not later than that of the message before";
                    let topic = self.topic(input).to_owned();
                    self.recorder.dropped(&topic, reason, 1);
                }
                MatchEvent::PoseRefused(error) => {
                    let topic = self.inputs.pose.clone();
                    self.recorder.dropped(&topic, &error.to_string(), 1);
                }
                // What is lost by it, if anything, the map itself refuses and reports.
                MatchEvent::PoseFrameChanged { .. } => {}
                MatchEvent::ClockJumpedBack { .. } => self.detector.forget(),
            }
        }
    }

    fn missing_topics(&self, dropped: &Dropped) -> String {
        let topics: Vec<&str> = dropped.missing.iter().map(|input| self.topic(*input)).collect();
        topics.join(" and ")
    }

    fn topic(&self, input: Input) -> &str {
        match (input, &self.inputs.view) {
            (Input::Scan, _) => &self.inputs.scan,
            (Input::Pose, _) => &self.inputs.pose,
            (Input::Cloud, ViewTopics::Depth { image, .. }) => image,
            (Input::Cloud, ViewTopics::Points(points)) => points,
        }
    }

    /// One cycle, stage by stage.
    fn cycle(
        &mut self,
        matched: &Matched<Scan, Arc<ViewMessage>>,
    ) -> Result<(), (Stage, CycleError)> {
        let cycle = self.detect(matched).map_err(|error| (Stage::Detection, error))?;
        let (index, cloud_stamp) = (cycle.index, cycle.reduced_cloud.stamp);

        let mut timer = StepTimer::start();
        let segmented = self
            .segmenter
            .step(&cycle, |step| timer.end_of(step.name()))
            .map_err(|error| (Stage::Segmentation, error.into()))?;
        self.recorder.durations(index, Stage::Segmentation, seconds(&timer));
        self.recorder.detected(cycle);
        self.recorder.counts(index, segmented.counts);
        self.recorder.dynamic_cloud(segmented.dynamic_cloud);

        let mut timer = StepTimer::start();
        self.map
            .add(&segmented.static_cloud)
            .map_err(|error| (Stage::Reconstruction, error.into()))?;
        timer.end_of("add");
        self.recorder.reconstructed(cloud_stamp, self.map.len(), seconds(&timer));
        Ok(())
    }

    fn detect(
        &mut self,
        matched: &Matched<Scan, Arc<ViewMessage>>,
    ) -> Result<DetectedCycle, CycleError> {
        let mut timer = StepTimer::start();
        let pose = &matched.pose;
        let (image, cloud);
        let view = match &*matched.cloud {
            ViewMessage::Depth(message) => {
                image = convert::depth_from_message(message)?;
                let (_, projector) = self.projector.as_ref().ok_or(CycleError::NoCamera)?;
                View::Depth { image: &image, projector }
            }
            ViewMessage::Points(message) => {
                cloud = convert::cloud_from_message(message)?;
                View::PointsInCamera(&cloud)
            }
        };
        timer.end_of("convert");
        let input = CycleInput {
            scan: &matched.scan,
            view,
            map_from_rig: &pose.map_from_rig,
            map_frame_id: &pose.frame_id,
        };
        let detected = self.detector.step(&input, |step| timer.end_of(step.name()))?;
        if detected.statistics.is_blind() {
            self.recorder.blind_scan();
        }
        let cycle = detected.cycle;
        self.recorder.durations(cycle.index, Stage::Detection, seconds(&timer));
        Ok(cycle)
    }

    fn finish(self, bag_name: &str) -> RunRecord {
        let name = RunName {
            bag_name: bag_name.to_owned(),
            transport: Transport::Local,
            map_frame_id: self.recorder.map_frame_id(),
        };
        self.recorder.finish(self.map.points(), name)
    }
}

fn seconds(timer: &StepTimer) -> impl Iterator<Item = (&'static str, f64)> {
    timer.steps().iter().map(|(step, duration)| (*step, duration.as_secs_f64()))
}
