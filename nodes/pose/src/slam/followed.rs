//! Which landmark of the map the odometry's landmarks are.
//!
//! Odometry follows a corner from frame to frame, with most of them found; the map looks for its points by what they looked
//! like in keyframes, and finds half as many. A landmark of the odometry that was a feature of a keyframe is whatever
//! point of the map that feature is now.

use std::collections::{BTreeMap, BTreeSet};

use crate::local_map::LandmarkNumbers;
use crate::loop_closing::Known;
use crate::map::{Id, KeyframeId, Map};

/// The features of the odometry's landmarks in keyframes, each in the last one that shows it.
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
    /// The sequence number of the keyframe.
    kept: u64,
}

/// By then odometry sees hardly anything of an older keyframe.
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
        Known {
            points: resolved(
                &numbers.corners,
                &self.corners,
                |Feature { keyframe, feature, .. }| {
                    map.keyframes().get(keyframe)?.points().get(feature).copied().flatten()
                },
            ),
            lines: resolved(
                &numbers.lines,
                &self.lines,
                |Feature { keyframe, feature, .. }| {
                    map.keyframes().get(keyframe)?.lines().get(feature).copied().flatten()
                },
            ),
        }
    }
}

/// The features of a frame whose landmarks in the odometry are landmarks of the map.
fn resolved<L>(
    numbers: &[Option<u64>],
    kept: &BTreeMap<u64, Feature>,
    landmark: impl Fn(Feature) -> Option<Id<L>>,
) -> Vec<(usize, Id<L>)> {
    let mut taken = BTreeSet::new();
    let numbers = numbers.iter().enumerate();
    let found = numbers.filter_map(|(feature, number)| {
        let id = landmark(*kept.get(number.as_ref()?)?)?;
        // Two landmarks of the odometry may be one of the map.
        taken.insert(id).then_some((feature, id))
    });
    found.collect()
}
