//! Where the camera was, as the map has it in the end.

use std::collections::BTreeMap;

use geometry::Stamp;
use nalgebra::Isometry3;

use crate::map::{CulledKeyframe, KeyframeId, Map};

/// Where the camera was, each time from a keyframe: when the keyframe is put elsewhere, so is the camera.
///
/// It grows with every frame: for recordings, not for a robot that drives for weeks.
#[derive(Clone, Debug, Default)]
pub struct Trajectory {
    poses: Vec<TrajectoryPose>,
    gone: BTreeMap<KeyframeId, CulledKeyframe>,
}

/// Where the camera was, from a keyframe.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TrajectoryPose {
    /// When.
    pub stamp: Stamp,
    /// From where; `None` for the map itself, before it had a keyframe.
    pub keyframe: Option<KeyframeId>,
    /// The pose.
    pub camera_from_keyframe: Isometry3<f64>,
}

impl TrajectoryPose {
    /// Where the camera was, `camera_from_map`; `None` when the keyframe is not there.
    #[must_use]
    pub fn in_map(&self, map: &Map) -> Option<Isometry3<f64>> {
        let Some(keyframe) = self.keyframe else { return Some(self.camera_from_keyframe) };
        let keyframe = map.keyframes().get(keyframe)?;
        Some(self.camera_from_keyframe * keyframe.camera_from_map())
    }

    /// Ties the pose to the parent of its keyframe, if that is gone, and so on.
    pub(super) fn retie(&mut self, gone: &BTreeMap<KeyframeId, CulledKeyframe>) {
        // Each step leads to a keyframe that went later: there are no circles.
        while let Some(culled) = self.keyframe.and_then(|keyframe| gone.get(&keyframe)) {
            self.keyframe = Some(culled.parent);
            self.camera_from_keyframe *= culled.camera_from_parent;
        }
    }
}

impl Trajectory {
    /// The next pose.
    pub fn append(&mut self, pose: TrajectoryPose) {
        self.poses.push(pose);
    }

    /// Keyframes are gone; poses tied to them are tied to their parents.
    pub fn forget(&mut self, gone: &[(KeyframeId, CulledKeyframe)]) {
        self.gone.extend(gone.iter().copied());
    }

    /// All poses in the map, `camera_from_map`, as far as their keyframes, or the parents of these, still exist.
    #[must_use]
    pub fn in_map(&self, map: &Map) -> Vec<(Stamp, Isometry3<f64>)> {
        let pose = |pose: &TrajectoryPose| {
            let mut pose = *pose;
            pose.retie(&self.gone);
            Some((pose.stamp, pose.in_map(map)?))
        };
        self.poses.iter().filter_map(pose).collect()
    }
}
