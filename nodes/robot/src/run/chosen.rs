//! What a run reads of its bag, and by which parameters.

use std::path::Path;

use bag_player::{Bag, BagError, BagInfo, BagMessage, Selection};
use detection::shell::{ColourInput, DetectionParameters};
use geometry::ExtrinsicsSource;
use msgs::sensor_msgs::{LaserScan, PointCloud2};
use node_shell::TransformTree;

use super::colour_topics::ColourTopics;
use super::inputs::{Inputs, TF, TopicArgs, ViewTopics};
use super::parameters::{ParameterArgs, PipelineParameters};
use super::pose_topics::{PoseSource, PoseTopicKind};
use super::tf_frames::{self, TfFrames};
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
    /// Where the scans and the poses come from, where the user would not expect it, and what has no effect.
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
        notes.extend(parameters.misspelt()?);
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
    let may_be_by_tf = topics.pose.is_none()
        && matches!(inputs.pose, PoseSource::Topic { .. })
        && inputs.transforms.contains(&TF)
        && parameters.detection_node().pose_source == DetectionParameters::default().pose_source
        && !parameters.say_mounts();
    let mut placed = None;
    if may_be_by_tf || inputs.pose == PoseSource::Tf {
        let tree = tf_frames::tree_of(bag, &inputs.transforms)?;
        let sensors = SensorFrames::of(bag, &inputs)?;
        let found = Placed::of(&tree, sensors, parameters.detection_node());
        if may_be_by_tf {
            // The poses of the topic are those of the robot, and not of a sensor.
            placed = found.ok().filter(Placed::has_sensors);
        } else {
            placed = Some(found?);
        }
    }
    if placed.is_some() {
        inputs.pose = PoseSource::Tf;
    }
    let note = take_poses_of(&inputs, placed.as_ref(), parameters);
    Ok((inputs.needed_by(parameters.detection_node()), note))
}

/// What tf says of the robot and its sensors.
struct Placed {
    frames: TfFrames,
    /// The frames of sensors, if the bag has a message of any.
    sensors: Vec<String>,
    /// Those that are not on the robot.
    not_on_robot: Vec<String>,
}

impl Placed {
    fn of(
        tree: &TransformTree,
        sensors: SensorFrames,
        parameters: &DetectionParameters,
    ) -> Result<Self, Failure> {
        let frames = tf_frames::in_tree(tree, parameters)?;
        let sensors: Vec<String> = sensors.camera.into_iter().chain(sensors.scanner).collect();
        let not_on_robot = tf_frames::not_on_robot(tree, &frames.robot, &sensors);
        let not_on_robot = not_on_robot.into_iter().map(str::to_owned).collect();
        Ok(Self { frames, sensors, not_on_robot })
    }

    /// Whether the mounts of the sensors are known.
    fn has_sensors(&self) -> bool {
        !self.sensors.is_empty() && self.not_on_robot.is_empty()
    }
}

/// The frames of the sensors, as their first messages say it; `None` where the bag has no message.
pub(crate) struct SensorFrames {
    pub(crate) camera: Option<String>,
    /// None of scans that are cut out of the images: they are where these are.
    pub(crate) scanner: Option<String>,
}

impl SensorFrames {
    pub(crate) fn of(bag: &Bag, inputs: &Inputs) -> Result<Self, Failure> {
        let camera = match &inputs.view {
            ViewTopics::Depth { image, .. } => {
                first(bag, image, |message| Some(depth_image(message).ok()?.frame_id))?
            }
            ViewTopics::Points(points) => first(bag, points, |message| {
                Some(message.decode::<PointCloud2>().ok()?.header.frame_id)
            })?,
        };
        let scanner = first(bag, &inputs.scan, |message| {
            Some(message.decode::<LaserScan>().ok()?.header.frame_id)
        })?;
        Ok(Self { camera, scanner })
    }
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
    inputs: &Inputs,
    placed: Option<&Placed>,
    parameters: &mut PipelineParameters,
) -> Option<String> {
    parameters.set_pose_source(inputs.pose.input());
    let Some(placed) = placed else {
        return match &inputs.pose {
            PoseSource::Topic { topic, kind } if *kind != PoseTopicKind::Pose => {
                Some(format!("the poses are those of {topic} ({})", kind.type_name()))
            }
            _ => None,
        };
    };
    let of_parameters = parameters.pipeline().rig.extrinsics;
    let extrinsics = if !parameters.say_mounts() && placed.has_sensors() {
        ExtrinsicsSource::TfFromRig
    } else {
        of_parameters
    };
    let TfFrames { robot, map } = &placed.frames;
    let mounts = match extrinsics {
        ExtrinsicsSource::Tf | ExtrinsicsSource::TfFromRig => {
            "the mounts of the sensors by tf, too".to_owned()
        }
        ExtrinsicsSource::Parameters if placed.not_on_robot.is_empty() => {
            "the mounts of the sensors those of the parameters".to_owned()
        }
        ExtrinsicsSource::Parameters => format!(
            "the mounts of the sensors those of the parameters, since tf does not connect {robot} with {}",
            placed.not_on_robot.join(", ")
        ),
    };
    parameters.set_tf_frames(&placed.frames, extrinsics);
    Some(format!("the poses are those of {robot} in {map} by tf; {mounts}"))
}

/// Chooses where the colours of the map come from: the bag's colour camera, or its clouds, unless the parameters want none.
fn choose_colours(
    (bag, info): (&Bag, &BagInfo),
    topics: &TopicArgs,
    wants_none: bool,
    inputs: &mut Inputs,
    parameters: &mut PipelineParameters,
) -> Result<(), Failure> {
    let is_for_poses = matches!(inputs.pose, PoseSource::Visual(_));
    if wants_none && !topics.visual().is_empty() && !is_for_poses {
        return Err(Failure::unusable("--image and --image-info have no effect with --no-colour")
            .fix("leave them out, or leave out --no-colour"));
    }
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

#[cfg(test)]
mod tests;
