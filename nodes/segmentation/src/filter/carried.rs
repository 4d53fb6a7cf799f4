//! Where the rig is between the cycles, and after the last one.

use std::collections::VecDeque;

use geometry::Stamp;
use nalgebra::Isometry3;

use super::Verdict;

/// A platform is no faster: twice a walking pace. Beyond that the map was corrected.
const FASTEST_M_PER_S: f64 = 3.0;
/// ... and turns no faster: half a turn a second.
const FASTEST_RAD_PER_S: f64 = std::f64::consts::PI;
/// The motion goes on as it was for so long.
const LONGEST_ON_S: f64 = 0.3;

/// The pose of the rig at a moment, by those of the two cycles around it, or of the last two, whose motion goes on. That of one
/// cycle where there is no other, or where the pose jumps between the two.
pub(super) fn rig_pose_at(verdicts: &VecDeque<Verdict>, at: Stamp) -> Option<Isometry3<f64>> {
    let after = verdicts.partition_point(|one| one.view_stamp < at);
    let later = verdicts.get(after).or_else(|| verdicts.back())?;
    // Several scans may have the same image.
    let is_earlier = |one: &&Verdict| one.view_stamp < later.view_stamp;
    let is_later = |one: &&Verdict| one.view_stamp > later.view_stamp;
    let (earlier, later) = match verdicts.iter().rev().find(is_earlier) {
        Some(earlier) => (earlier, later),
        None => match verdicts.iter().find(is_later) {
            Some(next) => (later, next),
            None => return Some(later.map_from_rig),
        },
    };
    let apart_s = later.view_stamp.seconds_since(earlier.view_stamp);
    let (from, to) = (&earlier.map_from_rig, &later.map_from_rig);
    let moved_m = (to.translation.vector - from.translation.vector).norm();
    let turned_rad = from.rotation.angle_to(&to.rotation);
    if moved_m > FASTEST_M_PER_S * apart_s || turned_rad > FASTEST_RAD_PER_S * apart_s {
        let since_s = at.seconds_since(earlier.view_stamp);
        return Some(if since_s < 0.5 * apart_s { *from } else { *to });
    }
    let since_s = at.seconds_since(earlier.view_stamp).clamp(-LONGEST_ON_S, apart_s + LONGEST_ON_S);
    let share = since_s / apart_s;
    let translation = from.translation.vector.lerp(&to.translation.vector, share);
    let turn = (from.rotation.inverse() * to.rotation).scaled_axis() * share;
    let rotation = from.rotation * nalgebra::UnitQuaternion::from_scaled_axis(turn);
    Some(Isometry3::from_parts(translation.into(), rotation))
}
