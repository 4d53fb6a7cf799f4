//! Where a lost camera is, by what it sees alone.

use geometry::CameraModel;
use nalgebra::Isometry3;

use super::{TrackerConfig, Trouble};
use crate::frame::Frame;
use crate::local_map::{Association, LocalMap};
use crate::matching::points::{PointMatch, match_all};
use crate::solve::{PnpError, pnp_ransac};

/// The pose that most of the frame's corners agree on, each held to be the landmark that is most alike.
///
/// # Errors
/// When no pose explains enough.
pub(super) fn relocalised(
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
