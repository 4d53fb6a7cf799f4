//! Where a frame is, by what a keyframe and its neighbours see.
//!
//! First by corners that look like points of the keyframe, with no idea of the pose: random samples of three with depths
//! (or without, where most have none). Then by all points and lines of the neighbourhood that should be seen from there,
//! each near its place: twice, the second time from the better pose where it is much better.

use std::collections::BTreeSet;

use geometry::CameraModel;
use nalgebra::{Isometry3, Point3};

use super::LoopConfig;
use crate::bundle_adjustment::{line_observation, point_observation};
use crate::feature::points::Corner;
use crate::frame::Frame;
use crate::keyframing::prediction::{predicted_line, predicted_point};
use crate::map::{KeyframeId, LineId, Map, PointId};
use crate::matching::lines::{DirectionBins, ProjectedLineConfig, match_projected_lines};
use crate::matching::points::{CornerGrid, GuidedConfig, match_all, match_guided};
use crate::solve::{
    LineObservation, PnpError, PointObservation, PoseError, PoseEstimate, PoseGuess, pnp_ransac,
    refine_pose,
};

/// Rounds of looking for landmarks near their places, at most.
const ROUNDS: usize = 2;
/// A pose that moves what is seen by less has been right: a corner is off by as much by itself.
const SETTLED_PX: f64 = 1.0;

/// Where a frame is, and by what.
#[derive(Clone, PartialEq, Debug)]
pub struct Located {
    /// The pose in the frame of the map around the keyframe, and how sure it is.
    pub pose: PoseEstimate,
    /// Which corners are which points, of those that the pose explains.
    pub points: Vec<(usize, PointId)>,
    /// Which segments are which lines.
    pub lines: Vec<(usize, LineId)>,
    /// The points that should be seen from there.
    pub predicted_points: Vec<PointId>,
    /// The lines that should.
    pub predicted_lines: Vec<LineId>,
}

/// The frame does not show what the keyframe does.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum NotLocated {
    /// The keyframe is not there.
    #[error("the map has no keyframe {0:?}")]
    NoKeyframe(KeyframeId),
    /// Too few corners look alike.
    #[error("{matches} corners look alike: {needed} are needed")]
    TooFewMatches {
        /// How many do.
        matches: usize,
        /// The number needed.
        needed: usize,
    },
    /// No pose explains enough of them.
    #[error(transparent)]
    NoPose(#[from] PnpError),
    /// No pose near that explains what is seen around there.
    #[error(transparent)]
    NotRefined(#[from] PoseError),
    /// The pose explains too little of what should be seen from there.
    #[error(
        "the pose explains {inliers} of {matches} points: {needed} are needed, and {share} of all"
    )]
    TooFewInliers {
        /// The number it explains.
        inliers: usize,
        /// Points that were found near their places.
        matches: usize,
        /// The number needed.
        needed: usize,
        /// The share that it takes.
        share: f64,
    },
    /// The observations leave directions of the pose undetermined.
    #[error("{directions} directions of the pose are not observable")]
    Degenerate {
        /// How many.
        directions: usize,
    },
}

/// Finds where a frame is that may show what a keyframe does.
///
/// # Errors
/// When it does not, or not surely enough.
pub fn locate(
    map: &Map,
    keyframe: KeyframeId,
    frame: &Frame,
    camera: &CameraModel,
    config: &LoopConfig,
) -> Result<Located, NotLocated> {
    let blind = blind_observations(map, keyframe, frame, config)?;
    let found = pnp_ransac(camera, &blind, &config.ransac, &config.refine)?;
    let guess = PoseGuess { camera_from_map: found.pose.camera_from_map, covariance: None };
    locate_near(map, keyframe, (frame, &Known::default()), camera, &guess, config)
}

/// The associations of features to landmarks that are known already.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Known {
    /// Which corners are which points.
    pub points: Vec<(usize, PointId)>,
    /// Which segments are which lines.
    pub lines: Vec<(usize, LineId)>,
}

/// The same with an idea of the pose, and maybe of some of the landmarks: how a camera is followed by the map of keyframes (PL-SLAM section 2.1, "Seguimiento
/// del mapa local").
///
/// # Errors
/// When the frame does not show what should be seen from there, or not surely enough.
pub fn locate_near(
    map: &Map,
    keyframe: KeyframeId,
    (frame, known): (&Frame, &Known),
    camera: &CameraModel,
    guess: &PoseGuess,
    config: &LoopConfig,
) -> Result<Located, NotLocated> {
    let mut camera_from_map = guess.camera_from_map;
    let around = Around::new(map, keyframe, known, config);
    let mut located = None;
    for _ in 0..ROUNDS {
        let seen = around.seen(map, (frame, known), camera, &camera_from_map, config);
        let before = PoseGuess { camera_from_map, ..*guess };
        let (points, lines) = (&seen.point_observations, &seen.line_observations);
        let pose = refine_pose(camera, &before, points, lines, &config.refine)?;
        camera_from_map = pose.camera_from_map;
        let is_settled = is_settled(camera, [&before.camera_from_map, &camera_from_map], points);
        located = Some((seen, pose));
        if is_settled {
            break;
        }
    }
    let Some((seen, pose)) = located else { return Err(NotLocated::NoKeyframe(keyframe)) };
    let (inliers, matches) = (pose.point_inliers(), seen.points.len());
    let (needed, share) = (config.least_inliers, config.least_inlier_share);
    if inliers < needed || (inliers as f64) < share * matches as f64 {
        return Err(NotLocated::TooFewInliers { inliers, matches, needed, share });
    }
    let directions = pose.observability.weak().count();
    if directions > 0 {
        return Err(NotLocated::Degenerate { directions });
    }
    let points = seen.points.iter().zip(&pose.points);
    let points = points.filter(|(_, verdict)| verdict.is_inlier()).map(|(pair, _)| *pair).collect();
    let lines = seen.lines.iter().zip(&pose.lines);
    let lines = lines.filter(|(_, verdict)| verdict.is_inlier()).map(|(pair, _)| *pair).collect();
    let Seen { predicted_points, predicted_lines, .. } = seen;
    Ok(Located { pose, points, lines, predicted_points, predicted_lines })
}

/// Whether the correction of a pose is so small that the same would be found near the same places again.
fn is_settled(
    camera: &CameraModel,
    [before, now]: [&Isometry3<f64>; 2],
    points: &[PointObservation],
) -> bool {
    points.iter().all(|seen| {
        let places = [before, now].map(|pose| camera.project(&(pose * seen.point_in_map_m)));
        matches!(places, [Some(before), Some(now)] if (now - before).norm() < SETTLED_PX)
    })
}

/// The corners that look like points of the keyframe.
fn blind_observations(
    map: &Map,
    keyframe: KeyframeId,
    frame: &Frame,
    config: &LoopConfig,
) -> Result<Vec<PointObservation>, NotLocated> {
    let of = map.keyframes().get(keyframe).ok_or(NotLocated::NoKeyframe(keyframe))?;
    let known = of.points().iter().zip(&of.frame().corners);
    let known = known.filter_map(|(id, corner)| Some((map.points().get((*id)?)?, corner)));
    let (places, corners): (Vec<Point3<f64>>, Vec<Corner>) =
        known.map(|(point, corner)| (*point.position_m(), *corner)).unzip();
    let pairs = match_all(&frame.corners, &corners, &config.matching);
    let needed = config.least_matches;
    if pairs.len() < needed {
        return Err(NotLocated::TooFewMatches { matches: pairs.len(), needed });
    }
    let (scale_factor, window) = (map.config().scale_factor, &config.keyframing.window);
    let seen = pairs.iter().filter_map(|pair| {
        point_observation(frame, pair.sought, places.get(pair.found)?, scale_factor, window)
    });
    Ok(seen.collect())
}

/// The landmarks that a keyframe and its neighbours see.
struct Around {
    points: Vec<PointId>,
    lines: Vec<LineId>,
}

/// The visible part of that in a frame.
#[derive(Default)]
struct Seen {
    points: Vec<(usize, PointId)>,
    lines: Vec<(usize, LineId)>,
    predicted_points: Vec<PointId>,
    predicted_lines: Vec<LineId>,
    point_observations: Vec<PointObservation>,
    line_observations: Vec<LineObservation>,
}

impl Around {
    fn new(map: &Map, keyframe: KeyframeId, known: &Known, config: &LoopConfig) -> Self {
        let rules = &config.keyframing;
        let near = map.neighbours(keyframe, rules.least_shared).into_iter();
        let near = near.map(|(id, _)| id).take(rules.neighbours);
        let (mut points, mut lines) = map.landmarks_of(near.chain([keyframe]));
        // What is known need not be looked for.
        let known_points: BTreeSet<PointId> = known.points.iter().map(|(_, id)| *id).collect();
        let known_lines: BTreeSet<LineId> = known.lines.iter().map(|(_, id)| *id).collect();
        points.retain(|id| !known_points.contains(id));
        lines.retain(|id| !known_lines.contains(id));
        Self { points, lines }
    }

    fn seen(
        &self,
        map: &Map,
        (frame, known): (&Frame, &Known),
        camera: &CameraModel,
        camera_from_map: &Isometry3<f64>,
        config: &LoopConfig,
    ) -> Seen {
        let by = (map.config(), config.keyframing.max_viewing_angle_rad);
        let predicted = self.points.iter().filter_map(|id| {
            let point = map.points().get(*id)?;
            Some((*id, predicted_point(point, camera, camera_from_map, by)?))
        });
        let (ids, predicted): (Vec<PointId>, Vec<_>) = predicted.unzip();
        let guided =
            GuidedConfig { radius_px: config.search_radius_px, ..config.keyframing.fusing };
        let pairs = match_guided(&predicted, &CornerGrid::new(&frame.corners), &guided);
        let mut seen = Seen::default();
        let taken: BTreeSet<usize> = known.points.iter().map(|(corner, _)| *corner).collect();
        let pairs = pairs.iter().filter(|pair| !taken.contains(&pair.found));
        let pairs = pairs.filter_map(|pair| Some((pair.found, ids.get(pair.sought).copied()?)));
        for (corner, id) in known.points.iter().copied().chain(pairs) {
            let place = map.points().get(id).map(|point| *point.position_m());
            let (scale_factor, window) = (map.config().scale_factor, &config.keyframing.window);
            let observed = place
                .and_then(|place| point_observation(frame, corner, &place, scale_factor, window));
            if let Some(observed) = observed {
                seen.points.push((corner, id));
                seen.point_observations.push(observed);
            }
        }
        seen.predicted_points = ids;
        seen.predicted_points.extend(known.points.iter().map(|(_, id)| *id));
        self.add_lines(map, (frame, known), (camera, camera_from_map), config, &mut seen);
        seen
    }

    fn add_lines(
        &self,
        map: &Map,
        (frame, known): (&Frame, &Known),
        (camera, camera_from_map): (&CameraModel, &Isometry3<f64>),
        config: &LoopConfig,
        seen: &mut Seen,
    ) {
        let predicted = self.lines.iter().filter_map(|id| {
            Some((*id, predicted_line(map.lines().get(*id)?, camera, camera_from_map)?))
        });
        let (ids, predicted): (Vec<LineId>, Vec<_>) = predicted.unzip();
        let max_offset_px = f64::from(config.search_radius_px);
        let matching = ProjectedLineConfig { max_offset_px, ..config.keyframing.fusing_lines };
        let bins = DirectionBins::new(&frame.lines);
        let pairs = match_projected_lines(&predicted, &frame.lines, &bins, &matching);
        let taken: BTreeSet<usize> = known.lines.iter().map(|(segment, _)| *segment).collect();
        let pairs = pairs.iter().filter(|pair| !taken.contains(&pair.to));
        let pairs = pairs.filter_map(|pair| Some((pair.to, ids.get(pair.from).copied()?)));
        for (segment, id) in known.lines.iter().copied().chain(pairs) {
            let observed = map.lines().get(id).and_then(|line| {
                line_observation(frame, segment, &line.ends_m(), &config.keyframing.window)
            });
            if let Some(observed) = observed {
                seen.lines.push((segment, id));
                seen.line_observations.push(observed);
            }
        }
        seen.predicted_lines = ids;
        seen.predicted_lines.extend(known.lines.iter().map(|(_, id)| *id));
    }
}
