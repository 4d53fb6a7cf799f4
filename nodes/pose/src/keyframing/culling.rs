//! Recent landmarks that do not prove themselves go, and keyframes that say nothing new.

use super::KeyframingConfig;
use crate::map::{CulledKeyframe, Id, Keyframe, KeyframeId, Landmark, Map, MapLine, MapPoint};

/// Lets the landmarks go that are on probation and were found too seldom, or that too few keyframes see. Returns how many.
pub fn cull_recent(map: &mut Map, config: &KeyframingConfig) -> usize {
    cull_recent_of::<MapPoint>(map, config) + cull_recent_of::<MapLine>(map, config)
}

fn cull_recent_of<L: Landmark>(map: &mut Map, config: &KeyframingConfig) -> usize {
    let now = map.keyframes_so_far().saturating_sub(1);
    let fails = |landmark: &L| {
        let sightings = landmark.sightings();
        let age = now.saturating_sub(sightings.born());
        let is_settled = age >= config.settled_keyframes;
        age <= config.probation_keyframes
            && (sightings.found_share() <= config.min_found_share
                || is_settled && map.views_of(landmark) < config.least_views)
    };
    let failed = L::arena(map).iter().filter(|(_, landmark)| fails(landmark));
    let failed: Vec<Id<L>> = failed.map(|(id, _)| id).collect();
    failed.iter().filter(|landmark| map.cull_landmark(**landmark).is_ok()).count()
}

/// Whether a keyframe says nothing new: most of its close points are seen by enough others, on the same level or a finer one.
///
/// One that has hardly any close points, in a hall or before a scene of edges only, is judged by all its points and lines: else
/// it would never be culled, and the map of a hall would grow for as long as a camera is in it. Twice as many others must see these:
/// far landmarks determine a camera's position by parallax alone.
#[must_use]
pub fn is_redundant(map: &Map, keyframe: KeyframeId, config: &KeyframingConfig) -> bool {
    let Some(of) = map.keyframes().get(keyframe) else { return false };
    let others = config.redundant_sightings;
    let (close, _) = count_points(map, (keyframe, of), others, config);
    let judged = if close.seen >= config.least_points {
        close
    } else {
        let (close, far) = count_points(map, (keyframe, of), 2 * others, config);
        close.and(far).and(count_lines(map, (keyframe, of), 2 * others))
    };
    judged.seen > 0 && judged.redundant as f64 >= config.redundant_share * judged.seen as f64
}

/// Landmarks of a keyframe, and those of them that enough others see.
#[derive(Clone, Copy, Default)]
struct Count {
    seen: usize,
    redundant: usize,
}

impl Count {
    fn and(self, other: Self) -> Self {
        Self { seen: self.seen + other.seen, redundant: self.redundant + other.redundant }
    }

    fn add(&mut self, is_redundant: bool) {
        self.seen += 1;
        self.redundant += usize::from(is_redundant);
    }
}

/// The points of a keyframe: close ones, and those that are not.
fn count_points(
    map: &Map,
    (keyframe, of): (KeyframeId, &Keyframe),
    enough: usize,
    config: &KeyframingConfig,
) -> (Count, Count) {
    let level = |keyframe: &Keyframe, corner: usize| {
        keyframe.frame().corners.get(corner).map(|corner| corner.level)
    };
    let (mut close, mut far) = (Count::default(), Count::default());
    for (corner, id) in of.points().iter().enumerate() {
        let Some(point) = id.and_then(|id| map.points().get(id)) else { continue };
        let depth = of.frame().corner_depths.get(corner).copied().flatten();
        let is_far = depth.is_some_and(|depth| depth.depth_m > config.close_m());
        let own = level(of, corner);
        // One level coarser is as good: the level of a corner varies by that.
        let is_as_fine = |other: KeyframeId, corner: usize| {
            let other = map.keyframes().get(other).and_then(|other| level(other, corner));
            other.zip(own).is_some_and(|(other, own)| other <= own.saturating_add(1))
        };
        let others = point.sightings().iter();
        let others = others.filter(|(other, at)| *other != keyframe && is_as_fine(*other, *at));
        let count = if is_far { &mut far } else { &mut close };
        count.add(others.count() >= enough);
    }
    (close, far)
}

fn count_lines(map: &Map, (keyframe, of): (KeyframeId, &Keyframe), enough: usize) -> Count {
    let mut lines = Count::default();
    for line in of.lines().iter().flatten().filter_map(|id| map.lines().get(*id)) {
        let others = line.sightings().iter().filter(|(other, _)| *other != keyframe);
        lines.add(others.count() >= enough);
    }
    lines
}

/// Lets those of the neighbours of a keyframe go that say nothing new, but for the root. The one that shares most is looked
/// at first. Returns each with what is left of it.
pub fn cull_keyframes(
    map: &mut Map,
    keyframe: KeyframeId,
    config: &KeyframingConfig,
) -> Vec<(KeyframeId, CulledKeyframe)> {
    let mut culled = Vec::new();
    for (neighbour, _) in map.neighbours(keyframe, config.least_shared) {
        if is_redundant(map, neighbour, config)
            && let Ok(gone) = map.cull_keyframe(neighbour)
        {
            culled.push((neighbour, gone));
        }
    }
    culled
}
