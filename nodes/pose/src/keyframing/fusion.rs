//! Landmarks that are one become one.

use std::collections::BTreeSet;

use super::KeyframingConfig;
use super::prediction::{predicted_line, predicted_point};
use crate::map::{Id, KeyframeId, Landmark, LineId, Map, PointId};
use crate::matching::lines::{DirectionBins, match_projected_lines};
use crate::matching::points::{CornerGrid, match_guided};

/// The result of fusing duplicate landmarks.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FusedDuplicates {
    /// Landmarks that were another one.
    pub fused: usize,
    /// Features that were no landmark yet, and are one now.
    pub seen: usize,
}

impl FusedDuplicates {
    fn add(&mut self, more: Self) {
        self.fused += more.fused;
        self.seen += more.seen;
    }
}

/// Looks for the landmarks of a keyframe in its neighbours and theirs, and for those of all of them in the keyframe.
pub fn fuse_duplicates(
    map: &mut Map,
    keyframe: KeyframeId,
    config: &KeyframingConfig,
) -> FusedDuplicates {
    let mut around = BTreeSet::new();
    for (near, _) in map.neighbours(keyframe, config.least_shared).iter().take(config.neighbours) {
        around.insert(*near);
        let next = map.neighbours(*near, config.least_shared);
        around.extend(next.iter().take(config.second_neighbours).map(|(next, _)| *next));
    }
    around.remove(&keyframe);
    let mut fused = FusedDuplicates::default();
    for near in &around {
        let (points, lines) = map.landmarks_of([keyframe]);
        fused.add(fuse_into(map, *near, &points, config));
        fused.add(fuse_lines_into(map, *near, &lines, config));
    }
    let (points, lines) = map.landmarks_of(around);
    fused.add(fuse_into(map, keyframe, &points, config));
    fused.add(fuse_lines_into(map, keyframe, &lines, config));
    fused
}

/// Looks for points in a keyframe that should see them. A corner that is another point makes both one: the one that more
/// keyframes see stays.
pub fn fuse_into(
    map: &mut Map,
    keyframe: KeyframeId,
    points: &[PointId],
    config: &KeyframingConfig,
) -> FusedDuplicates {
    let Some(seeing) = map.keyframes().get(keyframe) else { return FusedDuplicates::default() };
    let (mut ids, mut predicted) = (Vec::new(), Vec::new());
    let by = (map.config(), config.max_viewing_angle_rad);
    for id in points {
        let point = map.points().get(*id);
        let point = point.filter(|point| point.sightings().feature_in(keyframe).is_none());
        let there =
            point.and_then(|p| predicted_point(p, seeing.camera(), seeing.camera_from_map(), by));
        if let Some(there) = there {
            ids.push(*id);
            predicted.push(there);
        }
    }
    let frame = std::sync::Arc::clone(seeing.frame());
    let pairs = match_guided(&predicted, &CornerGrid::new(&frame.corners), &config.fusing);
    let pairs = pairs.iter().filter_map(|pair| Some((*ids.get(pair.sought)?, pair.found)));
    join(map, keyframe, pairs.collect())
}

/// The same for lines.
pub fn fuse_lines_into(
    map: &mut Map,
    keyframe: KeyframeId,
    lines: &[LineId],
    config: &KeyframingConfig,
) -> FusedDuplicates {
    let Some(seeing) = map.keyframes().get(keyframe) else { return FusedDuplicates::default() };
    let (mut ids, mut predicted) = (Vec::new(), Vec::new());
    for id in lines {
        let line = map.lines().get(*id);
        let line = line.filter(|line| line.sightings().feature_in(keyframe).is_none());
        let there =
            line.and_then(|line| predicted_line(line, seeing.camera(), seeing.camera_from_map()));
        if let Some(there) = there {
            ids.push(*id);
            predicted.push(there);
        }
    }
    let frame = std::sync::Arc::clone(seeing.frame());
    let bins = DirectionBins::new(&frame.lines);
    let pairs = match_projected_lines(&predicted, &frame.lines, &bins, &config.fusing_lines);
    let pairs = pairs.iter().filter_map(|pair| Some((*ids.get(pair.from)?, pair.to)));
    join(map, keyframe, pairs.collect())
}

/// Takes landmarks for the features that they were found as.
fn join<L: Landmark>(
    map: &mut Map,
    keyframe: KeyframeId,
    pairs: Vec<(Id<L>, usize)>,
) -> FusedDuplicates {
    let mut done = FusedDuplicates::default();
    for (landmark, feature) in pairs {
        let Some(seeing) = map.keyframes().get(keyframe) else { break };
        match L::features(seeing).get(feature).copied().flatten() {
            None => done.seen += usize::from(map.observe(keyframe, feature, landmark).is_ok()),
            Some(other) if other != landmark => {
                let count = |id| L::arena(map).get(id).map_or(0, |found| found.sightings().count());
                let (kept, dropped) = if count(landmark) > count(other) {
                    (landmark, other)
                } else {
                    (other, landmark)
                };
                done.fused += usize::from(map.fuse(kept, dropped).is_ok());
            }
            Some(_) => {}
        }
    }
    done
}
