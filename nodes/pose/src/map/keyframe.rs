//! A frame that the map keeps.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use geometry::{CameraModel, Stamp};
use nalgebra::Isometry3;

use super::{KeyframeId, LineId, PointId};
use crate::frame::Frame;

/// A frame that the map keeps, and what it has to do with others.
#[derive(Clone, Debug)]
pub struct Keyframe {
    /// The sequence number of the keyframe in the map, from 0 on; no other ever has its number.
    pub(super) number: u64,
    pub(super) camera: CameraModel,
    pub(super) camera_from_map: Isometry3<f64>,
    pub(super) frame: Arc<Frame>,
    /// Which point each corner is.
    pub(super) points: Vec<Option<PointId>>,
    /// Which line each segment is.
    pub(super) lines: Vec<Option<LineId>>,
    pub(super) covisible: BTreeMap<KeyframeId, Shared>,
    pub(super) parent: Option<KeyframeId>,
    pub(super) children: BTreeSet<KeyframeId>,
    pub(super) loops: BTreeMap<KeyframeId, LoopEdge>,
    pub(super) by_odometry: Option<ByOdometry>,
}

/// The landmarks that two keyframes both see.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Shared {
    /// Points.
    pub points: u32,
    /// Lines.
    pub lines: u32,
}

impl Shared {
    /// Landmarks of both kinds.
    #[must_use]
    pub fn landmarks(&self) -> u32 {
        self.points + self.lines
    }
}

/// A loop that was closed between two keyframes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LoopEdge {
    /// The other camera's pose in the frame of this one, as it was measured when the loop was closed.
    pub camera_from_other: Isometry3<f64>,
}

/// The pose of a camera by odometry: it gives the motion between two keyframes of one leg.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ByOdometry {
    /// The number of the leg: a new one begins whenever odometry has lost the camera.
    pub leg: u64,
    /// Where it had the camera, in a frame of its own.
    pub camera_from_odom: Isometry3<f64>,
    /// The distance travelled since the leg began, in metres.
    pub travelled_m: f64,
    /// All turns since the leg began, in radians.
    pub turned_rad: f64,
}

impl Keyframe {
    /// The sequence number of the keyframe in the map, from 0 on.
    #[must_use]
    pub fn number(&self) -> u64 {
        self.number
    }

    /// When its images were taken.
    #[must_use]
    pub fn stamp(&self) -> Stamp {
        self.frame.stamp
    }

    /// The rectified camera.
    #[must_use]
    pub fn camera(&self) -> &CameraModel {
        &self.camera
    }

    /// Where it was.
    #[must_use]
    pub fn camera_from_map(&self) -> &Isometry3<f64> {
        &self.camera_from_map
    }

    /// Its features.
    #[must_use]
    pub fn frame(&self) -> &Arc<Frame> {
        &self.frame
    }

    /// Which point each of the frame's corners is, if any.
    #[must_use]
    pub fn points(&self) -> &[Option<PointId>] {
        &self.points
    }

    /// Which line each of the frame's segments is, if any.
    #[must_use]
    pub fn lines(&self) -> &[Option<LineId>] {
        &self.lines
    }

    /// The keyframes that see some of the same landmarks.
    #[must_use]
    pub fn covisible(&self) -> &BTreeMap<KeyframeId, Shared> {
        &self.covisible
    }

    /// Its parent in the spanning tree; `None` for the root.
    #[must_use]
    pub fn parent(&self) -> Option<KeyframeId> {
        self.parent
    }

    /// Its children in the spanning tree.
    #[must_use]
    pub fn children(&self) -> &BTreeSet<KeyframeId> {
        &self.children
    }

    /// The camera's pose by odometry, if there was one.
    #[must_use]
    pub fn by_odometry(&self) -> Option<&ByOdometry> {
        self.by_odometry.as_ref()
    }

    /// The loops that end here.
    #[must_use]
    pub fn loops(&self) -> &BTreeMap<KeyframeId, LoopEdge> {
        &self.loops
    }
}
