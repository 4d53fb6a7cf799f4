//! The messages published for a pose.

use nalgebra::Isometry3;
use node_shell::{MapFromOdom, Node, NodeFailure, OdometryFrames, OdometryOutput, PublishedPose};

use super::follower::InMap;
use super::frames::Frames;
use super::parameters::PoseParameters;
use super::smoothing::Smoothing;
use crate::tracking::CameraPose;

/// The publishers of poses.
pub(super) struct Output {
    published: OdometryOutput,
    frames: Frames,
    smoothing: Smoothing,
}

impl Output {
    pub(super) fn new(node: &Node, parameters: &PoseParameters) -> Result<Self, NodeFailure> {
        let frames = OdometryFrames {
            odom_frame_id: parameters.odom_frame_id.clone(),
            base_frame_id: parameters.base_frame_id.clone(),
            map_frame_id: parameters.map_frame_id.clone(),
        };
        let (publish_tf, path_poses) = (parameters.publish_tf, parameters.path_poses);
        Ok(Self {
            published: OdometryOutput::new(node, frames, publish_tf, path_poses)?,
            frames: Frames::new(parameters),
            smoothing: Smoothing::new(parameters.smoothing_poses),
        })
    }

    pub(super) fn frames(&self) -> &Frames {
        &self.frames
    }

    /// The motion is unknown from now on: the next pose begins anew.
    pub(super) fn interrupt(&mut self) {
        self.smoothing.clear();
        self.published.interrupt();
    }

    /// The path begins anew, too, in an existing map, or in a new one.
    pub(super) fn reset(&mut self, world_from_map: Option<&Isometry3<f64>>) {
        self.smoothing.clear();
        self.published.reset();
        self.frames.begin(world_from_map);
    }

    /// Publishes a pose of the camera in the tracker's frame; where there is a map in that of the map, too, once the camera was
    /// found there.
    pub(super) fn publish(&mut self, pose: &CameraPose, in_map: Option<&InMap>) {
        let odom_from_base = self.smoothing.smoothed(self.frames.odom_from_rig(pose));
        let tie = in_map.and_then(|in_map| in_map.map_from_odom);
        let tied = tie.map(|tie| self.frames.tied(&tie));
        self.frames.map_from_odom = tied.unwrap_or(self.frames.map_from_odom);
        let map_from_odom = match (in_map, &tied) {
            (None, _) => MapFromOdom::NoMap,
            (Some(_), None) => MapFromOdom::NotFound,
            (Some(_), Some(tied)) => MapFromOdom::Found(tied),
        };
        self.published.publish(&PublishedPose {
            stamp: pose.stamp,
            odom_from_base: &odom_from_base,
            covariance: &self.frames.pose_covariance(pose),
            covariance_in_base: &self.frames.in_rig(&pose.frame_covariance),
            map_from_odom,
        });
    }
}
