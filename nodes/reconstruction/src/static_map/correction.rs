//! The map follows the corrections of the poses that it was built by.
//!
//! A SLAM that closes a loop puts its keyframes elsewhere, and the poses that it tells from then on fit those. What was
//! put into the map by the poses of before stands where nothing is any more: without a correction the walls are double.
//! So each voxel has an anchor, the moment of the way at which it was seen first, and the map is a set of pieces, each of
//! which moves with its part of the way. Grids apart, one for each part, would hold the same place again each time that it
//! is seen, and grow for ever in the same flat.
//!
//! A correction says for each moment of the way what has moved there ([`geometry::PathCorrection`]). The voxels of the
//! moments that have moved by more than [`STAYS_IN_EDGES`] go there as points, the mean with its weight, and are binned
//! anew; those that come to the same place are one from then on. What has moved by less stays until it has moved by
//! more. Means move as a whole, and each move rounds them to 32 bits: their number of points is never changed.

mod late;
mod moving;
#[cfg(test)]
mod tests;

use geometry::{LateCorrections, MapPath, PathCorrection, Stamp};
use nalgebra::Isometry3;

use super::StaticMap;
use super::anchor::TICK_S;
use crate::tiles::TileError;

/// What moves by no more than this share of the voxel's edge stays: 2 cm of 8 cm, about what a voxel's mean tells of its
/// surface. Each move costs the map some of its voxels, where two come to one place.
const STAYS_IN_EDGES: f64 = 0.25;

/// By a turn of the platform what is far moves farther than what is near. So far is what counts: the reach of a depth
/// camera.
const REACH_M: f64 = 5.0;

/// A path that is so much later than the latest cycle has a stamp of another clock: it is taken for one of that cycle.
const MOST_AHEAD_S: f64 = 10.0;

/// What a path did to the map.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct MapCorrection {
    /// Voxels that went elsewhere.
    pub moved_voxels: usize,
    /// Voxels that are one with another now.
    pub merged_voxels: usize,
    /// How far something moved, at most, that was within 5 m of the platform; 0 where nothing did.
    pub shift_m: f64,
}

/// The corrections since the map was empty.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct CorrectionCounts {
    /// How many moved voxels.
    pub corrections: u64,
    /// The largest [`MapCorrection::shift_m`] of them.
    pub largest_shift_m: f64,
    /// Cycles that came after a correction and were told in the map of before: they were brought over.
    pub late_cycles: u64,
}

/// A map that cannot follow a path.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum CorrectionError {
    /// The path is in another frame than the map.
    #[error("the path is in frame {path:?}, the map in frame {map:?}")]
    AnotherFrame {
        /// The frame of the map.
        map: String,
        /// The frame of the path.
        path: String,
    },
    /// The tiles of the map cannot be read or written now. The map is as it was; the next path makes up for it.
    #[error("the map cannot be corrected now, and waits for the next path: {0}")]
    PutOff(#[from] TileError),
}

/// What is known of the trajectory, and what came of it: of any kind of map.
#[derive(Clone, Debug, Default)]
pub(crate) struct Corrections {
    /// The path by which the map stands as it does.
    stands_on: Option<MapPath>,
    /// A correction since then could not be made, from this moment on: what came later stands where it belongs.
    put_off: Option<Stamp>,
    late: LateCorrections,
    counts: CorrectionCounts,
}

/// A map that a path may move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MapNow<'a> {
    /// Its frame, once it has one.
    pub(crate) frame_id: Option<&'a str>,
    /// The stamp of its latest cycle.
    pub(crate) stamp: Stamp,
    /// The edge of its voxels.
    pub(crate) edge_m: f64,
}

/// What a path asks of a map.
#[derive(Clone, Debug)]
pub(crate) struct Asked {
    /// What has moved.
    pub(crate) made: PathCorrection,
    /// What was seen at this moment or later stays.
    pub(crate) until: Stamp,
    stands_on: MapPath,
}

impl Corrections {
    /// The map is empty. The poses go on in the map as it is.
    pub(crate) fn clear(&mut self) {
        *self = Self { stands_on: self.stands_on.take(), ..Self::default() };
    }

    /// What a path asks of the map; `None` where nothing moves.
    ///
    /// # Errors
    /// When the path is in another frame than the map.
    pub(crate) fn asked_by(
        &mut self,
        path: &MapPath,
        map: MapNow<'_>,
    ) -> Result<Option<Asked>, CorrectionError> {
        if let Some(frame_id) = map.frame_id
            && frame_id != path.frame_id()
        {
            let path = path.frame_id().to_owned();
            return Err(CorrectionError::AnotherFrame { map: frame_id.to_owned(), path });
        }
        let stands_on = self.stands_on.as_ref();
        let since_then =
            stands_on.and_then(|before| Some((before, path.correction_since(before)?)));
        let Some((before, correction)) = since_then else {
            self.stands_on = Some(path.clone());
            return Ok(None);
        };
        let made = correction.beyond(STAYS_IN_EDGES * map.edge_m, REACH_M);
        let stands_on = before.after(&made, path);
        if made.is_none() {
            self.stands_on = Some(stands_on);
            return Ok(None);
        }
        let most = map.stamp.plus_seconds(MOST_AHEAD_S);
        let since = if path.since() > most { map.stamp.plus_seconds(TICK_S) } else { path.since() };
        let until = self.put_off.unwrap_or(since);
        Ok(Some(Asked { made, until, stands_on }))
    }

    /// It could not be done, and waits for the next path.
    pub(crate) fn put_off(&mut self, asked: &Asked) {
        self.put_off = Some(asked.until);
    }

    /// It was done. Returns by how far something moved at most, in metres.
    pub(crate) fn done(&mut self, asked: Asked) -> f64 {
        let Asked { made, until, stands_on } = asked;
        self.put_off = None;
        self.stands_on = Some(stands_on);
        self.late.corrected(until, &made);
        let shift_m = made.largest_shift_m(REACH_M);
        self.counts.corrections += 1;
        self.counts.largest_shift_m = self.counts.largest_shift_m.max(shift_m);
        shift_m
    }

    /// What takes a cycle of this moment into the map as it is; `None` where its pose is in it already.
    pub(crate) fn missed_at(&mut self, stamp: Stamp) -> Option<Isometry3<f64>> {
        let missed = self.late.missed_at(stamp);
        self.counts.late_cycles += u64::from(missed.is_some());
        missed
    }

    /// The first cycle's frame is that of the map: a path in another one is none of it.
    pub(crate) fn forget_path_of_another_frame(&mut self, frame_id: &str) {
        let path = &mut self.stands_on;
        *path = path.take().filter(|path| path.frame_id() == frame_id);
    }

    /// What came of them since the map was empty.
    pub(crate) fn counts(&self) -> CorrectionCounts {
        self.counts
    }
}

impl StaticMap {
    /// Takes the trajectory of the platform as the map of the poses has it by now, and moves what has moved with it. The first
    /// path, and one that has no vertex in common with the last, is what later ones are held against. Without a path, or
    /// with one that does not change, the map is the same to the last bit.
    ///
    /// What was seen at [`MapPath::since`] or later stays, and what comes later and is of before is brought over. What was
    /// seen between two vertices moves by what lies between theirs; what was seen after the last that both paths have, by
    /// that of the last; and points of a map that was loaded stay.
    ///
    /// Costs by the voxels of the map. Takes 92 bytes for each voxel that moves while it is made, and where old voxels make
    /// room, 12 for each voxel; where tiles are spilled, all of them are read, written elsewhere, and take room on the disk
    /// twice meanwhile. When something has moved, who follows the changes needs the whole map:
    /// [`super::MapChanges::is_incomplete`].
    ///
    /// # Errors
    /// When the path is in another frame than the map, or a tile cannot be read or written for now; the map is then as it
    /// was.
    pub fn follow_path(&mut self, path: &MapPath) -> Result<MapCorrection, CorrectionError> {
        let map = MapNow {
            frame_id: self.frame_id.as_deref(),
            stamp: self.stamp,
            edge_m: self.grid.edge_m(),
        };
        let Some(asked) = self.corrections.asked_by(path, map)? else {
            return Ok(MapCorrection::default());
        };
        match self.move_voxels(&asked.made, asked.until) {
            Ok(moved) => Ok(MapCorrection { shift_m: self.corrections.done(asked), ..moved }),
            Err(error) => {
                self.corrections.put_off(&asked);
                Err(error.into())
            }
        }
    }

    /// What the corrections did since the map was empty.
    #[must_use]
    pub fn correction_counts(&self) -> CorrectionCounts {
        self.corrections.counts()
    }
}
