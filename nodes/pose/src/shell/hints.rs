//! Further inputs at the time of an image: tracked objects, a gyroscope, wheels.

use std::cmp::Ordering;
use std::collections::VecDeque;

use geometry::{CycleTracks, PoseBuffer, Stamp, Track, pose_from_vector};
use msgs::convert;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::Imu;
use msgs::stillmap_msgs::Tracks;
use nalgebra::{Isometry3, UnitQuaternion};
use node_shell::NodeFailure;

use super::frames::Frames;
use super::parameters::PoseParameters;
use crate::frame::MovingThing;
use crate::motion::{GyroSample, MotionConfig, Turn, WheelStep, integrated_turn};

/// Samples that are kept of a gyroscope: a second of a fast one.
const SAMPLES_KEPT: usize = 1_000;
/// Poses that are kept of wheels.
const WHEEL_POSES_KEPT: usize = 200;

/// The messages so far.
pub(super) struct Knowledge {
    tracks: Vec<Track>,
    tracks_at: Option<Stamp>,
    track_margin_m: f64,
    max_track_age_s: f64,
    camera_from_imu: UnitQuaternion<f64>,
    samples: VecDeque<GyroSample>,
    wheels: PoseBuffer,
    camera_from_rig: Isometry3<f64>,
}

impl Knowledge {
    pub(super) fn new(parameters: &PoseParameters) -> Self {
        let camera_from_rig = parameters.rig_from_camera().inverse();
        Self {
            tracks: Vec::new(),
            tracks_at: None,
            track_margin_m: parameters.track_margin_m,
            max_track_age_s: parameters.max_track_age_s,
            camera_from_imu: camera_from_rig.rotation
                * pose_from_vector(&parameters.rig_from_imu).rotation,
            samples: VecDeque::new(),
            wheels: PoseBuffer::new(WHEEL_POSES_KEPT)
                .with_max_gap_s(parameters.tracker.motion.max_gap_s),
            camera_from_rig,
        }
    }

    /// Takes the objects of a cycle. They must be in the parent frame of this node's poses: detection takes its poses
    /// from here.
    pub(super) fn take_tracks(
        &mut self,
        message: &Tracks,
        frames: &Frames,
    ) -> Result<(), NodeFailure> {
        if message.header.frame_id != frames.pose_frame_id() {
            return Err(format!(
                "tracks are in frame {:?}, not in {:?}: detection must take its pose from this node",
                message.header.frame_id,
                frames.pose_frame_id()
            )
            .into());
        }
        let CycleTracks { stamp, tracks, .. } = convert::tracks_from_message(message)?;
        self.tracks = tracks;
        self.tracks_at = Some(stamp);
        Ok(())
    }

    pub(super) fn take_imu(&mut self, message: &Imu) -> Result<(), NodeFailure> {
        let rate = self.camera_from_imu * convert::angular_velocity_from_message(message)?;
        let stamp = convert::stamp_from_time(message.header.stamp);
        match self.samples.back().map(|last| stamp.cmp(&last.stamp)) {
            // A driver may send a reading twice.
            Some(Ordering::Equal) => return Ok(()),
            Some(Ordering::Less) => self.samples.clear(),
            Some(Ordering::Greater) | None => {}
        }
        self.samples.push_back(GyroSample { stamp, rate_rad_per_s: rate });
        while self.samples.len() > SAMPLES_KEPT {
            self.samples.pop_front();
        }
        Ok(())
    }

    pub(super) fn take_wheels(&mut self, message: &Odometry) -> Result<(), NodeFailure> {
        let pose = convert::pose_from_odometry(message)?;
        if self.wheels.newest().is_some_and(|newest| newest.stamp > pose.stamp) {
            self.wheels.clear();
        }
        Ok(self.wheels.push(pose)?)
    }

    /// The objects at a stamp, in the tracker's frame.
    pub(super) fn moving(&self, at: Stamp, frames: &Frames) -> Vec<MovingThing> {
        let later_s = self.tracks_at.map(|tracks_at| at.seconds_since(tracks_at));
        let Some(later_s) = later_s.filter(|later_s| later_s.abs() <= self.max_track_age_s) else {
            return Vec::new();
        };
        let tracker_from_pose_frame = frames.pose_frame_from_tracker().inverse();
        let thing = |track: &Track| {
            let thing = MovingThing::of_track(track, later_s, self.track_margin_m);
            thing.moved(&tracker_from_pose_frame)
        };
        self.tracks.iter().map(thing).collect()
    }

    /// How the camera has turned, as far as the gyroscope covers it.
    pub(super) fn turn(&mut self, from: Stamp, to: Stamp, config: &MotionConfig) -> Option<Turn> {
        let samples = self.samples.make_contiguous();
        let since = samples.partition_point(|sample| sample.stamp <= from).saturating_sub(1);
        integrated_turn(samples.get(since..)?, from, to, config).ok()
    }

    /// How the rig has gone, as far as the wheels' poses cover it.
    pub(super) fn wheel_step(&self, from: Stamp, to: Stamp) -> Option<WheelStep> {
        Some(WheelStep {
            odom_from_base_before: self.wheels.at(from).ok()?.map_from_rig,
            odom_from_base_now: self.wheels.at(to).ok()?.map_from_rig,
            camera_from_base: self.camera_from_rig,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64) -> Stamp {
        Stamp::from_nanos(1_000_000_000).plus_seconds(seconds)
    }

    fn imu(seconds: f64, yaw_rate: f64) -> Imu {
        let mut message = Imu::default();
        message.header.stamp = convert::time_from_stamp(at(seconds));
        message.angular_velocity.z = yaw_rate;
        message
    }

    /// Regression: the zeros of a unit without a gyroscope were taken for no rotation, and a reading that came twice
    /// dropped all those before.
    #[test]
    fn a_unit_without_a_gyroscope_gives_no_turn_and_a_repeated_reading_changes_none() {
        let mut knowledge = Knowledge::new(&PoseParameters::default());
        let config = MotionConfig::default();
        let mut blind = imu(0.0, 0.0);
        blind.angular_velocity_covariance[0] = -1.0;
        let refused = knowledge.take_imu(&blind).unwrap_err().to_string();
        assert!(refused.contains("does not measure its angular velocity"), "{refused}");
        for sample in 0..40 {
            knowledge.take_imu(&imu(0.01 * f64::from(sample / 2), 0.5)).unwrap();
        }
        assert_eq!(knowledge.samples.len(), 20);
        let turn = knowledge.turn(at(0.05), at(0.15), &config).unwrap();
        assert!((turn.begin_from_end.angle() - 0.05).abs() < 1e-9, "{turn:?}");
    }
}
