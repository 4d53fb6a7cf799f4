//! Tracks are followed in a frame that does not jump when the map is corrected, and reported in the map.

use geometry::Track;
use nalgebra::{Isometry3, Matrix6};

/// A track of the continuous frame in the map.
pub(crate) fn in_map(track: &Track, map_from_continuous: &Isometry3<f64>) -> Track {
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
