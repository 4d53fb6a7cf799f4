//! A frame in which the platform does not jump when the map is corrected.

use nalgebra::Isometry3;

use super::MapPath;
use crate::Stamp;

/// A correction that moves the surroundings of the platform by no more than this is ignored by motion detection: it is within
/// the noise of poses from cycle to cycle (0.02 m is a quarter of the thesis' voxel).
const JUMP_M: f64 = 0.02;
/// The extent of the surroundings of the platform: as far as a depth camera sees well.
pub(crate) const REACH_M: f64 = 4.0;
/// The most corrections that may be ahead of the data: each is published a moment before the first pose that has it.
const MOST_AHEAD: usize = 16;

/// A frame that is the map's until the map is corrected, and that then stays continuous on the platform's side:
/// motion detection in it does not mistake the jump of the pose for motion. In REP 105 such a frame is called `odom`; this one
/// needs only the paths, and equals the map frame, to the bit, while there are none.
#[derive(Clone, Debug, Default)]
pub struct ContinuousFrame {
    path: Option<MapPath>,
    map_from_continuous: Option<Isometry3<f64>>,
    /// Published, but for a later moment than the last cycle's, by rising stamp.
    ahead: Vec<(Stamp, Isometry3<f64>)>,
}

impl ContinuousFrame {
    /// The map has been corrected, or has grown.
    pub fn take(&mut self, path: MapPath) {
        let correction = self.path.as_ref().and_then(|before| path.correction_since(before));
        let last = correction.as_ref().and_then(|correction| correction.knots().last());
        let last = last.filter(|last| last.shift_m(REACH_M) > JUMP_M).copied();
        let since = path.since();
        self.path = Some(path);
        let Some(last) = last else { return };
        if self.ahead.len() >= MOST_AHEAD {
            let (_, first) = self.ahead.remove(0);
            self.apply(first);
        }
        // A clock that was set back must not put them out of order.
        let since = self.ahead.last().map_or(since, |(last, _)| since.max(*last));
        self.ahead.push((since, last.now_from_before));
    }

    /// The pose of the continuous frame in the map, `frame_id`, for a cycle of this moment; `None` while it is the map itself.
    /// Cycles come by rising stamp. The paths do not apply to a map in another frame.
    pub fn map_from_continuous(&mut self, stamp: Stamp, frame_id: &str) -> Option<Isometry3<f64>> {
        if self.path.as_ref().is_none_or(|path| path.frame_id() != frame_id) {
            return None;
        }
        while self.ahead.first().is_some_and(|(since, _)| *since <= stamp) {
            let (_, correction) = self.ahead.remove(0);
            self.apply(correction);
        }
        self.map_from_continuous
    }

    /// The stamps began anew, or earlier observations are forgotten: the frame is the map's again.
    pub fn clear(&mut self) {
        *self = Self { path: self.path.take(), ..Self::default() };
    }

    fn apply(&mut self, now_from_before: Isometry3<f64>) {
        let before = self.map_from_continuous.unwrap_or_default();
        self.map_from_continuous = Some(now_from_before * before);
    }
}
