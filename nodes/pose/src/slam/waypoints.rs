//! Where the camera came along, as the map has it by now: what others take with them when the map is corrected.

use std::collections::BTreeMap;

use geometry::Stamp;
use nalgebra::Isometry3;

use super::TrajectoryPose;
use crate::map::{CulledKeyframe, KeyframeId, Map};

/// The next one is this far from the last: a few voxels, so that a bend in the path of a correction is not cut ...
const STEP_M: f64 = 0.3;
/// ... or this much turned.
const STEP_RAD: f64 = 0.3;
/// This many, at most: three kilometres. When there are more, every other one goes, the old ones first of all.
const MOST: usize = 10_000;

/// Where the camera came along, each time from a keyframe: when the keyframe is put elsewhere, so is the waypoint. A camera
/// that stands, or that goes where it has been, makes waypoints but no keyframes: whatever is seen there moves with the
/// keyframe that the camera was placed by.
#[derive(Clone, Debug, Default)]
pub(super) struct Waypoints {
    /// By rising stamp.
    poses: Vec<TrajectoryPose>,
}

impl Waypoints {
    /// The camera is here now.
    pub(super) fn come_along(&mut self, pose: &TrajectoryPose, map: &Map) {
        // What is tied to no keyframe does not move with any.
        let Some(here) = pose.keyframe.and_then(|_| pose.in_map(map)) else { return };
        if self.poses.last().is_some_and(|last| pose.stamp <= last.stamp) {
            let is_another_run = self.poses.last().is_some_and(|last| pose.stamp < last.stamp);
            if !is_another_run {
                return;
            }
            self.poses.clear();
        }
        let last = self.poses.last().and_then(|last| last.in_map(map));
        let is_near = last.is_some_and(|last| {
            let step = here * last.inverse();
            step.translation.vector.norm() < STEP_M && step.rotation.angle() < STEP_RAD
        });
        if is_near {
            return;
        }
        if self.poses.len() >= MOST {
            let mut index = 0;
            self.poses.retain(|_| {
                index += 1;
                index % 2 == 1
            });
        }
        self.poses.push(*pose);
    }

    /// Keyframes are gone; waypoints tied to them are tied to their parents.
    pub(super) fn forget(&mut self, gone: &[(KeyframeId, CulledKeyframe)]) {
        if gone.is_empty() {
            return;
        }
        let gone: BTreeMap<KeyframeId, CulledKeyframe> = gone.iter().copied().collect();
        for pose in &mut self.poses {
            pose.retie(&gone);
        }
    }

    /// When the latest was.
    pub(super) fn last_stamp(&self) -> Option<Stamp> {
        self.poses.last().map(|last| last.stamp)
    }

    /// All of them in the map, `camera_from_map`, by rising stamp, as far as their keyframes are there.
    pub(super) fn in_map(&self, map: &Map) -> Vec<(Stamp, Isometry3<f64>)> {
        let poses = self.poses.iter();
        poses.filter_map(|pose| Some((pose.stamp, pose.in_map(map)?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::testing::{blank, blank_frame};
    use crate::map::{MapConfig, NewKeyframe};

    fn at(x_m: f64) -> Isometry3<f64> {
        Isometry3::translation(-x_m, 0.0, 0.0)
    }

    /// A map of a keyframe at each of these places.
    fn map_of(places_m: &[f64]) -> (Map, Vec<KeyframeId>) {
        let mut map = Map::new(MapConfig::default());
        let frame = blank_frame(1, 0);
        let keyframes = places_m.iter().map(|x_m| {
            let new = NewKeyframe { camera_from_map: at(*x_m), ..blank(&frame) };
            map.insert_keyframe(new).unwrap()
        });
        let keyframes = keyframes.collect();
        (map, keyframes)
    }

    fn pose(nanos: i64, keyframe: KeyframeId, from_keyframe_m: f64) -> TrajectoryPose {
        TrajectoryPose {
            stamp: Stamp::from_nanos(nanos),
            keyframe: Some(keyframe),
            camera_from_keyframe: at(from_keyframe_m),
        }
    }

    fn places_m(waypoints: &Waypoints, map: &Map) -> Vec<(i64, f64)> {
        let all = waypoints.in_map(map).into_iter();
        all.map(|(stamp, pose)| (stamp.as_nanos(), -pose.translation.x)).collect()
    }

    #[test]
    fn a_camera_that_goes_on_leaves_waypoints_and_one_that_stands_does_not() {
        let (map, keyframes) = map_of(&[0.0]);
        let mut waypoints = Waypoints::default();
        for (nanos, x_m) in [(0, 0.0), (1, 0.1), (2, 0.2), (3, 0.31), (4, 0.31), (5, 0.7)] {
            waypoints.come_along(&pose(nanos, keyframes[0], x_m), &map);
        }
        assert_eq!(places_m(&waypoints, &map), [(0, 0.0), (3, 0.31), (5, 0.7)]);
        assert_eq!(waypoints.last_stamp(), Some(Stamp::from_nanos(5)));
        // The clock was set back.
        waypoints.come_along(&pose(2, keyframes[0], 0.0), &map);
        assert_eq!(places_m(&waypoints, &map), [(2, 0.0)]);
    }

    #[test]
    fn waypoints_go_where_their_keyframe_goes_and_stay_when_it_is_culled() {
        let (map, keyframes) = map_of(&[0.0, 1.0]);
        let mut waypoints = Waypoints::default();
        waypoints.come_along(&pose(0, keyframes[0], 0.5), &map);
        waypoints.come_along(&pose(1, keyframes[1], 0.5), &map);
        assert_eq!(places_m(&waypoints, &map), [(0, 0.5), (1, 1.5)]);
        let (moved, _) = map_of(&[0.0, 1.25]);
        assert_eq!(places_m(&waypoints, &moved), [(0, 0.5), (1, 1.75)]);
        let culled =
            CulledKeyframe { parent: keyframes[0], camera_from_parent: at(1.0), landmarks: 0 };
        waypoints.forget(&[(keyframes[1], culled)]);
        let (left, _) = map_of(&[0.25]);
        assert_eq!(places_m(&waypoints, &left), [(0, 0.75), (1, 1.75)]);
    }

    #[test]
    fn a_camera_that_goes_on_and_on_has_a_bounded_number_of_them() {
        let (map, keyframes) = map_of(&[0.0]);
        let mut waypoints = Waypoints::default();
        for index in 0..2 * MOST {
            waypoints.come_along(&pose(index as i64, keyframes[0], index as f64), &map);
        }
        assert!(waypoints.poses.len() <= MOST);
        let places = places_m(&waypoints, &map);
        assert_eq!(places.first(), Some(&(0, 0.0)));
        assert_eq!(places.last().map(|(nanos, _)| *nanos), Some(2 * MOST as i64 - 1));
        assert!(places.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
}
