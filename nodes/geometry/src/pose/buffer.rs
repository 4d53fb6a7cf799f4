//! The pose at a moment between two known ones.

use std::collections::VecDeque;

use nalgebra::Isometry3;

use super::{StampedPose, UnusablePose, check_pose};
use crate::Stamp;
use crate::map_path::REACH_M;

/// Rotations nearer to each other than this are taken for one: a fifth of a thousandth of an arc second.
const SAME_ROTATION_RAD: f64 = 1e-9;

/// Two poses between which the surroundings of the platform shift by no more than this are those of a platform that stands: a voxel
/// of the thesis, and the noise of a localisation.
const AT_REST_M: f64 = 0.08;

/// The latest poses, for the pose at a moment between two of them.
///
/// Poses stay in the order of their stamps, whatever order they come in. All are in one frame: a
/// source that restarts in another, or a clock that jumps back, calls for [`clear`](Self::clear).
#[derive(Clone, Debug)]
pub struct PoseBuffer {
    poses: VecDeque<StampedPose>,
    capacity: usize,
    max_gap_s: f64,
    max_rest_s: f64,
}

/// A pose was not taken into the buffer, which is as it was.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum PosePushError {
    /// The buffer is full of newer poses.
    #[error(
        "a pose came too late: it is {late_s:.3} s older than all of the buffer's {capacity} poses; a \
         larger buffer would take it"
    )]
    TooOld {
        /// How much older than the oldest pose it is.
        late_s: f64,
        /// How many poses the buffer holds.
        capacity: usize,
    },
    /// There is a pose of the same stamp already; the first one stays.
    #[error("a second pose of stamp {} ns came: its source must stamp each pose once", .stamp.as_nanos())]
    Duplicate {
        /// The stamp of both.
        stamp: Stamp,
    },
    /// The pose leads to another frame than the poses before it.
    #[error(
        "a pose in the frame '{found}' came among poses in '{expected}': they must be in one frame"
    )]
    OtherFrame {
        /// The frame of the poses before.
        expected: String,
        /// The frame of this pose.
        found: String,
    },
    /// The pose cannot carry a cloud.
    #[error("at stamp {} ns {source}", .stamp.as_nanos())]
    Unusable {
        /// The stamp of the pose.
        stamp: Stamp,
        /// Why.
        source: UnusablePose,
    },
}

/// There is no pose for the moment that was requested.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum PoseLookupError {
    /// No pose has come.
    #[error("no pose has come yet")]
    Empty,
    /// The moment lies before the oldest pose: it never will have one.
    #[error("the oldest pose is {by_s:.3} s later")]
    BeforeOldest {
        /// How much earlier than the oldest pose it is.
        by_s: f64,
    },
    /// The moment lies after the newest pose: its pose may still come.
    #[error("the newest pose is {by_s:.3} s earlier")]
    AfterNewest {
        /// How much later than the newest pose it is.
        by_s: f64,
    },
    /// The two poses around the moment lie too far apart.
    #[error(
        "the poses before and after are {gap_s:.3} s apart; at most {max_gap_s:.3} s are bridged"
    )]
    Gap {
        /// How far apart they are.
        gap_s: f64,
        /// How far apart they may be.
        max_gap_s: f64,
    },
}

impl PoseBuffer {
    /// The widest gap that is bridged unless another is requested: five cycles of the thesis' 7 Hz
    /// scanner, in which its platform moves 2.5 cm (Rec-HV, experiment 11).
    pub const DEFAULT_MAX_GAP_S: f64 = 0.7;

    /// An empty buffer of the latest `capacity` poses, at least 2, that bridges gaps of
    /// [`DEFAULT_MAX_GAP_S`](Self::DEFAULT_MAX_GAP_S).
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        let max_gap_s = Self::DEFAULT_MAX_GAP_S;
        let max_rest_s = 0.0;
        Self { poses: VecDeque::new(), capacity: capacity.max(2), max_gap_s, max_rest_s }
    }

    /// The same buffer, which bridges gaps between poses of up to `max_gap_s`.
    #[must_use]
    pub fn with_max_gap_s(self, max_gap_s: f64) -> Self {
        Self { max_gap_s, ..self }
    }

    /// The same buffer, which bridges longer gaps, too, of up to `max_rest_s`, where the poses before and after agree: the platform
    /// stands.
    #[must_use]
    pub fn with_max_rest_s(self, max_rest_s: f64) -> Self {
        Self { max_rest_s, ..self }
    }

    /// Takes a pose; a full buffer lets its oldest one go. One that comes late finds its place.
    ///
    /// # Errors
    /// Leaves out a pose that is older than a whole full buffer, that has the stamp of another, that
    /// is in another frame, or that cannot carry a cloud. After any of them the buffer is as good as before.
    pub fn push(&mut self, pose: StampedPose) -> Result<(), PosePushError> {
        let stamp = pose.stamp;
        check_pose(&pose.map_from_rig)
            .map_err(|source| PosePushError::Unusable { stamp, source })?;
        let place = self.poses.partition_point(|other| other.stamp < stamp);
        if let Some(other) = self.poses.front().filter(|other| other.frame_id != pose.frame_id) {
            let expected = other.frame_id.clone();
            return Err(PosePushError::OtherFrame { expected, found: pose.frame_id });
        }
        if self.poses.get(place).is_some_and(|other| other.stamp == stamp) {
            return Err(PosePushError::Duplicate { stamp });
        }
        if self.poses.len() < self.capacity {
            self.poses.insert(place, pose);
            return Ok(());
        }
        match self.poses.front() {
            Some(oldest) if place == 0 => {
                let late_s = oldest.stamp.seconds_since(stamp);
                Err(PosePushError::TooOld { late_s, capacity: self.capacity })
            }
            _ => {
                self.poses.insert(place, pose);
                self.poses.pop_front();
                Ok(())
            }
        }
    }

    /// The pose at `stamp`: the one of that stamp, or else between its two neighbours, the position
    /// on the straight line and the rotation on the shortest arc, both in proportion to time. Never
    /// beyond the oldest or the newest pose.
    ///
    /// # Errors
    /// When there is no pose before or none after, or when these lie further apart than the buffer
    /// bridges.
    pub fn at(&self, stamp: Stamp) -> Result<StampedPose, PoseLookupError> {
        let (Some(oldest), Some(newest)) = (self.poses.front(), self.poses.back()) else {
            return Err(PoseLookupError::Empty);
        };
        let place = self.poses.partition_point(|pose| pose.stamp < stamp);
        let Some(later) = self.poses.get(place) else {
            return Err(PoseLookupError::AfterNewest { by_s: stamp.seconds_since(newest.stamp) });
        };
        if later.stamp == stamp {
            return Ok(later.clone());
        }
        let Some(earlier) = place.checked_sub(1).and_then(|place| self.poses.get(place)) else {
            return Err(PoseLookupError::BeforeOldest { by_s: oldest.stamp.seconds_since(stamp) });
        };
        let gap_s = later.stamp.seconds_since(earlier.stamp);
        // A limit that is not a number bridges nothing.
        let is_bridged = gap_s <= self.max_gap_s
            || (gap_s <= self.max_rest_s && is_rest(&earlier.map_from_rig, &later.map_from_rig));
        if !is_bridged {
            return Err(PoseLookupError::Gap { gap_s, max_gap_s: self.max_gap_s });
        }
        let share = stamp.seconds_since(earlier.stamp) / gap_s;
        let map_from_rig = between(&earlier.map_from_rig, &later.map_from_rig, share);
        Ok(StampedPose { stamp, frame_id: earlier.frame_id.clone(), map_from_rig })
    }

    /// The newest pose.
    #[must_use]
    pub fn newest(&self) -> Option<&StampedPose> {
        self.poses.back()
    }

    /// The oldest pose.
    #[must_use]
    pub fn oldest(&self) -> Option<&StampedPose> {
        self.poses.front()
    }

    /// How many poses there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// Forgets all poses, and their frame.
    pub fn clear(&mut self) {
        self.poses.clear();
    }
}

/// Whether the platform stands, by the poses at the begin and the end.
fn is_rest(earlier: &Isometry3<f64>, later: &Isometry3<f64>) -> bool {
    let step_m = (later.translation.vector - earlier.translation.vector).norm();
    step_m + REACH_M * earlier.rotation.angle_to(&later.rotation) <= AT_REST_M
}

/// The pose at `share` of the interval, from 0 at `earlier` to 1 at `later`.
fn between(earlier: &Isometry3<f64>, later: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    let translation = earlier.translation.vector.lerp(&later.translation.vector, share).into();
    let mut rotation = earlier
        .rotation
        .try_slerp(&later.rotation, share, SAME_ROTATION_RAD)
        .unwrap_or(earlier.rotation);
    rotation.renormalize();
    Isometry3::from_parts(translation, rotation)
}
