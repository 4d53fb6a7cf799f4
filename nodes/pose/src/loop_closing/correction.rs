//! Everything goes along with its keyframe; what was mapped twice becomes one.

use std::collections::BTreeMap;

use nalgebra::Isometry3;
use pose_graph::{GraphError, optimise};

use super::essential_graph::with_loop;
use super::{Located, LoopConfig};
use crate::keyframing::{FusedDuplicates, fuse_into, fuse_lines_into};
use crate::map::{KeyframeId, LineId, Map, MapError, PointId, Sightings};

/// A loop that was closed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ClosedLoop {
    /// The error between the two ends before: metres.
    pub gap_m: f64,
    /// And radians.
    pub gap_rad: f64,
    /// The keyframes that were moved.
    pub corrected: Corrected,
    /// The landmarks that were fused.
    pub fused: FusedDuplicates,
}

/// The keyframes that were moved.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Corrected {
    /// Keyframes.
    pub keyframes: usize,
    /// Points and lines.
    pub landmarks: usize,
}

/// A loop is not closed; the map is as it was.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum NotClosed {
    /// The map has not what it takes.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The graph cannot be optimised.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// All measured motions between the two ends contradict the loop.
    #[error(
        "the loop is off by {chi2} squared standard deviations after all other edges were adjusted"
    )]
    Contradicted {
        /// Of its own error, where it was not accepted.
        chi2: f64,
    },
    /// It was stopped.
    #[error("closing the loop was stopped")]
    Aborted,
}

/// Closes a loop: the keyframe sees what `to` and its neighbours see, and is where `located` has it. All keyframes are put
/// where the essential graph has them then, and all landmarks go along; what was mapped on both passes becomes one.
///
/// The root stays where it is.
///
/// # Errors
/// When the rest of the map contradicts the loop, when a keyframe is gone, or when it was stopped; the map is as it was.
pub fn close_loop(
    map: &mut Map,
    keyframe: KeyframeId,
    to: KeyframeId,
    located: &Located,
    config: &LoopConfig,
    is_aborted: &dyn Fn() -> bool,
) -> Result<ClosedLoop, NotClosed> {
    let pose_of = |id: KeyframeId| {
        let found = map.keyframes().get(id).ok_or(MapError::NoKeyframe(id))?;
        Ok::<_, MapError>(*found.camera_from_map())
    };
    let (before, other_from_map) = (pose_of(keyframe)?, pose_of(to)?);
    let camera_from_other = located.pose.camera_from_map * other_from_map.inverse();
    let gap = located.pose.camera_from_map * before.inverse();
    let new = (keyframe, to, camera_from_other);
    let essential = with_loop(map, Some(new), config);
    let optimised = optimise(&essential.graph, &config.graph, is_aborted)?;
    if optimised.was_aborted {
        return Err(NotClosed::Aborted);
    }
    if let Some(status) = optimised.edges.last().filter(|status| !status.is_used) {
        return Err(NotClosed::Contradicted { chi2: status.chi2 });
    }
    map.close_loop(keyframe, to, &camera_from_other)?;
    let poses = essential.keyframes.iter().copied().zip(optimised.poses);
    let poses: Vec<_> =
        poses.map(|(id, map_from_camera)| (id, map_from_camera.inverse())).collect();
    let corrected = correct(map, &poses)?;
    let fused = join(map, keyframe, to, located, config);
    let (gap_m, gap_rad) = (gap.translation.vector.norm(), gap.rotation.angle());
    Ok(ClosedLoop { gap_m, gap_rad, corrected, fused })
}

/// Puts keyframes elsewhere (`camera_from_map`), and each landmark with the oldest keyframe that sees it.
///
/// # Errors
/// When a pose is not finite; the map is as it was. Keyframes that are gone are skipped.
pub fn correct(
    map: &mut Map,
    poses: &[(KeyframeId, Isometry3<f64>)],
) -> Result<Corrected, MapError> {
    let mut moves = BTreeMap::new();
    for (id, pose) in poses {
        if !estimation::perturbation::is_rigid(pose) {
            return Err(MapError::NotFinite);
        }
        if let Some(keyframe) = map.keyframes().get(*id) {
            moves.insert(*id, (keyframe.number(), pose.inverse() * keyframe.camera_from_map()));
        }
    }
    let motion = |sightings: &Sightings| {
        let seen_from = sightings.iter().filter_map(|(id, _)| moves.get(&id));
        seen_from.min_by_key(|(number, _)| *number).map(|(_, motion)| *motion)
    };
    let points = map
        .points()
        .iter()
        .filter_map(|(id, point)| Some((id, motion(point.sightings())? * point.position_m())));
    let points: Vec<(PointId, _)> = points.collect();
    let lines = map.lines().iter().filter_map(|(id, line)| {
        let motion = motion(line.sightings())?;
        Some((id, line.ends_m().map(|end| motion * end)))
    });
    let lines: Vec<(LineId, _)> = lines.collect();
    let mut corrected = Corrected::default();
    for (id, pose) in poses {
        corrected.keyframes += usize::from(map.set_pose(*id, pose).is_ok());
    }
    for (id, place) in &points {
        corrected.landmarks += usize::from(map.set_point(*id, place).is_ok());
        map.refresh_point(*id)?;
    }
    for (id, ends) in &lines {
        corrected.landmarks += usize::from(map.set_line(*id, ends).is_ok());
    }
    Ok(corrected)
}

/// Makes one of what was mapped twice: first what located the keyframe, then all that the other side sees, in the keyframes
/// around this one.
fn join(
    map: &mut Map,
    keyframe: KeyframeId,
    to: KeyframeId,
    located: &Located,
    config: &LoopConfig,
) -> FusedDuplicates {
    let mut fused = FusedDuplicates::default();
    for (corner, point) in &located.points {
        let features = map.keyframes().get(keyframe).map(|keyframe| keyframe.points());
        match features.and_then(|points| points.get(*corner).copied()).flatten() {
            Some(other) => fused.fused += usize::from(map.fuse(*point, other).is_ok()),
            None => fused.seen += usize::from(map.observe(keyframe, *corner, *point).is_ok()),
        }
    }
    for (segment, line) in &located.lines {
        let features = map.keyframes().get(keyframe).map(|keyframe| keyframe.lines());
        match features.and_then(|lines| lines.get(*segment).copied()).flatten() {
            Some(other) => fused.fused += usize::from(map.fuse(*line, other).is_ok()),
            None => fused.seen += usize::from(map.observe(keyframe, *segment, *line).is_ok()),
        }
    }
    let least = config.keyframing.least_shared;
    let there = map.neighbours(to, least).into_iter().map(|(id, _)| id).chain([to]);
    let (points, lines) = map.landmarks_of(there);
    let here = map.neighbours(keyframe, least).into_iter().map(|(id, _)| id).chain([keyframe]);
    let here: Vec<KeyframeId> = here.collect();
    // After the graph was optimised the two sides lie on each other to some pixels.
    let mut wide = config.keyframing;
    wide.fusing.radius_px = config.search_radius_px;
    for id in here {
        for more in [fuse_into(map, id, &points, &wide), fuse_lines_into(map, id, &lines, &wide)] {
            fused.fused += more.fused;
            fused.seen += more.seen;
        }
    }
    fused
}
