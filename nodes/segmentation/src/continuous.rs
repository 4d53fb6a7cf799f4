//! A map that is corrected is no motion: what moves is looked for in a frame that does not jump with it.

use std::borrow::Cow;

use geometry::{ContinuousFrame, DetectedCycle, MapPath, Track};
use nalgebra::{Isometry3, Matrix6};

use crate::Step;
use crate::free_space::FreeSpaceSegmenter;
use crate::segmenter::Judged;

/// The method `free_space` in a frame that does not jump when the map is corrected. Without a path, and as long as none has
/// moved, that frame is the map, to the bit.
#[derive(Clone, Debug)]
pub(crate) struct ContinuousSegmenter {
    pub(crate) segmenter: FreeSpaceSegmenter,
    pub(crate) frame: ContinuousFrame,
}

impl ContinuousSegmenter {
    /// Judges the points of a cycle; tracks are where the map has them.
    pub(crate) fn step(&mut self, cycle: &DetectedCycle, observe: &mut impl FnMut(Step)) -> Judged {
        let stamp = cycle.reduced_cloud.stamp;
        let map_from_continuous = self.frame.map_from_continuous(stamp, &cycle.map_frame_id);
        let continuous = in_continuous_frame(cycle, map_from_continuous.as_ref());
        let mut judged = self.segmenter.step(&continuous, observe);
        if let Some(map_from_continuous) = &map_from_continuous {
            judged.tracks.iter_mut().for_each(|track| *track = in_map(track, map_from_continuous));
        }
        judged
    }

    /// Takes the trajectory of the platform as the map of its poses has it by now.
    pub(crate) fn follow_path(&mut self, path: MapPath) {
        self.frame.take(path);
    }
}

/// The cycle in the continuous frame.
fn in_continuous_frame<'a>(
    cycle: &'a DetectedCycle,
    map_from_continuous: Option<&Isometry3<f64>>,
) -> Cow<'a, DetectedCycle> {
    match map_from_continuous {
        None => Cow::Borrowed(cycle),
        Some(map_from_continuous) => {
            let map_from_rig = map_from_continuous.inverse() * cycle.map_from_rig;
            Cow::Owned(DetectedCycle { map_from_rig, ..cycle.clone() })
        }
    }
}

/// A track of the continuous frame in the map.
fn in_map(track: &Track, map_from_continuous: &Isometry3<f64>) -> Track {
    let turn = map_from_continuous.rotation.to_rotation_matrix().into_inner();
    let mut turn_of_both = Matrix6::zeros();
    turn_of_both.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
    turn_of_both.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
    Track {
        position_m: map_from_continuous * track.position_m,
        velocity_m_per_s: map_from_continuous * track.velocity_m_per_s,
        // Of the box that holds the turned one.
        extent_m: turn.abs() * track.extent_m,
        covariance: turn_of_both * track.covariance * turn_of_both.transpose(),
        ..*track
    }
}

#[cfg(test)]
mod tests {
    use geometry::pose_from_vector;
    use nalgebra::{Point3, Vector3};

    use super::*;

    #[test]
    fn a_track_is_turned_and_shifted_with_all_that_is_known_of_it() {
        let covariance =
            Matrix6::from_diagonal(&nalgebra::Vector6::new(1.0, 4.0, 9.0, 0.1, 0.2, 0.3));
        let track = Track {
            id: 3,
            position_m: Point3::new(1.0, 0.0, 0.5),
            velocity_m_per_s: Vector3::new(1.0, 0.0, 0.0),
            extent_m: Vector3::new(0.6, 0.2, 1.7),
            covariance,
            age_s: 1.0,
            unseen_cycles: 0,
        };
        let quarter = pose_from_vector(&[2.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0]);
        let moved = in_map(&track, &quarter);
        assert!((moved.position_m - Point3::new(2.0, 1.0, 0.5)).norm() < 1e-12);
        assert!((moved.velocity_m_per_s - Vector3::y()).norm() < 1e-12);
        assert!((moved.extent_m - Vector3::new(0.2, 0.6, 1.7)).norm() < 1e-12);
        let diagonal = moved.covariance.diagonal();
        let expected = nalgebra::Vector6::new(4.0, 1.0, 9.0, 0.2, 0.1, 0.3);
        assert!((diagonal - expected).norm() < 1e-12, "{diagonal}");
        assert_eq!((moved.id, moved.age_s), (3, 1.0));
    }
}
