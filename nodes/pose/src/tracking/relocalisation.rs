//! Where a lost camera is, by what it sees alone.

use std::f64::consts::PI;

use geometry::CameraModel;
use nalgebra::Isometry3;

use super::sighting::ENDS;
use super::{TrackerConfig, Trouble};
use crate::frame::Frame;
use crate::local_map::{Association, LocalMap};
use crate::matching::lines::{LineMatch, LineMatchConfig, match_lines};
use crate::matching::points::{PointMatch, match_all};
use crate::solve::line_ransac::line_ransac;
use crate::solve::{PnpError, pnp_ransac};

/// The pose that most of the frame's corners agree on, each held to be the landmark that is most alike; where they agree on
/// none, that of the segments.
///
/// # Errors
/// When no pose explains enough.
pub(super) fn relocalised(
    map: &LocalMap,
    frame: &Frame,
    camera: &CameraModel,
    config: &TrackerConfig,
) -> Result<Isometry3<f64>, Trouble> {
    by_points(map, frame, camera, config)
        .or_else(|trouble| by_lines(map, frame, config).ok_or(trouble))
}

fn by_points(
    map: &LocalMap,
    frame: &Frame,
    camera: &CameraModel,
    config: &TrackerConfig,
) -> Result<Isometry3<f64>, Trouble> {
    let matches = match_all(&frame.corners, &map.as_corners(), &config.follow.blind_matching);
    let pair = |pair: &PointMatch| Association { landmark: pair.found, feature: pair.sought };
    let pairs: Vec<Association> = matches.iter().map(pair).collect();
    let points = map.blind_observations(frame, camera, &pairs);
    match pnp_ransac(camera, &points, &config.sets.ransac, &config.refine) {
        Ok(found) => Ok(found.pose.camera_from_map),
        Err(PnpError::NoConsensus { inliers, .. }) => {
            Err(Trouble::TooFewInliers { inliers, matches: points.len() })
        }
        Err(PnpError::TooFewPoints { .. } | PnpError::Pose(_)) => {
            Err(Trouble::TooFewInliers { inliers: 0, matches: points.len() })
        }
    }
}

fn by_lines(map: &LocalMap, frame: &Frame, config: &TrackerConfig) -> Option<Isometry3<f64>> {
    // Whatever their direction; and one line may be several landmarks that look alike: the next best is no rival.
    let matching = LineMatchConfig { max_turn_rad: PI, max_ratio: 1.0, ..config.map.line_matching };
    let matches = match_lines(&frame.lines, &map.as_segments(), &matching);
    let pair = |pair: &LineMatch| Association { landmark: pair.to, feature: pair.from };
    let pairs: Vec<Association> = matches.iter().map(pair).collect();
    let (pose, lines) = line_ransac(&map.line_pairs(frame, &pairs), &config.sets.ransac)?;
    (ENDS * lines >= config.follow.least_relocalised).then_some(pose)
}
