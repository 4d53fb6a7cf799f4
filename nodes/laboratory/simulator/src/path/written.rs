//! The YAML form of a path: waypoints, a spline, or a hand-held path.

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

/// A path with more than one of these forms, or none.
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
