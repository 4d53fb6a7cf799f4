//! The odometry alone, or with a map around it.

use std::sync::Arc;

use geometry::{CameraModel, Stamp};
use nalgebra::Isometry3;
use node_shell::NodeFailure;

use super::BackgroundMapping;
use super::parameters::PoseParameters;
use crate::frame::Frame;
use crate::map::Map;
use crate::mapping::Mapper;
use crate::slam::{InlineMapping, MapState, Mapping, Slam, SlamConfig, SlamFrame};
use crate::tracking::{Hints, Tracked, Tracker};

/// The tracker of the camera.
pub(super) enum Follower {
    /// Odometry alone.
    Odometry(Box<Tracker>),
    /// With a map that is worked on meanwhile.
    Background(Box<Slam<BackgroundMapping>>),
    /// With a map that is worked on between two frames.
    Inline(Box<Slam<InlineMapping>>),
}

/// The result of a frame.
pub(super) struct Followed {
    pub(super) tracked: Tracked,
    /// In the map, where there is one.
    pub(super) in_map: Option<InMap>,
}

/// A camera in the map.
#[derive(Clone, Copy)]
pub(super) struct InMap {
    pub(super) state: MapState,
    /// Where the tracker's frame is in the map; `None` before the camera was found there.
    pub(super) map_from_odom: Option<Isometry3<f64>>,
    /// Keyframes of the map.
    pub(super) keyframes: usize,
    /// The number of them that the map grows to.
    pub(super) most_keyframes: usize,
    /// By how much a loop was off that was closed at this frame, in metres.
    pub(super) closed_m: Option<f64>,
    /// A lost camera was found.
    pub(super) is_found: bool,
    /// The map is another than at the frame before.
    pub(super) has_changed: bool,
    /// When the latest waypoint was.
    pub(super) last_waypoint: Option<Stamp>,
}

impl Follower {
    /// Tracks from nothing, or in an existing map; continues with the odometry of another follower where that is
    /// given, so that its frame does not jump.
    pub(super) fn new(
        parameters: &PoseParameters,
        map: Option<Map>,
        tracker: Option<Tracker>,
    ) -> Result<Self, NodeFailure> {
        let tracker = match tracker {
            Some(tracker) => tracker,
            None => Tracker::new(parameters.tracker.clone())?,
        };
        if !parameters.slam {
            return Ok(Self::Odometry(Box::new(tracker)));
        }
        let mut config =
            SlamConfig { tracker: parameters.tracker.clone(), ..SlamConfig::default() };
        config.localiser.is_mapping = !parameters.localisation_only;
        let mapper = match map {
            Some(map) => Mapper::resume(config.mapping, map)?,
            None => Mapper::new(config.mapping)?,
        };
        Ok(if parameters.slam_in_background {
            let slam = Slam::new(&config, BackgroundMapping::new(mapper)?)?.with_tracker(tracker);
            Self::Background(Box::new(slam))
        } else {
            let slam = Slam::new(&config, InlineMapping::of(mapper))?.with_tracker(tracker);
            Self::Inline(Box::new(slam.with_trajectory()))
        })
    }

    /// The map as of the last answers; `None` where there is none.
    pub(super) fn map(&self) -> Option<Arc<Map>> {
        match self {
            Self::Odometry(_) => None,
            Self::Background(slam) => Some(slam.mapping().map()),
            Self::Inline(slam) => Some(slam.mapping().map()),
        }
    }

    pub(super) fn tracker(&self) -> &Tracker {
        match self {
            Self::Odometry(tracker) => tracker,
            Self::Background(slam) => slam.tracker(),
            Self::Inline(slam) => slam.tracker(),
        }
    }

    pub(super) fn step(
        &mut self,
        frame: &Frame,
        camera: &CameraModel,
        hints: &Hints<'_>,
    ) -> Followed {
        match self {
            Self::Odometry(tracker) => {
                Followed { tracked: tracker.step(frame, camera, hints), in_map: None }
            }
            Self::Background(slam) => {
                let done = slam.step(frame, camera, hints);
                followed(done, slam)
            }
            Self::Inline(slam) => {
                let done = slam.step(frame, camera, hints);
                followed(done, slam)
            }
        }
    }

    /// Where the camera came along, `camera_from_map`, as the map has it now; nothing where there is no map.
    pub(super) fn waypoints(&self) -> Vec<(Stamp, Isometry3<f64>)> {
        match self {
            Self::Odometry(_) => Vec::new(),
            Self::Background(slam) => slam.waypoints(),
            Self::Inline(slam) => slam.waypoints(),
        }
    }

    /// Where the camera was at all frames, `camera_from_map`, as the map has it in the end; `None` where none is kept.
    pub(super) fn trajectory(&self) -> Option<Vec<(Stamp, Isometry3<f64>)>> {
        match self {
            Self::Inline(slam) => Some(slam.trajectory()?.in_map(&slam.mapping().map())),
            Self::Odometry(_) | Self::Background(_) => None,
        }
    }
}

fn followed(done: SlamFrame, slam: &Slam<impl Mapping>) -> Followed {
    let SlamFrame { tracked, localised, steps, is_found } = done;
    let mut closed = steps.iter().filter_map(|step| step.closed.as_ref());
    let in_map = InMap {
        state: localised.state,
        map_from_odom: localised.map_from_odom,
        keyframes: slam.mapping().map().keyframes().len(),
        most_keyframes: slam.most_keyframes(),
        closed_m: closed.next_back().map(|(_, closed)| closed.gap_m),
        is_found,
        has_changed: !steps.is_empty(),
        last_waypoint: slam.last_waypoint(),
    };
    Followed { tracked, in_map: Some(in_map) }
}
