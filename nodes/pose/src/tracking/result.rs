//! The result of a frame.

use std::sync::Arc;

use geometry::Stamp;
use nalgebra::{Isometry3, Matrix6};

use crate::frame::Frame;
use crate::local_map::LandmarkNumbers;
use crate::solve::Direction;

/// The state of the tracker.
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

/// A problem of a frame, or of its inputs.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum Trouble {
    /// The frame is older than the one before; it was dropped.
    #[error("the frame is {by_s:.3} s older than the one before: dropped")]
    OutOfOrder {
        /// By how much.
        by_s: f64,
    },
    /// The clock has jumped back; how the camera moves is not known any more.
    #[error("time went back by {by_s:.3} s: the camera's velocity is unknown now")]
    TimeWentBack {
        /// By how much.
        by_s: f64,
    },
    /// Too long ago was the last frame.
    #[error("{gap_s:.3} s since the last pose: the camera's velocity is unknown now")]
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
    #[error("of {features} features {measured} have a depth, and {needed} are needed")]
    TooFewDepths {
        /// The features of the image.
        features: usize,
        /// Its features with a depth.
        measured: usize,
        /// The number needed.
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
    /// The observations do not determine all of the pose; the rest was predicted.
    #[error("{weak} of the pose's 6 directions are not observable: they are as predicted")]
    Degenerate {
        /// How many directions.
        weak: usize,
    },
}

/// The status of a feature.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum FeatureStatus {
    /// It is no landmark that was known before.
    #[default]
    New,
    /// It is a landmark, and the pose explains it.
    Inlier,
    /// It was associated with a landmark, and the pose does not explain it.
    Outlier,
    /// It is on a moving object.
    LeftOut,
}

/// The result of a frame.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Tracked {
    /// The state of the tracker after the frame.
    pub state: TrackingState,
    /// Where the camera is; only while it is followed.
    pub pose: Option<CameraPose>,
    /// The problem, if there is one.
    pub trouble: Option<Trouble>,
    /// Whether the camera was lost before and is found again.
    pub is_relocalised: bool,
    /// The directions of the pose that the observations do not determine, in the camera frame.
    pub weak: Vec<Direction>,
    /// The status of each corner; none for a frame that was dropped.
    pub corners: Vec<FeatureStatus>,
    /// The status of each segment, likewise.
    pub lines: Vec<FeatureStatus>,
    /// The static features of the frame, without moving objects and as at the moment of the middle row; only with a pose.
    pub room: Option<StaticFeatures>,
}

/// The features of a frame on the static scene.
#[derive(Clone, PartialEq, Debug)]
pub struct StaticFeatures {
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
    /// The part that is this frame's own: that of another frame is independent of it.
    pub frame_covariance: Matrix6<f64>,
}

impl Tracked {
    /// How many corners and segments have a status.
    #[must_use]
    pub fn count(&self, status: FeatureStatus) -> usize {
        self.corners.iter().chain(&self.lines).filter(|one| **one == status).count()
    }
}
