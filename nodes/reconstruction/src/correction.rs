//! A map follows the corrections of the poses that it was built with.
//!
//! A SLAM that closes a loop moves its keyframes, and its poses from then on fit those. What was put into the map by the earlier
//! poses is then in the wrong place: without a correction the walls are double. So each part of the map (a voxel of means, or a
//! block of a surface) has the time at which it was seen first, and moves with that part of the trajectory. Separate grids, one
//! for each part of the trajectory, would hold the same place again each time that it is seen, and grow without end in the same
//! flat.
//!
//! A correction says for each time of the trajectory what has moved there ([`geometry::PathCorrection`]). What has moved by more
//! than [`STAYS_IN_EDGES`] is moved in the map; parts that come to the same place are one from then on. What has moved by less
//! stays until it has moved by more.

use geometry::{LateCorrections, MapPath, PathCorrection, PathKnot, Stamp};
use nalgebra::{Isometry3, Vector3};

use crate::tiles::TileError;

/// What moves by no more than this share of the voxel's edge stays: 2 cm of 8 cm, about what a voxel's mean says of its
/// surface. Each move costs the map some of its voxels, where two come to one place.
const STAYS_IN_EDGES: f64 = 0.25;

/// By a turn of the platform what is far moves farther than what is near. So far is what counts: the reach of a depth
/// camera.
const REACH_M: f64 = 5.0;

/// Finer than the time between two cycles of any scanner or camera.
pub(crate) const TICK_S: f64 = 0.01;

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

impl Asked {
    /// By how much the height of something changes, at most.
    pub(crate) fn lift_m(&self) -> f64 {
        let lift_m = |PathKnot { place_m, now_from_before, .. }: &PathKnot| {
            let tilt = (now_from_before.rotation * Vector3::z()).xy().norm();
            (now_from_before * place_m - place_m).z.abs() + REACH_M * tilt
        };
        self.made.knots().iter().map(lift_m).fold(0.0, f64::max)
    }
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
