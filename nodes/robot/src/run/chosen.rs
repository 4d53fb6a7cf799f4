//! What a run reads of its bag, and by which parameters.

use std::path::Path;

use bag_player::{Bag, BagInfo};
use detection::shell::ColourInput;
use geometry::ExtrinsicsSource;

use super::colour_topics::ColourTopics;
use super::inputs::{Inputs, TopicArgs};
use super::parameters::{ParameterArgs, PipelineParameters};
use super::pose_topics::{PoseSource, PoseTopicKind};
use super::tf_frames;
use crate::failure::Failure;
use crate::import::AddedScans;
use crate::open_bag::open_bag;

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
        parameters: &ParameterArgs,
        wants_no_colour: bool,
    ) -> Result<Self, Failure> {
        let bag = open_bag(path)?;
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
    let inputs = Inputs::choose(topics, info, parameters.detection_node())?;
    let note = take_poses_of(bag, &inputs, parameters)?;
    Ok((inputs.needed_by(parameters.detection_node()), note))
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
