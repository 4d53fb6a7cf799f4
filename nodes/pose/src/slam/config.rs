//! The parameters of SLAM.

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use crate::mapping::MappingConfig;
use crate::tracking::TrackerConfig;

/// Parameters of [`Slam`](super::Slam).
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SlamConfig {
    /// Of the odometry.
    pub tracker: TrackerConfig,
    /// Of the map.
    pub mapping: MappingConfig,
    /// Of the distance between the two.
    pub localiser: LocaliserConfig,
}

/// When frames are kept, and what happens where the map shows nothing.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LocaliserConfig {
    /// Between two keyframes this many frames are at least: mapping inline is idle at every frame, and would keep all.
    pub least_frames_between: u64,
    /// After this many frames that the map does not place, one is kept by odometry alone if the camera has moved since the last
    /// keyframe: it is where the map does not reach.
    pub frames_beyond_map: u64,
    /// Odometry drifts by this share of its distance, in metres and in radians: standard deviation ...
    pub drift_share: f64,
    /// ... and by this much for each radian that it turns, likewise.
    pub drift_per_rad: f64,
    /// This many frames in a row are off by the same: they show the same landmarks, whose places are wrong alike.
    pub alike_frames: f64,
    /// The map grows up to this many keyframes. When it has them, the camera is placed in what there is.
    pub max_keyframes: usize,
    /// Whether the map grows and is corrected; otherwise the camera is only placed in it.
    pub is_mapping: bool,
}

impl Default for LocaliserConfig {
    fn default() -> Self {
        Self {
            // Mapping takes a sixth of a second for a keyframe, and a camera has 30 frames a second.
            least_frames_between: 5,
            // A third of a second: what a hand before the lens takes.
            frames_beyond_map: 10,
            // The drift of the best odometry over long distances (Geiger et al. 2012): a per cent.
            drift_share: 0.01,
            drift_per_rad: 0.01,
            // A second of a view.
            alike_frames: 30.0,
            // Of some 110 kB each, a gigabyte: hours in places that are new.
            max_keyframes: 10_000,
            is_mapping: true,
        }
    }
}

/// A parameter has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum SlamConfigError {
    /// One of the odometry's.
    #[error(transparent)]
    Tracker(#[from] ParameterError),
    /// One of the map's.
    #[error("mapping: {0}")]
    Mapping(ParameterError),
    /// One of the distance between the two.
    #[error("localiser: {0}")]
    Localiser(ParameterError),
}

impl SlamConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), SlamConfigError> {
        self.tracker.validate()?;
        self.mapping.validate().map_err(SlamConfigError::Mapping)?;
        let LocaliserConfig { drift_share, drift_per_rad, alike_frames, .. } = self.localiser;
        let beyond = self.localiser.frames_beyond_map as f64;
        parameter::positive("frames_beyond_map", beyond)
            .and_then(|()| parameter::positive("drift_share", drift_share))
            .and_then(|()| parameter::positive("drift_per_rad", drift_per_rad))
            .and_then(|()| parameter::positive("alike_frames", alike_frames))
            .map_err(SlamConfigError::Localiser)
    }
}
