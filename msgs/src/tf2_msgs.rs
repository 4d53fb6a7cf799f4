//! `tf2_msgs`: the tree of frames.

use serde::{Deserialize, Serialize};

use crate::geometry_msgs::TransformStamped;

/// Edges of the tree of frames.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct TFMessage {
    /// The edges.
    pub transforms: Vec<TransformStamped>,
}
ros_message!(TFMessage, "tf2_msgs");
