//! The legs of the odometry through a map: which keyframes follow each other, and the measured motion between them.

use std::collections::{BTreeMap, BTreeSet};

use super::{Motion, MotionConfig};
use crate::map::{ByOdometry, KeyframeId, Map};

/// The keyframes of each leg of the odometry, in the order of travel.
fn legs(map: &Map, all: impl Iterator<Item = KeyframeId>) -> Vec<(KeyframeId, &ByOdometry)> {
    let on_a_leg = all.filter_map(|id| {
        let keyframe = map.keyframes().get(id)?;
        Some((keyframe.number(), id, keyframe.by_odometry()?))
    });
    let mut on_a_leg: Vec<_> = on_a_leg.collect();
    on_a_leg.sort_by_key(|(number, _, by)| (by.leg, *number));
    on_a_leg.into_iter().map(|(_, id, by)| (id, by)).collect()
}

/// The keyframes before and after some of them, on the path of the odometry.
pub(super) fn beside(map: &Map, of: &BTreeSet<KeyframeId>) -> BTreeSet<KeyframeId> {
    let legs = legs(map, map.keyframes().ids());
    let pairs = legs.windows(2).filter(|pair| pair[0].1.leg == pair[1].1.leg);
    let pairs = pairs.map(|pair| [pair[0].0, pair[1].0]);
    let beside = pairs.filter(|pair| pair.iter().any(|id| of.contains(id)));
    beside.flatten().filter(|id| !of.contains(id)).collect()
}

/// The motions that odometry measured between keyframes that follow each other.
pub(super) fn motions(map: &Map, keyframes: &[KeyframeId], config: &MotionConfig) -> Vec<Motion> {
    let place: BTreeMap<KeyframeId, usize> =
        keyframes.iter().enumerate().map(|(place, id)| (*id, place)).collect();
    let legs = legs(map, keyframes.iter().copied());
    let motions = legs.windows(2).filter_map(|pair| {
        let [(from, before), (to, after)] = [pair[0], pair[1]];
        Some(Motion {
            from: *place.get(&from)?,
            to: *place.get(&to)?,
            to_from_from: after.camera_from_odom * before.camera_from_odom.inverse(),
            std_dev: config.between(before, after)?,
        })
    });
    motions.collect()
}
