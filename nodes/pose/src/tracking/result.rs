//! What became of a frame.

use std::sync::Arc;

use geometry::Stamp;
use nalgebra::{Isometry3, Matrix6};

use crate::frame::Frame;
use crate::local_map::LandmarkNumbers;
use crate::solve::Direction;

/// What the tracker is at.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum TrackingState {
    /// No frame so far was good enough to begin with.
    #[default]
    Initialising,
    /// The pose of the last frame is known.
    Tracking,
    /// It is not; the map is kept, and the camera looked for in it.
    Lost,
}

/// What is wrong with a frame, or with what is known of it.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum Trouble {
    /// The frame is older than the one before; it was dropped.
    #[error("the frame is {by_s:.3} s older than the one before: dropped")]
    OutOfOrder {
        /// By how much.
        by_s: f64,
    },
    /// The clock has jumped back; how the camera moves is not known any more.
    #[error("time went back by {by_s:.3} s: the camera's motion is not known any more")]
    TimeWentBack {
        /// By how much.
        by_s: f64,
    },
    /// Too long ago was the last frame.
    #[error("{gap_s:.3} s since the last pose: the camera's motion is not known any more")]
    Gap {
        /// How long ago.
        gap_s: f64,
    },
    /// The image shows too little.
    #[error("{corners} corners and {lines} segments: the image is dark, blurred or bare")]
    TooFewFeatures {
        /// What there is.
        corners: usize,
        /// What there is.
        lines: usize,
    },
    /// The depth image shows too little.
    #[error("of {features} features {measured} have a depth, and it takes {needed}")]
    TooFewDepths {
        /// What the image shows.
        features: usize,
        /// What of it has a depth.
        measured: usize,
        /// What it takes.
        needed: usize,
    },
    /// The frame does not show enough of what is known.
    #[error("{inliers} of {matches} matches agree on a pose: too few")]
    TooFewInliers {
        /// Features that the best pose explains.
        inliers: usize,
        /// Features that were held to be landmarks.
        matches: usize,
    },
    /// What is seen does not tell all of the pose; the rest was predicted.
    #[error(
        "{weak} of the pose's 6 directions cannot be told by what is seen: they are as predicted"
    )]
    Degenerate {
        /// How many directions.
        weak: usize,
    },
}

/// What became of a feature.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Fate {
    /// It is no landmark that was known before.
    #[default]
    New,
    /// It is a landmark, and the pose explains it.
    Inlier,
    /// It was held to be a landmark, and the pose does not explain it.
    Outlier,
    /// It lies on a thing that moves.
    LeftOut,
}

/// What became of a frame.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Tracked {
    /// What the tracker is at now.
    pub state: TrackingState,
    /// Where the camera is; only while it is followed.
    pub pose: Option<CameraPose>,
    /// What is wrong, when something is.
    pub trouble: Option<Trouble>,
    /// Whether the camera was lost before and is found again.
    pub is_relocalised: bool,
    /// The directions of the pose that what is seen does not tell, in the camera frame.
    pub weak: Vec<Direction>,
    /// What became of each corner; none for a frame that was dropped.
    pub corners: Vec<Fate>,
    /// What became of each segment, likewise.
    pub lines: Vec<Fate>,
    /// What the frame shows of the room, without what moves and as it was at the moment of the middle row; only with a pose.
    pub room: Option<Room>,
}

/// What a frame shows of the room.
#[derive(Clone, PartialEq, Debug)]
pub struct Room {
    /// Its features.
    pub frame: Arc<Frame>,
    /// Which landmark of the odometry each of them is.
    pub numbers: LandmarkNumbers,
}

/// A pose with what it is off by.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CameraPose {
    /// When.
    pub stamp: Stamp,
    /// The pose.
    pub camera_from_map: Isometry3<f64>,
    /// Covariance of its perturbation (see [`estimation::perturbation::left`]) as a place in the map: with what the map has
    /// drifted by since it began.
    pub covariance: Matrix6<f64>,
    /// What of it is this frame's own: another frame's is independent of it.
    pub frame_covariance: Matrix6<f64>,
}

impl Tracked {
    /// How many corners and segments have a fate.
    #[must_use]
    pub fn count(&self, fate: Fate) -> usize {
        self.corners.iter().chain(&self.lines).filter(|one| **one == fate).count()
    }
}
