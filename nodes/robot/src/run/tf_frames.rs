//! Which frames of a bag's tf are the map and the robot.

use bag_player::{Bag, Selection};
use detection::shell::DetectionParameters;
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
}

/// The transforms of a bag with these topics of tf.
///
/// # Errors
/// When the bag cannot be read.
pub(crate) fn tree_of(bag: &Bag, topics: &[&str]) -> Result<TransformTree, Failure> {
    let failed = |error: bag_player::BagError| Failure::new(error.to_string());
    let mut tree = TransformTree::default();
    if topics.is_empty() {
        return Ok(tree);
    }
    let topics = topics.iter().map(|topic| (*topic).to_owned()).collect();
    let selection = Selection { topics: Some(topics), ..Selection::default() };
    for message in bag.messages(&selection).map_err(failed)?.take(MESSAGES_LOOKED_AT) {
        let message = message.map_err(failed)?;
        // What cannot be read is reported when the nodes read it.
        let Ok(transforms) = message.decode::<TFMessage>() else { continue };
        tree.insert_message(&transforms, &*message.topic == TF_STATIC, |_refused| {});
    }
    Ok(tree)
}

/// The frames of map and robot: those of the parameters, or those with the usual names.
///
/// # Errors
/// When no two of these frames are connected.
pub(crate) fn in_tree(
    tree: &TransformTree,
    parameters: &DetectionParameters,
) -> Result<TfFrames, Failure> {
    if tree.is_empty() {
        return Err(Failure::new("there are no transforms: neither /tf nor /tf_static has one")
            .fix("`stillmap info` lists what the bag holds"));
    }
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
    Ok(TfFrames { map: map.clone(), robot: robot.clone() })
}

/// Those of some frames that the transforms do not place on the robot.
pub(crate) fn not_on_robot<'a>(
    tree: &TransformTree,
    robot: &str,
    sensors: &'a [String],
) -> Vec<&'a str> {
    let lacks = |frame: &&String| tree.lookup_latest(robot, frame).is_err();
    sensors.iter().filter(lacks).map(String::as_str).collect()
}
