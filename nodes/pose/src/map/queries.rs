//! Queries of visibility and covisibility.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use super::{Keyframe, KeyframeId, Landmark, LineId, Map, PointId, Shared};

impl Map {
    /// The keyframes that see at least `least` of the landmarks that this one sees, those with the most first; of equal
    /// ones the newer.
    #[must_use]
    pub fn neighbours(&self, keyframe: KeyframeId, least: u32) -> Vec<(KeyframeId, Shared)> {
        let Some(keyframe) = self.keyframes.get(keyframe) else { return Vec::new() };
        let near = keyframe.covisible.iter().filter(|(_, shared)| shared.landmarks() >= least);
        let mut near: Vec<_> = near.map(|(id, shared)| (*id, *shared)).collect();
        let number = |id| self.keyframes.get(id).map_or(0, Keyframe::number);
        near.sort_by_key(|(id, shared)| std::cmp::Reverse((shared.landmarks(), number(*id))));
        near
    }

    /// The points and lines that any of these keyframes sees, in the order of their ids.
    #[must_use]
    pub fn landmarks_of(
        &self,
        keyframes: impl IntoIterator<Item = KeyframeId>,
    ) -> (Vec<PointId>, Vec<LineId>) {
        let (mut points, mut lines) = (BTreeSet::new(), BTreeSet::new());
        for keyframe in keyframes.into_iter().filter_map(|id| self.keyframes.get(id)) {
            points.extend(keyframe.points.iter().flatten());
            lines.extend(keyframe.lines.iter().flatten());
        }
        (points.into_iter().collect(), lines.into_iter().collect())
    }

    /// How many points and how many lines a keyframe sees.
    #[must_use]
    pub fn count_seen_by(&self, keyframe: KeyframeId) -> (usize, usize) {
        self.keyframes.get(keyframe).map_or((0, 0), |keyframe| {
            (keyframe.points.iter().flatten().count(), keyframe.lines.iter().flatten().count())
        })
    }

    /// The number of views that locate a landmark: one for each keyframe that sees it, two where it sees its depth, too.
    #[must_use]
    pub fn views_of<L: Landmark>(&self, landmark: &L) -> usize {
        let views = |(keyframe, feature): (KeyframeId, usize)| {
            let keyframe = self.keyframes.get(keyframe)?;
            Some(1 + usize::from(L::is_measured(&keyframe.frame, feature)))
        };
        landmark.sightings().iter().filter_map(views).sum()
    }

    /// The keyframes that see some of these points, with how many each: those that see the most first, of equal ones the
    /// newer. The first one is the reference keyframe of a frame that shows these points.
    #[must_use]
    pub fn seen_from(&self, points: &[PointId]) -> Vec<(KeyframeId, u32)> {
        let mut counts = BTreeMap::<KeyframeId, u32>::new();
        for point in points.iter().filter_map(|point| self.points.get(*point)) {
            for (keyframe, _) in point.sightings.iter() {
                *counts.entry(keyframe).or_default() += 1;
            }
        }
        let mut counts: Vec<_> = counts.into_iter().collect();
        let number = |id| self.keyframes.get(id).map_or(0, Keyframe::number);
        counts.sort_by_key(|(id, count)| Reverse((*count, number(*id))));
        counts
    }
}
