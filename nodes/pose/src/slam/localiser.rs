//! Where the odometry is in the map, and which frames the map is to keep.

use std::sync::Arc;

use geometry::CameraModel;
use nalgebra::Isometry3;

use super::followed::Followed;
use super::tie::Tie;
use super::travelled::{self, Travelled};
use super::{Kept, LocaliserConfig, Predicted, Request, TrajectoryPose};
use crate::frame::Frame;
use crate::keyframing::{FollowedFrame, decide};
use crate::local_map::LandmarkNumbers;
use crate::loop_closing::{Located, LoopConfig, locate_near};
use crate::map::{ByOdometry, KeyframeId, Map};
use crate::mapping::MappingStep;
use crate::solve::PoseGuess;
use crate::tracking::{CameraPose, StaticFeatures, Tracked};

/// The state of the camera in the map.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum MapState {
    /// The camera has not been found in the map yet.
    #[default]
    Unknown,
    /// The frame shows what the map has there.
    Located,
    /// The frame does not, or too little of it; the pose is what odometry says since it last did.
    ByOdometry,
    /// There is no odometry: the camera is looked for in the whole map.
    Lost,
}

/// Where the camera is in the map.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Localised {
    /// The state.
    pub state: MapState,
    /// Where the frame of the odometry is in the map; `None` before the camera was first found there.
    pub map_from_odom: Option<Isometry3<f64>>,
    /// Where the camera is, from the keyframe that it shares most with; only with a pose.
    pub pose: Option<TrajectoryPose>,
}

/// Ties the odometry to the map.
#[derive(Clone, Debug)]
pub(super) struct Localiser {
    config: LocaliserConfig,
    loops: LoopConfig,
    map_from_odom: Option<Isometry3<f64>>,
    tie: Tie,
    reference: Option<KeyframeId>,
    predicted: Predicted,
    since_keyframe: u64,
    since_found: Option<u64>,
    since_located: u64,
    /// A request to find the camera is not answered yet.
    looks_for: Option<LookedFor>,
    /// One to keep a frame is not: these are its landmarks in the odometry.
    keeps: Option<LandmarkNumbers>,
    /// Where odometry had the camera at the last frame that was kept.
    kept_at: Option<ByOdometry>,
    followed: Followed,
    travelled: Travelled,
    /// The camera's pose by odometry in this frame.
    by_odometry: Option<ByOdometry>,
}

/// A camera that is looked for.
#[derive(Clone, Copy, Debug)]
struct LookedFor {
    /// Its pose by odometry when its frame was taken.
    camera_from_odom: Option<Isometry3<f64>>,
}

impl Localiser {
    pub(super) fn new(config: LocaliserConfig, loops: LoopConfig, map: &Map) -> Self {
        Self {
            config,
            loops,
            map_from_odom: None,
            tie: Tie::default(),
            reference: None,
            predicted: Predicted::default(),
            since_keyframe: 0,
            since_found: None,
            since_located: 0,
            looks_for: None,
            keeps: None,
            kept_at: None,
            followed: Followed::default(),
            travelled: Travelled::after(map),
            by_odometry: None,
        }
    }

    /// Where the frame of the odometry is in the map.
    pub(super) fn map_from_odom(&self) -> Option<Isometry3<f64>> {
        self.map_from_odom
    }

    pub(super) fn most_keyframes(&self) -> usize {
        self.config.max_keyframes
    }

    /// Where the camera is in the map, and what is to be asked of it.
    pub(super) fn step(
        &mut self,
        frame: &Frame,
        tracked: &Tracked,
        camera: &CameraModel,
        map: &Map,
        is_idle: bool,
    ) -> (Localised, Option<Request>) {
        let camera_from_odom = tracked.pose.as_ref().map(|pose| &pose.camera_from_map);
        self.by_odometry = self.travelled.step(camera_from_odom);
        self.since_keyframe += 1;
        self.since_found = self.since_found.map(|frames| frames + 1);
        let Some((pose, room)) = tracked.pose.as_ref().zip(tracked.room.as_ref()) else {
            let is_known = !map.keyframes().is_empty();
            let state = if is_known { MapState::Lost } else { MapState::Unknown };
            let request =
                if is_known { self.look(Arc::new(frame.clone()), camera, None) } else { None };
            let map_from_odom = self.map_from_odom;
            return (Localised { state, map_from_odom, ..Localised::default() }, request);
        };
        let Some(map_from_odom) = self.map_from_odom else {
            return self.begin(pose, room, camera, map);
        };
        let guess = pose.camera_from_map * map_from_odom.inverse();
        self.tie.predict(&guess, &self.config);
        match self.located(room, camera, map, &guess) {
            Some((reference, located)) => {
                let camera_from_map = self.tie.fused(&guess, &located.pose, &self.config);
                self.map_from_odom = Some(camera_from_map.inverse() * pose.camera_from_map);
                self.since_located = 0;
                if self.config.is_mapping {
                    self.predicted.count(&located);
                }
                let localised = self.localised(MapState::Located, &camera_from_map, room, map);
                let request = self.kept(
                    room,
                    (camera, &camera_from_map),
                    map,
                    (&located, reference),
                    is_idle,
                );
                (localised, request)
            }
            None => {
                self.since_located += 1;
                let localised = self.localised(MapState::ByOdometry, &guess, room, map);
                let is_beyond = self.since_located >= self.config.frames_beyond_map;
                let request = if !is_beyond {
                    None
                } else if !self.may_grow(map) {
                    self.look(Arc::clone(&room.frame), camera, Some(pose.camera_from_map))
                } else if self.has_moved_since_kept() {
                    self.keep(room, camera, &guess, None)
                } else {
                    // The last keyframe shows the same: the map would grow for as long as the camera stands.
                    None
                };
                (localised, request)
            }
        }
    }

    /// The first frame makes the map; one that is there already must be found first.
    fn begin(
        &mut self,
        pose: &CameraPose,
        room: &StaticFeatures,
        camera: &CameraModel,
        map: &Map,
    ) -> (Localised, Option<Request>) {
        if map.keyframes().is_empty() && self.config.is_mapping {
            self.map_from_odom = Some(Isometry3::identity());
            let localised = self.localised(MapState::ByOdometry, &pose.camera_from_map, room, map);
            return (localised, self.keep(room, camera, &pose.camera_from_map, None));
        }
        (
            Localised::default(),
            self.look(Arc::clone(&room.frame), camera, Some(pose.camera_from_map)),
        )
    }

    fn located(
        &mut self,
        room: &StaticFeatures,
        camera: &CameraModel,
        map: &Map,
        guess: &Isometry3<f64>,
    ) -> Option<(KeyframeId, Located)> {
        let reference = self.reference.filter(|id| map.keyframes().contains(*id));
        let reference = reference.or_else(|| nearest(map, guess))?;
        let guess = PoseGuess { camera_from_map: *guess, covariance: None };
        let known = self.followed.known(&room.numbers, map);
        let shown = (&*room.frame, &known);
        let located = locate_near(map, reference, shown, camera, &guess, &self.loops).ok()?;
        let points: Vec<_> = located.points.iter().map(|(_, point)| *point).collect();
        // The one that shows most of the same points is followed from then on.
        let most = map.seen_from(&points).first().map(|(id, _)| *id);
        self.reference = most.or(Some(reference));
        Some((self.reference?, located))
    }

    /// Landmarks whose sightings are remembered.
    #[cfg(test)]
    pub(super) fn remembered(&self) -> usize {
        self.predicted.landmarks()
    }

    fn localised(
        &self,
        state: MapState,
        camera_from_map: &Isometry3<f64>,
        room: &StaticFeatures,
        map: &Map,
    ) -> Localised {
        let reference = self.reference.or(map.newest());
        let from = reference.and_then(|id| Some((id, map.keyframes().get(id)?.camera_from_map())));
        let camera_from_keyframe =
            from.map_or(*camera_from_map, |(_, reference)| camera_from_map * reference.inverse());
        let keyframe = from.map(|(id, _)| id);
        let pose = Some(TrajectoryPose { stamp: room.frame.stamp, keyframe, camera_from_keyframe });
        Localised { state, map_from_odom: self.map_from_odom, pose }
    }

    /// Whether the map may have another keyframe.
    fn may_grow(&self, map: &Map) -> bool {
        self.config.is_mapping && map.keyframes().len() < self.config.max_keyframes
    }

    /// Whether a frame that shows what the map has is to be kept.
    fn kept(
        &mut self,
        room: &StaticFeatures,
        (camera, camera_from_map): (&CameraModel, &Isometry3<f64>),
        map: &Map,
        (located, reference): (&Located, KeyframeId),
        is_idle: bool,
    ) -> Option<Request> {
        if !self.may_grow(map) || self.since_keyframe < self.config.least_frames_between {
            return None;
        }
        let frame = FollowedFrame {
            since_relocalisation: self.since_found,
            since_keyframe: self.since_keyframe,
            is_mapping_idle: is_idle,
            tracked_points: located.points.len(),
            reference_points: map.count_seen_by(reference).0,
        };
        decide(&frame, &self.loops.keyframing).ok()?;
        self.keep(room, camera, camera_from_map, Some(located))
    }

    /// Whether the camera has moved since the last frame that was kept, as far as odometry knows.
    fn has_moved_since_kept(&self) -> bool {
        let Some((kept_at, here)) = self.kept_at.zip(self.by_odometry) else { return true };
        travelled::is_elsewhere(&kept_at, &here)
    }

    fn keep(
        &mut self,
        room: &StaticFeatures,
        camera: &CameraModel,
        camera_from_map: &Isometry3<f64>,
        located: Option<&Located>,
    ) -> Option<Request> {
        if self.keeps.is_some() {
            return None;
        }
        self.keeps = Some(room.numbers.clone());
        self.kept_at = self.by_odometry;
        self.since_keyframe = 0;
        self.since_located = 0;
        Some(Request::Keep(Box::new(Kept {
            camera: *camera,
            camera_from_map: *camera_from_map,
            frame: Arc::clone(&room.frame),
            points: located.map(|located| located.points.clone()).unwrap_or_default(),
            lines: located.map(|located| located.lines.clone()).unwrap_or_default(),
            predicted: std::mem::take(&mut self.predicted),
            by_odometry: self.by_odometry,
        })))
    }

    fn look(
        &mut self,
        frame: Arc<Frame>,
        camera: &CameraModel,
        camera_from_odom: Option<Isometry3<f64>>,
    ) -> Option<Request> {
        if self.looks_for.is_some() {
            return None;
        }
        self.looks_for = Some(LookedFor { camera_from_odom });
        Some(Request::Find { frame, camera: *camera })
    }

    /// The map has taken a frame in, or refused it: what it moved by, the odometry moves by in it.
    pub(super) fn take_kept(&mut self, step: Option<&MappingStep>) {
        let numbers = self.keeps.take();
        let Some((step, numbers)) = step.zip(numbers) else {
            self.kept_at = None;
            return;
        };
        self.followed.keep(step.keyframe, &numbers);
        self.map_from_odom = self.map_from_odom.map(|pose| {
            let mut moved = step.map_from_before * pose;
            // The next keyframe comes with what this one was moved by, so that its error would double with each.
            moved.rotation.renormalize();
            moved
        });
        self.reference = Some(step.keyframe);
    }

    /// The camera was looked for; returns where odometry had it then, `camera_from_odom`, if it knew.
    pub(super) fn take_looked_for(&mut self) -> Option<Isometry3<f64>> {
        self.looks_for.take()?.camera_from_odom
    }

    /// The camera was found in the map: this is where the frame of the odometry is.
    pub(super) fn tie(&mut self, map_from_odom: Isometry3<f64>) {
        self.map_from_odom = Some(map_from_odom);
        self.tie = Tie::default();
        self.since_found = Some(0);
        self.since_located = 0;
        self.reference = None;
    }
}

/// The keyframe whose camera was nearest.
fn nearest(map: &Map, camera_from_map: &Isometry3<f64>) -> Option<KeyframeId> {
    let off_m =
        |pose: &Isometry3<f64>| (camera_from_map * pose.inverse()).translation.vector.norm();
    let all = map.keyframes().iter();
    let nearest = all.min_by(|(_, one), (_, other)| {
        off_m(one.camera_from_map()).total_cmp(&off_m(other.camera_from_map()))
    });
    nearest.map(|(id, _)| id)
}
