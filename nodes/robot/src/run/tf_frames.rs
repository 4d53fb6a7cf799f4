//! Which frames of a bag's tf are the map and the robot.

use bag_player::{Bag, Selection};
use detection::shell::DetectionParameters;
use geometry::{ExtrinsicsSource, RigMounts};
use msgs::tf2_msgs::TFMessage;
use node_shell::TransformTree;

use super::inputs::TF_STATIC;
use crate::failure::Failure;

/// Messages that are looked at: at 100 a second those of 20 s, in which whatever localises the robot has begun to.
const MESSAGES_LOOKED_AT: usize = 2000;
/// The names of REP-105, by preference, behind those of the parameters.
const MAP_FRAMES: [&str; 2] = ["map", "odom"];
pub(crate) const ROBOT_FRAMES: [&str; 2] = ["base_link", "base_footprint"];

/// What the transforms of a bag say of the robot.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct TfFrames {
    /// The frame of the map.
    pub(crate) map: String,
    /// The frame of the robot: the rig.
    pub(crate) robot: String,
    /// Where the mounts of the sensors come from: tf, where the bag has fixed transforms, and the parameters do not say
    /// otherwise.
    pub(crate) extrinsics: ExtrinsicsSource,
}

/// Finds the frames in a bag with these topics of tf: those of the parameters, or those with the usual names.
///
/// # Errors
/// When the bag cannot be read, or no two of these frames are connected.
pub(super) fn find(
    bag: &Bag,
    topics: &[&str],
    parameters: &DetectionParameters,
) -> Result<TfFrames, Failure> {
    if topics.is_empty() {
        return Err(Failure::new("the bag has neither /tf nor /tf_static")
            .fix("`stillmap info` lists what the bag holds"));
    }
    let (tree, has_fixed) = tree_of(bag, topics)?;
    in_tree(&tree, has_fixed, parameters)
}

/// Whether the transforms of a bag with these topics of tf place the robot in a map, and frames of sensors on the robot.
pub(super) fn place_all(
    bag: &Bag,
    topics: &[&str],
    sensors: &[String],
    parameters: &DetectionParameters,
) -> Result<bool, Failure> {
    let (tree, has_fixed) = tree_of(bag, topics)?;
    let Ok(found) = in_tree(&tree, has_fixed, parameters) else { return Ok(false) };
    let is_on_robot = |frame: &String| tree.lookup_latest(&found.robot, frame).is_ok();
    Ok(found.extrinsics == ExtrinsicsSource::TfFromRig && sensors.iter().all(is_on_robot))
}

/// The transforms of a bag, and whether there are fixed ones.
fn tree_of(bag: &Bag, topics: &[&str]) -> Result<(TransformTree, bool), Failure> {
    let failed = |error: bag_player::BagError| Failure::new(error.to_string());
    let topics = topics.iter().map(|topic| (*topic).to_owned()).collect();
    let selection = Selection { topics: Some(topics), ..Selection::default() };
    let mut tree = TransformTree::default();
    let mut has_fixed = false;
    for message in bag.messages(&selection).map_err(failed)?.take(MESSAGES_LOOKED_AT) {
        let message = message.map_err(failed)?;
        let is_fixed = &*message.topic == TF_STATIC;
        has_fixed |= is_fixed;
        // What cannot be read is reported when the nodes read it.
        let Ok(transforms) = message.decode::<TFMessage>() else { continue };
        tree.insert_message(&transforms, is_fixed, |_refused| {});
    }
    Ok((tree, has_fixed))
}

/// The same in transforms that are known, fixed ones among them or not.
///
/// # Errors
/// When no two of these frames are connected.
pub(crate) fn in_tree(
    tree: &TransformTree,
    has_fixed: bool,
    parameters: &DetectionParameters,
) -> Result<TfFrames, Failure> {
    let rig = &parameters.config.pipeline.rig;
    let candidates = |own: &str, usual: [&str; 2]| [own, usual[0], usual[1]].map(str::to_owned);
    let maps = candidates(&parameters.map_frame_id, MAP_FRAMES);
    let robots = candidates(&rig.rig_frame_id, ROBOT_FRAMES);
    let pairs = maps.iter().flat_map(|map| robots.iter().map(move |robot| (map, robot)));
    let connected = pairs.into_iter().find(|(map, robot)| tree.lookup_latest(map, robot).is_ok());
    let Some((map, robot)) = connected else {
        return Err(Failure::new(format!(
            "/tf does not connect a map ({}) with a robot ({})",
            maps.join(", "),
            robots.join(", ")
        ))
        .fix("name the frames: map_frame_id and rig_frame_id, in a --params-file"));
    };
    let extrinsics = match rig.extrinsics {
        ExtrinsicsSource::Parameters if has_fixed && rig.mounts() == RigMounts::default() => {
            ExtrinsicsSource::TfFromRig
        }
        of_parameters => of_parameters,
    };
    Ok(TfFrames { map: map.clone(), robot: robot.clone(), extrinsics })
}
