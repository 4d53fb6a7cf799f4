//! A trajectory: poses in the order of time, and counts of the unusable poses of its source.

use geometry::Stamp;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use serde::Serialize;

/// The largest valid coordinate: six times the distance to the sun, and sums of its square do not overflow.
const FARTHEST_M: f64 = 1e12;
/// The least length of a valid quaternion.
const LEAST_QUATERNION_NORM: f64 = 1e-6;
/// Quaternions printed with four decimals, as in the TUM benchmark, are off by a few 1e-4; more than this is reported.
const ROUNDED_QUATERNION: f64 = 1e-2;

/// A pose of the source, not yet validated.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RawPose {
    /// x, y, z in the frame of the trajectory.
    pub position_m: [f64; 3],
    /// x, y, z, w; not necessarily of length 1.
    pub quaternion_xyzw: [f64; 4],
}

/// The times of the poses of a trajectory.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Times {
    /// Stamps, in ascending order, each once.
    Stamps(Vec<Stamp>),
    /// Frame numbers in a sequence, from 0; frames without a usable pose are absent.
    Frames(Vec<usize>),
}

/// Counts of the poses of a source that were left out or changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct LeftOut {
    /// Left out: a number is not finite or too large, or the quaternion has no length, as written by a tracker that is
    /// lost.
    pub not_a_pose: usize,
    /// Left out: the stamp was a repetition.
    pub repeated_stamps: usize,
    /// Kept and sorted by time: the stamp was earlier than that of the pose before.
    pub out_of_order: usize,
    /// Kept and normalised: the length of the quaternion was off by more than rounding.
    pub renormalised: usize,
}

/// Poses in the order of time.
#[derive(Clone, PartialEq, Debug)]
pub struct Trajectory {
    times: Times,
    world_from_body: Vec<Isometry3<f64>>,
    left_out: LeftOut,
}

/// There are fewer stamps than frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("there are {stamps} stamps for {frames} frames: each frame needs one")]
pub struct StampsError {
    /// The number of stamps.
    pub stamps: usize,
    /// The number of frames up to the last with a pose.
    pub frames: usize,
}

impl Trajectory {
    /// The trajectory of stamped poses in any order. Of poses with the same stamp the first is kept.
    #[must_use]
    pub fn stamped(poses: impl IntoIterator<Item = (Stamp, RawPose)>) -> Self {
        let mut left_out = LeftOut::default();
        let mut usable: Vec<(Stamp, Isometry3<f64>)> = Vec::new();
        for (stamp, raw) in poses {
            let Some(pose) = left_out.usable(&raw) else { continue };
            left_out.out_of_order +=
                usize::from(usable.last().is_some_and(|(before, _)| stamp < *before));
            usable.push((stamp, pose));
        }
        // Stable: the first of a stamp stays the first.
        usable.sort_by_key(|(stamp, _)| *stamp);
        let given = usable.len();
        usable.dedup_by_key(|(stamp, _)| *stamp);
        left_out.repeated_stamps = given - usable.len();
        let (stamps, world_from_body) = usable.into_iter().unzip();
        Self { times: Times::Stamps(stamps), world_from_body, left_out }
    }

    /// The trajectory of a sequence of frames.
    #[must_use]
    pub fn numbered(poses: impl IntoIterator<Item = RawPose>) -> Self {
        let mut left_out = LeftOut::default();
        let (frames, world_from_body) = poses
            .into_iter()
            .enumerate()
            .filter_map(|(frame, raw)| Some((frame, left_out.usable(&raw)?)))
            .unzip();
        Self { times: Times::Frames(frames), world_from_body, left_out }
    }

    /// The trajectory with the stamps of its frames; one that has stamps keeps them.
    ///
    /// # Errors
    /// When there are fewer stamps than frames.
    pub fn with_stamps(self, stamps: &[Stamp]) -> Result<Self, StampsError> {
        let Times::Frames(frames) = &self.times else { return Ok(self) };
        let needed = frames.last().map_or(0, |last| last + 1);
        let of_frames: Option<Vec<Stamp>> =
            frames.iter().map(|frame| stamps.get(*frame).copied()).collect();
        let Some(of_frames) = of_frames else {
            return Err(StampsError { stamps: stamps.len(), frames: needed });
        };
        let Self { world_from_body, left_out, .. } = self;
        let mut stamped: Vec<_> = of_frames.into_iter().zip(world_from_body).collect();
        stamped.sort_by_key(|(stamp, _)| *stamp);
        let given = stamped.len();
        stamped.dedup_by_key(|(stamp, _)| *stamp);
        let repeated_stamps = given - stamped.len();
        let (stamps, world_from_body) = stamped.into_iter().unzip();
        let left_out = LeftOut { repeated_stamps, ..left_out };
        Ok(Self { times: Times::Stamps(stamps), world_from_body, left_out })
    }

    /// The number of poses.
    #[must_use]
    pub fn len(&self) -> usize {
        self.world_from_body.len()
    }

    /// Whether it has no poses.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.world_from_body.is_empty()
    }

    /// The times of its poses.
    #[must_use]
    pub fn times(&self) -> &Times {
        &self.times
    }

    /// Its poses, each a transform from the body to the frame of the trajectory.
    #[must_use]
    pub fn poses(&self) -> &[Isometry3<f64>] {
        &self.world_from_body
    }

    /// Counts of the poses of its source that were left out or changed.
    #[must_use]
    pub fn left_out(&self) -> LeftOut {
        self.left_out
    }

    /// The length of its path, from pose to pose.
    #[must_use]
    pub fn path_m(&self) -> f64 {
        path_lengths_m(&self.world_from_body).last().copied().unwrap_or(0.0)
    }
}

impl LeftOut {
    /// The pose when it is valid; counts it otherwise.
    fn usable(&mut self, raw: &RawPose) -> Option<Isometry3<f64>> {
        let is_place = raw.position_m.iter().all(|value_m| value_m.abs() <= FARTHEST_M);
        let [x, y, z, w] = raw.quaternion_xyzw;
        let quaternion = Quaternion::new(w, x, y, z);
        let norm = quaternion.norm();
        if !is_place || !norm.is_finite() || norm < LEAST_QUATERNION_NORM {
            self.not_a_pose += 1;
            return None;
        }
        self.renormalised += usize::from((norm - 1.0).abs() > ROUNDED_QUATERNION);
        Some(Isometry3::from_parts(
            Translation3::from(Point3::from(raw.position_m)),
            UnitQuaternion::from_quaternion(quaternion),
        ))
    }

    /// Whether nothing was left out or changed.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// The length of the path up to each pose.
pub(super) fn path_lengths_m(poses: &[Isometry3<f64>]) -> Vec<f64> {
    let mut length_m = 0.0;
    let mut before: Option<&Isometry3<f64>> = None;
    poses
        .iter()
        .map(|pose| {
            length_m += before
                .map_or(0.0, |before| (pose.translation.vector - before.translation.vector).norm());
            before = Some(pose);
            length_m
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64) -> RawPose {
        RawPose { position_m: [x_m, 0.0, 0.0], quaternion_xyzw: [0.0, 0.0, 0.0, 1.0] }
    }

    fn second(seconds: i32) -> Stamp {
        Stamp::from_secs_nanos(seconds, 0)
    }

    #[test]
    fn stamps_are_put_in_order_and_the_first_of_each_is_kept() {
        let trajectory = Trajectory::stamped([
            (second(3), at(3.0)),
            (second(1), at(1.0)),
            (second(3), at(33.0)),
            (second(2), at(f64::NAN)),
        ]);
        assert_eq!(trajectory.times(), &Times::Stamps(vec![second(1), second(3)]));
        assert_eq!(trajectory.poses()[1].translation.x, 3.0);
        let expected =
            LeftOut { not_a_pose: 1, repeated_stamps: 1, out_of_order: 1, renormalised: 0 };
        assert_eq!(trajectory.left_out(), expected);
        assert_eq!(trajectory.path_m(), 2.0);
    }

    #[test]
    fn what_is_no_pose_is_left_out_and_what_is_one_is_made_rigid() {
        let quaternion = |quaternion_xyzw| RawPose { quaternion_xyzw, ..at(0.0) };
        let trajectory = Trajectory::numbered([
            quaternion([0.0; 4]),
            quaternion([0.0, 0.0, f64::NAN, 1.0]),
            quaternion([0.0, 0.0, 2.0, 0.0]),
            at(f64::INFINITY),
            at(2e12),
            at(1.0),
        ]);
        assert_eq!(trajectory.times(), &Times::Frames(vec![2, 5]));
        assert!((trajectory.poses()[0].rotation.angle() - std::f64::consts::PI).abs() < 1e-12);
        let left_out = trajectory.left_out();
        assert_eq!((left_out.not_a_pose, left_out.renormalised), (4, 1));
    }

    #[test]
    fn frames_take_the_stamps_of_their_numbers() {
        let trajectory = Trajectory::numbered([at(0.0), at(f64::NAN), at(2.0)]);
        let stamps = [second(5), second(6), second(7)];
        let stamped = trajectory.clone().with_stamps(&stamps).unwrap();
        assert_eq!(stamped.times(), &Times::Stamps(vec![second(5), second(7)]));
        let error = trajectory.with_stamps(&stamps[..2]).unwrap_err();
        assert_eq!(error, StampsError { stamps: 2, frames: 3 });
    }
}
