//! How a path stands in a file: as waypoints, as a spline, or as a way of a hand.

use serde::Deserialize;

use super::{Handheld, Path, Spline, Waypoint};

/// One of the three.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenPath {
    waypoints: Option<Vec<Waypoint>>,
    spline: Option<Spline>,
    handheld: Option<Handheld>,
}

/// A path that says more than once where it goes, or not at all.
#[derive(Debug, thiserror::Error)]
#[error("a path has either `waypoints` or a `spline` or a `handheld` way")]
pub(super) struct PathKindError;

impl TryFrom<WrittenPath> for Path {
    type Error = PathKindError;

    fn try_from(written: WrittenPath) -> Result<Self, PathKindError> {
        match written {
            WrittenPath { waypoints: Some(waypoints), spline: None, handheld: None } => {
                Ok(Self { waypoints })
            }
            WrittenPath { waypoints: None, spline: Some(spline), handheld: None } => {
                Ok(spline.path())
            }
            WrittenPath { waypoints: None, spline: None, handheld: Some(handheld) } => {
                Ok(handheld.path())
            }
            WrittenPath { .. } => Err(PathKindError),
        }
    }
}
