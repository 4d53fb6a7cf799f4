//! What a run reads of its bag, and by which parameters.

use std::path::Path;

use bag_player::{Bag, BagError, BagInfo, BagMessage, Selection};
use detection::shell::{ColourInput, DetectionParameters};
use geometry::ExtrinsicsSource;
use msgs::sensor_msgs::{LaserScan, PointCloud2};

use super::colour_topics::ColourTopics;
use super::inputs::{Inputs, TF, TopicArgs, ViewTopics};
use super::parameters::{ParameterArgs, PipelineParameters};
use super::pose_topics::{PoseSource, PoseTopicKind};
use super::tf_frames;
use super::view_topics::depth_image;
use crate::failure::Failure;
use crate::import::AddedScans;
use crate::interrupt::Interrupt;
use crate::open_bag::open_bag_while;

/// A bag with what is chosen for a run over it.
pub(super) struct Chosen {
    pub(super) bag: Bag,
    /// With the scans that are added.
    pub(super) info: BagInfo,
    /// The scans of a bag without a scanner.
    pub(super) added_scans: Option<AddedScans>,
    pub(super) inputs: Inputs,
    pub(super) parameters: PipelineParameters,
    /// Where the scans and the poses come from, where the user would not expect it.
    pub(super) notes: Vec<String>,
}

impl Chosen {
    /// Opens a bag and chooses its topics: those that the user names, else by their types.
    ///
    /// # Errors
    /// When the bag cannot be read, lacks an input, or a parameter is refused.
    pub(super) fn of(
        path: &Path,
        topics: &TopicArgs,
        (parameters, wants_no_colour): (&ParameterArgs, bool),
        interrupt: &Interrupt,
    ) -> Result<Self, Failure> {
        let bag = open_bag_while(path, interrupt)?;
        let mut info = bag.info().map_err(|error| Failure::new(error.to_string()))?;
        let added_scans = AddedScans::where_needed(topics, (&bag, &info))?;
        let mut notes = Vec::new();
        if let Some(added) = &added_scans {
            info = added.listed_in(info);
            notes.push(format!(
                "the bag has no 2D laser scan: scans are cut out of the depth images of {}, as by `stillmap import bag --scan-from-depth`",
                added.image()
            ));
        }
        let mut parameters = PipelineParameters::load(parameters)?;
        let (mut inputs, note) = choose_inputs(&bag, &info, topics, &mut parameters)?;
        choose_colours((&bag, &info), topics, wants_no_colour, &mut inputs, &mut parameters)?;
        notes.extend(note);
        Ok(Self { bag, info, added_scans, inputs, parameters, notes })
    }
}

/// Chooses the topics of a bag, and sets the parameters to the poses that it has. The note says which, where they are not those
/// of a PoseStamped.
pub(crate) fn choose_inputs(
    bag: &Bag,
    info: &BagInfo,
    topics: &TopicArgs,
    parameters: &mut PipelineParameters,
) -> Result<(Inputs, Option<String>), Failure> {
    let mut inputs = Inputs::choose(topics, info, parameters.detection_node())?;
    if topics.pose.is_none() && is_placed_by_tf(bag, &inputs, parameters.detection_node())? {
        inputs.pose = PoseSource::Tf;
    }
    let note = take_poses_of(bag, &inputs, parameters)?;
    Ok((inputs.needed_by(parameters.detection_node()), note))
}

/// Whether a bag with poses on a topic has all of it in tf: the robot in the map, and the sensors on the robot, where no parameter says how they
/// are mounted. The poses of the topic are those of the robot, and not of a sensor.
fn is_placed_by_tf(
    bag: &Bag,
    inputs: &Inputs,
    parameters: &DetectionParameters,
) -> Result<bool, Failure> {
    let is_on_a_topic = matches!(inputs.pose, PoseSource::Topic { .. });
    let is_said = parameters.pose_source != DetectionParameters::default().pose_source
        || parameters.config.pipeline.rig.extrinsics != ExtrinsicsSource::Parameters;
    if !is_on_a_topic || is_said || !inputs.transforms.contains(&TF) {
        return Ok(false);
    }
    let view = match &inputs.view {
        ViewTopics::Depth { image, .. } => {
            first(bag, image, |message| Some(depth_image(message).ok()?.frame_id))?
        }
        ViewTopics::Points(points) => first(bag, points, |message| {
            Some(message.decode::<PointCloud2>().ok()?.header.frame_id)
        })?,
    };
    // Scans that are cut out of the images are where these are.
    let scan = first(bag, &inputs.scan, |message| {
        Some(message.decode::<LaserScan>().ok()?.header.frame_id)
    })?;
    let Some(view) = view else { return Ok(false) };
    let sensors: Vec<String> = scan.into_iter().chain([view]).collect();
    tf_frames::place_all(bag, &inputs.transforms, &sensors, parameters)
}

/// What the first message of a topic says; `None` where the bag has none, or it says nothing.
fn first(
    bag: &Bag,
    topic: &str,
    read: impl Fn(&BagMessage) -> Option<String>,
) -> Result<Option<String>, Failure> {
    let selection = Selection { topics: Some(vec![topic.to_owned()]), ..Selection::default() };
    let mut messages = match bag.messages(&selection) {
        Ok(messages) => messages,
        Err(BagError::NoSuchTopic { .. }) => return Ok(None),
        Err(error) => return Err(Failure::new(error.to_string())),
    };
    Ok(messages.next().and_then(Result::ok).as_ref().and_then(read))
}

/// Sets the parameters to the poses of the bag; says so where they are not those of a PoseStamped.
fn take_poses_of(
    bag: &Bag,
    inputs: &Inputs,
    parameters: &mut PipelineParameters,
) -> Result<Option<String>, Failure> {
    parameters.set_pose_source(inputs.pose.input());
    Ok(match &inputs.pose {
        PoseSource::Topic { kind: PoseTopicKind::Pose, .. } | PoseSource::Visual(_) => None,
        PoseSource::Topic { topic, kind } => {
            Some(format!("the poses are those of {topic} ({})", kind.type_name()))
        }
        PoseSource::Tf => {
            let frames = tf_frames::find(bag, &inputs.transforms, parameters.detection_node())?;
            let mounts = match frames.extrinsics {
                ExtrinsicsSource::Parameters => "the mounts of the sensors those of the parameters",
                ExtrinsicsSource::Tf | ExtrinsicsSource::TfFromRig => {
                    "the mounts of the sensors by tf, too"
                }
            };
            parameters.set_tf_frames(&frames);
            let (robot, map) = (&frames.robot, &frames.map);
            Some(format!("the poses are those of {robot} in {map} by tf; {mounts}"))
        }
    })
}

/// Chooses where the colours of the map come from: the bag's colour camera, or its clouds, unless the parameters want none.
fn choose_colours(
    (bag, info): (&Bag, &BagInfo),
    topics: &TopicArgs,
    wants_none: bool,
    inputs: &mut Inputs,
    parameters: &mut PipelineParameters,
) -> Result<(), Failure> {
    let wants_none = wants_none || parameters.detection_node().colour == ColourInput::None;
    if wants_none || !parameters.pipeline().needs_depth() {
        parameters.set_colour(ColourInput::None);
        return Ok(());
    }
    inputs.colour = ColourTopics::choose(topics.visual(), &inputs.view, bag, info)?;
    parameters.set_colour(match &inputs.colour {
        Some(ColourTopics { is_compressed: true, .. }) => ColourInput::Compressed,
        Some(_) => ColourInput::Raw,
        None => ColourInput::Cloud,
    });
    Ok(())
}
