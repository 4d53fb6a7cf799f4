//! How a path stands in a file: as waypoints, or as a spline.

use serde::Deserialize;

use super::{Path, Spline, Waypoint};

/// One of the two.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenPath {
    waypoints: Option<Vec<Waypoint>>,
    spline: Option<Spline>,
}

/// A path that says where it goes twice, or not at all.
#[derive(Debug, thiserror::Error)]
#[error("a path has either `waypoints` or a `spline`")]
pub(super) struct PathKindError;

impl TryFrom<WrittenPath> for Path {
    type Error = PathKindError;

    fn try_from(written: WrittenPath) -> Result<Self, PathKindError> {
        match written {
            WrittenPath { waypoints: Some(waypoints), spline: None } => Ok(Self { waypoints }),
            WrittenPath { waypoints: None, spline: Some(spline) } => Ok(spline.path()),
            WrittenPath { .. } => Err(PathKindError),
        }
    }
}
