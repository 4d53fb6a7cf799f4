//! Which landmark of the map the odometry's landmarks are.
//!
//! Odometry follows a corner from frame to frame, with most of them found; the map looks for its points by what they looked
//! like in keyframes, and finds half as many. A landmark of the odometry that was a feature of a keyframe is whatever
//! point of the map that feature is now.

use std::collections::{BTreeMap, BTreeSet};

use crate::local_map::LandmarkNumbers;
use crate::loop_closing::Known;
use crate::map::{KeyframeId, Map};

/// What the odometry's landmarks were in keyframes, each in the last one that shows it.
#[derive(Clone, Debug, Default)]
pub(super) struct Followed {
    corners: BTreeMap<u64, Feature>,
    lines: BTreeMap<u64, Feature>,
    kept: u64,
}

/// A feature of a keyframe.
#[derive(Clone, Copy, Debug)]
struct Feature {
    keyframe: KeyframeId,
    feature: usize,
    /// The how manyth keyframe it was.
    kept: u64,
}

/// Odometry has lost sight by then of nearly all that it saw in an older keyframe.
const KEYFRAMES_REMEMBERED: u64 = 30;

impl Followed {
    /// A frame whose features are these landmarks of the odometry was kept.
    pub(super) fn keep(&mut self, keyframe: KeyframeId, numbers: &LandmarkNumbers) {
        self.kept += 1;
        let kept = self.kept;
        for (all, numbers) in
            [(&mut self.corners, &numbers.corners), (&mut self.lines, &numbers.lines)]
        {
            for (feature, number) in numbers.iter().enumerate() {
                if let Some(number) = number {
                    all.insert(*number, Feature { keyframe, feature, kept });
                }
            }
            all.retain(|_, feature| kept - feature.kept < KEYFRAMES_REMEMBERED);
        }
    }

    /// Which landmarks of the map a frame shows whose features are these landmarks of the odometry.
    pub(super) fn known(&self, numbers: &LandmarkNumbers, map: &Map) -> Known {
        let mut known = Known::default();
        let mut taken = BTreeSet::new();
        for (corner, number) in numbers.corners.iter().enumerate() {
            let feature = number.and_then(|number| self.corners.get(&number));
            let point = feature.and_then(|feature| {
                let keyframe = map.keyframes().get(feature.keyframe)?;
                keyframe.points().get(feature.feature).copied().flatten()
            });
            // What odometry holds for two the map may hold for one.
            if let Some(point) = point.filter(|point| taken.insert(*point)) {
                known.points.push((corner, point));
            }
        }
        let mut taken = BTreeSet::new();
        for (segment, number) in numbers.lines.iter().enumerate() {
            let feature = number.and_then(|number| self.lines.get(&number));
            let line = feature.and_then(|feature| {
                let keyframe = map.keyframes().get(feature.keyframe)?;
                keyframe.lines().get(feature.feature).copied().flatten()
            });
            if let Some(line) = line.filter(|line| taken.insert(*line)) {
                known.lines.push((segment, line));
            }
        }
        known
    }
}
