//! A frame in which the platform does not jump when the map is corrected.

use nalgebra::Isometry3;

use super::MapPath;
use crate::Stamp;

/// A correction that moves what is around the platform by no more is none to those who look for motion: it is within
/// what poses waver by from cycle to cycle (0.02 m is a quarter of the thesis' voxel).
const JUMP_M: f64 = 0.02;
/// What is around the platform: as far as a depth camera sees well.
const REACH_M: f64 = 4.0;
/// Corrections that lie ahead of the data, at most: they are told a moment before the first pose that has them.
const MOST_AHEAD: usize = 16;

/// A frame that is the map's until the map is corrected, and that then stays where it was on the platform's side: who
/// looks for motion in it reads none into the jump of the pose. REP 105 has such a frame by the name of `odom`; this one
/// needs no more than the paths, and is the map's, to the bit, as long as there are none.
#[derive(Clone, Debug, Default)]
pub struct SteadyFrame {
    path: Option<MapPath>,
    map_from_steady: Option<Isometry3<f64>>,
    /// Told, but of a later moment than the last cycle's, by rising stamp.
    ahead: Vec<(Stamp, Isometry3<f64>)>,
}

impl SteadyFrame {
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

    /// Where the steady frame is in the map, `frame_id`, for a cycle of this moment; `None` while it is the map itself.
    /// Cycles come by rising stamp. A map of another frame than the paths' is not theirs.
    pub fn map_from_steady(&mut self, stamp: Stamp, frame_id: &str) -> Option<Isometry3<f64>> {
        if self.path.as_ref().is_none_or(|path| path.frame_id() != frame_id) {
            return None;
        }
        while self.ahead.first().is_some_and(|(since, _)| *since <= stamp) {
            let (_, correction) = self.ahead.remove(0);
            self.apply(correction);
        }
        self.map_from_steady
    }

    /// The stamps began anew, or what was seen is forgotten: the frame is the map's again.
    pub fn clear(&mut self) {
        *self = Self { path: self.path.take(), ..Self::default() };
    }

    fn apply(&mut self, now_from_before: Isometry3<f64>) {
        let before = self.map_from_steady.unwrap_or_default();
        self.map_from_steady = Some(now_from_before * before);
    }
}
