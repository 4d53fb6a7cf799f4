//! The ground truth in a bag.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use bag_player::{Bag, BagError, BagMessage, Messages, Selection, TopicInfo};
use evaluation::{TruthFrame, TruthFrameError};
use geometry::{
    CameraModel, CameraModelError, Cloud, DepthImage, DepthLimits, LabelImage, RayTable, Stamp,
};
use msgs::RosMessage;
use msgs::convert::{self, ConvertError};
use msgs::sensor_msgs::{CameraInfo, Image, PointCloud2};
use msgs::std_msgs;
use nalgebra::{Isometry3, Point3};
use report::{DynamicScore, DynamicScoreRules, RunRecord};

use robot::Failure;
use robot::run::inputs::{Inputs, ViewTopics};
use robot::run::parameters::PipelineParameters;
use robot::run::view_topics::{DepthImageError, depth_image};
use robot::sensor_bag::{TRUE_EMPTY_SCENE, TRUE_OBJECT_NAMES};

/// The score of a run against the ground truth in its bag, if there is any.
///
/// # Errors
/// When the truth cannot be read, or does not fit the run.
pub fn score(
    bag: &Bag,
    inputs: &Inputs,
    parameters: &PipelineParameters,
    record: &RunRecord,
) -> Result<Option<DynamicScore>, Failure> {
    let wrong = |error: &dyn std::error::Error| {
        Failure::new(format!("the truth in the bag cannot be used: {error}"))
    };
    // Where the mounts are those of tf, the parameters do not have them.
    let of_parameters = parameters.pipeline().rig.mounts().rig_from_camera;
    let rig_from_camera = record.rig_from_camera.unwrap_or(of_parameters);
    let truth = TruthReader::open(bag, inputs, rig_from_camera, DepthLimits::default())
        .map_err(|error| wrong(&error))?;
    let Some(mut truth) = truth else { return Ok(None) };
    let names = object_names(bag).map_err(|error| wrong(&error))?;
    let rules = DynamicScoreRules::default();
    // The surface is in the frame of the bag's poses. The frame of a visual odometry begins at its first camera, whatever
    // its name.
    let surface_m = if inputs.has_poses_of_bag() {
        surface_in(&record.map_frame_id, bag).map_err(|error| wrong(&error))?
    } else {
        None
    };
    let at = |stamp| truth.at(stamp);
    evaluation::score_dynamic(record, &rules, &names, surface_m.as_deref(), at)
        .map(Some)
        .map_err(|error| wrong(&error))
}

/// The ground truth of a bag cannot be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum TruthError {
    #[error(transparent)]
    Bag(#[from] BagError),
    #[error(transparent)]
    Convert(#[from] ConvertError),
    #[error(transparent)]
    Depth(#[from] DepthImageError),
    #[error(transparent)]
    Camera(#[from] CameraModelError),
    #[error(transparent)]
    Frame(#[from] TruthFrameError),
}

/// Reads the ground truth stamp by stamp, in one pass over the bag.
struct TruthReader {
    messages: Messages,
    topics: TruthTopics,
    rig_from_camera: Isometry3<f64>,
    limits: DepthLimits,
    rays: Option<(CameraModel, RayTable)>,
    /// Images without their counterpart, or later than the requested stamp.
    waiting: BTreeMap<Stamp, Waiting>,
    at_end: bool,
}

struct TruthTopics {
    depth: String,
    camera_info: String,
}

#[derive(Default)]
struct Waiting {
    depth: Option<DepthImage>,
    labels: Option<LabelImage>,
}

impl TruthReader {
    /// A reader of the bag's ground truth, if it has any: labels for the pixels of a depth image.
    fn open(
        bag: &Bag,
        inputs: &Inputs,
        rig_from_camera: Isometry3<f64>,
        limits: DepthLimits,
    ) -> Result<Option<Self>, TruthError> {
        let (Some(labels), ViewTopics::Depth { image, camera_info }) =
            (&inputs.labels, &inputs.view)
        else {
            return Ok(None);
        };
        let topics = TruthTopics { depth: image.clone(), camera_info: camera_info.clone() };
        let selection = Selection {
            topics: Some(vec![image.clone(), camera_info.clone(), labels.clone()]),
            ..Selection::default()
        };
        Ok(Some(Self {
            messages: bag.messages(&selection)?,
            topics,
            rig_from_camera,
            limits,
            rays: None,
            waiting: BTreeMap::new(),
            at_end: false,
        }))
    }

    /// The truth at the stamp of a depth image; stamps must not go back from call to call.
    fn at(&mut self, stamp: Stamp) -> Result<Option<TruthFrame>, TruthError> {
        // Earlier stamps are not requested any more.
        self.waiting = self.waiting.split_off(&stamp);
        while !self.at_end && !self.is_complete(stamp) && !self.is_past(stamp) {
            match self.messages.next() {
                Some(message) => self.take(&message?, stamp)?,
                None => self.at_end = true,
            }
        }
        match (self.waiting.get(&stamp), &self.rays) {
            (Some(Waiting { depth: Some(depth), labels: Some(labels) }), Some((_, rays))) => {
                let frame = TruthFrame::from_images(
                    depth,
                    labels,
                    rays,
                    &self.limits,
                    &self.rig_from_camera,
                )?;
                Ok(Some(frame))
            }
            _ => Ok(None),
        }
    }

    fn is_complete(&self, stamp: Stamp) -> bool {
        let waiting = self.waiting.get(&stamp);
        waiting.is_some_and(|waiting| waiting.depth.is_some() && waiting.labels.is_some())
    }

    /// Whether both topics have gone beyond a stamp.
    fn is_past(&self, stamp: Stamp) -> bool {
        let later = || self.waiting.iter().filter(|(waiting, _)| **waiting > stamp);
        later().any(|(_, waiting)| waiting.depth.is_some())
            && later().any(|(_, waiting)| waiting.labels.is_some())
    }

    fn take(&mut self, message: &BagMessage, from: Stamp) -> Result<(), TruthError> {
        if *message.topic == *self.topics.camera_info {
            let camera =
                convert::camera_of_image(&message.decode::<CameraInfo>()?, &self.topics.depth)?;
            if self.rays.as_ref().is_none_or(|(known, _)| *known != camera) {
                self.rays = Some((camera, RayTable::new(&camera)?));
            }
        } else if *message.topic == *self.topics.depth {
            let depth = depth_image(message)?;
            let stamp = depth.stamp;
            if stamp >= from {
                self.waiting.entry(stamp).or_default().depth = Some(depth);
            }
        } else {
            let labels = convert::labels_from_message(&message.decode::<Image>()?)?;
            let stamp = labels.stamp;
            if stamp >= from {
                self.waiting.entry(stamp).or_default().labels = Some(labels);
            }
        }
        Ok(())
    }
}

/// The surface of the scene without moving objects, when the bag has it in this frame.
fn surface_in(frame_id: &str, bag: &Bag) -> Result<Option<Vec<Point3<f32>>>, TruthError> {
    let scene = empty_scene(bag)?.filter(|scene| scene.frame_id == frame_id);
    Ok(scene.map(|scene| scene.points_m))
}

/// The surface of the scene without moving objects, when the bag has it.
///
/// # Errors
/// When the bag cannot be read, or the cloud is invalid.
pub(crate) fn empty_scene(bag: &Bag) -> Result<Option<Cloud>, TruthError> {
    let is_scene = |topic: &TopicInfo| {
        topic.topic == TRUE_EMPTY_SCENE && topic.type_name == PointCloud2::TYPE_NAME
    };
    if !bag.topics()?.iter().any(is_scene) {
        return Ok(None);
    }
    let topics = Some(vec![TRUE_EMPTY_SCENE.to_owned()]);
    let selection = Selection { topics, ..Selection::default() };
    // The topic is latched: its last message counts.
    let Some(message) = bag.messages(&selection)?.last() else { return Ok(None) };
    Ok(Some(convert::cloud_from_message(&message?.decode::<PointCloud2>()?)?))
}

/// The names of the true objects, when the bag has them.
fn object_names(bag: &Bag) -> Result<BTreeMap<u16, String>, TruthError> {
    let has_names = bag.topics()?.iter().any(|topic| topic.topic == TRUE_OBJECT_NAMES);
    if !has_names {
        return Ok(BTreeMap::new());
    }
    let selection =
        Selection { topics: Some(vec![TRUE_OBJECT_NAMES.to_owned()]), ..Selection::default() };
    match bag.messages(&selection)?.next() {
        Some(message) => {
            let names = message?.decode::<std_msgs::String>()?.data;
            Ok(serde_json::from_str(&names).unwrap_or_default())
        }
        None => Ok(BTreeMap::new()),
    }
}
