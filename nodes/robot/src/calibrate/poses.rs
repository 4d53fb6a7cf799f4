//! The rig's motion between a beam and an image.

use geometry::BeamOrder;
use geometry::{PoseBuffer, Scan, Stamp, StampedPose};
use nalgebra::{Isometry3, Vector3};

/// The platform is static if its poses differ by less over the whole bag: less than the noise of a range ...
const STATIC_M: f64 = 0.02;
/// ... and half of a beam's step.
const STATIC_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// The usual range of a return, which converts a rotation to a distance.
const USUAL_DISTANCE_M: f64 = 4.0;
/// Poses are averaged over this time, so that the noise of a localisation is no motion: a platform takes longer to set off and stop ...
const AVERAGED_S: f64 = 0.25;
/// ... with so many of them.
const AVERAGED: u32 = 8;

/// The poses of a bag.
pub(super) struct Poses {
    buffer: PoseBuffer,
    first: Option<Isometry3<f64>>,
    is_static: bool,
    unusable: usize,
}

impl Poses {
    /// Without poses yet; `capacity` is the number of poses that are kept.
    pub(super) fn new(capacity: usize, max_gap_s: f64) -> Self {
        let buffer = PoseBuffer::new(capacity).with_max_gap_s(max_gap_s);
        Self { buffer, first: None, is_static: true, unusable: 0 }
    }

    pub(super) fn push(&mut self, pose: StampedPose) {
        let map_from_rig = pose.map_from_rig;
        if self.buffer.push(pose).is_err() {
            self.unusable += 1;
            return;
        }
        let first = self.first.get_or_insert(map_from_rig);
        let distance_m = (map_from_rig.translation.vector - first.translation.vector).norm();
        self.is_static &=
            distance_m < STATIC_M && first.rotation.angle_to(&map_from_rig.rotation) < STATIC_RAD;
    }

    /// Counts a pose that could not be read.
    pub(super) fn skip(&mut self) {
        self.unusable += 1;
    }

    pub(super) fn unusable(&self) -> usize {
        self.unusable
    }

    /// The pose of the rig; a static platform has one at any time.
    pub(super) fn at(&self, stamp: Stamp) -> Option<Isometry3<f64>> {
        if self.is_static {
            return self.first;
        }
        self.buffer.at(stamp).ok().map(|pose| pose.map_from_rig)
    }

    /// How far the farthest returns move while the scanner turns once; `None` without poses around it.
    pub(super) fn motion_m(&self, from: Stamp, to: Stamp) -> Option<f64> {
        let (from, to) = (self.at(from)?, self.at(to)?);
        let distance_m = (to.translation.vector - from.translation.vector).norm();
        Some(distance_m + USUAL_DISTANCE_M * from.rotation.angle_to(&to.rotation))
    }

    /// The same without the noise of single poses, by averages in the half second before and after the middle of the turn.
    pub(super) fn averaged_motion_m(&self, from: Stamp, to: Stamp) -> Option<f64> {
        let turn_s = to.seconds_since(from);
        let middle = from.plus_seconds(0.5 * turn_s);
        let averages = [-2.0, -1.0, 0.0, 1.0]
            .map(|begin| self.average_from(middle.plus_seconds(begin * AVERAGED_S)));
        let mut most_m = 0.0_f64;
        for two in averages.windows(2) {
            let [Some((there, turned)), Some((here, turned_here))] = two else { return None };
            let way_m = (here - there).norm() + USUAL_DISTANCE_M * (turned_here - turned).norm();
            most_m = most_m.max(way_m);
        }
        Some(most_m * turn_s / AVERAGED_S)
    }

    /// The mean position, and the mean rotation beside the first pose.
    fn average_from(&self, begin: Stamp) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let first = self.first?.rotation;
        let (mut position_m, mut turned) = (Vector3::zeros(), Vector3::zeros());
        for sample in 0..AVERAGED {
            let after_s = AVERAGED_S * f64::from(sample) / f64::from(AVERAGED);
            let pose = self.at(begin.plus_seconds(after_s))?;
            position_m += pose.translation.vector;
            turned += first.rotation_to(&pose.rotation).scaled_axis();
        }
        Some((position_m / f64::from(AVERAGED), turned / f64::from(AVERAGED)))
    }
}

/// When a scanner measured a beam of its message.
pub(super) fn beam_stamp(scan: &Scan, beam: usize, turn_s: f64, order: BeamOrder) -> Stamp {
    let beams = scan.ranges_m.len();
    let increment_s = f64::from(scan.time_increment_s);
    let step_s = if increment_s > 0.0 && increment_s.is_finite() {
        increment_s
    } else {
        turn_s / beams.max(1) as f64
    };
    let after_s = match order {
        BeamOrder::Unknown => 0.5 * turn_s,
        BeamOrder::FirstToLast => beam as f64 * step_s,
        BeamOrder::LastToFirst => beams.saturating_sub(beam + 1) as f64 * step_s,
    };
    scan.stamp.plus_seconds(after_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(milliseconds: i64, x_m: f64) -> StampedPose {
        StampedPose {
            stamp: Stamp::from_nanos(milliseconds * 1_000_000),
            frame_id: "map".to_owned(),
            map_from_rig: Isometry3::translation(x_m, 0.0, 0.0),
        }
    }

    #[test]
    fn a_static_platform_has_its_pose_at_any_time() {
        let mut poses = Poses::new(10, 0.5);
        assert_eq!(poses.at(Stamp::from_nanos(0)), None);
        poses.push(pose(0, 1.0));
        poses.push(pose(5_000, 1.01));
        let far_away = Stamp::from_secs_nanos(100, 0);
        assert_eq!(poses.at(far_away), Some(Isometry3::translation(1.0, 0.0, 0.0)));
        assert_eq!(poses.motion_m(Stamp::from_nanos(0), far_away), Some(0.0));
        poses.push(pose(5_100, 1.11));
        assert_eq!(poses.at(far_away), None);
        let between = poses.at(Stamp::from_nanos(5_050_000_000)).unwrap();
        assert!((between.translation.x - 1.06).abs() < 1e-9);
        poses.push(pose(5_100, 3.0));
        poses.skip();
        assert_eq!(poses.unusable(), 2);
    }

    /// Regression: a localisation that scatters by 5 mm was motion in every scan.
    #[test]
    fn scatter_of_a_platform_that_stands_is_no_motion() {
        let mut poses = Poses::new(1000, 0.5);
        // Not static as a whole: it comes in first.
        let scatter_m = [0.005, -0.004, 0.0, 0.003, -0.005, 0.004, -0.003];
        for index in 0..200 {
            let to_come_m = 0.5 - 0.01 * index.min(50) as f64;
            poses.push(pose(20 * index, to_come_m + scatter_m[index as usize % 7]));
        }
        let turn = |at_ms: i64| {
            let stamp = |ms: i64| Stamp::from_nanos(ms * 1_000_000);
            (stamp(at_ms), stamp(at_ms + 100))
        };
        let (from, to) = turn(3000);
        let averaged_m = poses.averaged_motion_m(from, to).unwrap();
        assert!(averaged_m < 0.003, "{averaged_m}");
        // What moves is as fast as it is, and there is nothing beyond the ends.
        let (from, to) = turn(500);
        let averaged_m = poses.averaged_motion_m(from, to).unwrap();
        assert!((averaged_m - 0.05).abs() < 0.005, "{averaged_m}");
        let (from, to) = turn(3900);
        assert_eq!(poses.averaged_motion_m(from, to), None);
    }

    #[test]
    fn beams_are_measured_in_their_order() {
        let scan = Scan { ranges_m: vec![1.0; 11], time_increment_s: 0.01, ..Scan::default() };
        let after = |beam, order| beam_stamp(&scan, beam, 0.1, order).seconds_since(scan.stamp);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        assert!(near(after(3, BeamOrder::FirstToLast), 0.03));
        assert!(near(after(3, BeamOrder::LastToFirst), 0.07));
        assert!(near(after(3, BeamOrder::Unknown), 0.05));
        let without_increment = Scan { time_increment_s: 0.0, ..scan };
        let after = beam_stamp(&without_increment, 5, 0.11, BeamOrder::FirstToLast)
            .seconds_since(without_increment.stamp);
        assert!(near(after, 0.05));
    }
}
