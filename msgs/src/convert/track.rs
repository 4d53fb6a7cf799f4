//! Tracks.

use geometry::{SegmentedCycle, Track};
use nalgebra::{Matrix6, Vector3};

use super::ConvertError;
use super::pose::{header_of, message_from_point, point_from_message};
use crate::geometry_msgs::Vector3 as VectorMessage;
use crate::stillmap_msgs::{Track as TrackMessage, Tracks};

/// The tracks of one cycle as a message, in the map frame.
#[must_use]
pub fn message_from_tracks(cycle: &SegmentedCycle, tracks: &[Track]) -> Tracks {
    let cloud = &cycle.static_cloud;
    Tracks {
        header: header_of(cloud.stamp, &cloud.frame_id),
        cycle: cycle.index,
        tracks: tracks.iter().map(message_from_track).collect(),
    }
}

/// The tracks of a message, whose header and cycle say where they belong.
///
/// # Errors
/// When a position or a velocity is not finite.
pub fn tracks_from_message(message: &Tracks) -> Result<Vec<Track>, ConvertError> {
    message.tracks.iter().map(track_from_message).collect()
}

fn message_from_track(track: &Track) -> TrackMessage {
    let mut covariance = [0.0; 36];
    for (at, value) in covariance.iter_mut().enumerate() {
        *value = track.covariance[(at / 6, at % 6)];
    }
    TrackMessage {
        id: track.id,
        position: message_from_point(&track.position_m),
        velocity: message_from_vector(&track.velocity_m_per_s),
        extent: message_from_vector(&track.extent_m),
        covariance,
        age_s: track.age_s,
        unseen_cycles: track.unseen_cycles,
    }
}

fn track_from_message(message: &TrackMessage) -> Result<Track, ConvertError> {
    Ok(Track {
        id: message.id,
        position_m: point_from_message(&message.position)?,
        velocity_m_per_s: vector_from_message(message.velocity)?,
        extent_m: vector_from_message(message.extent)?,
        covariance: Matrix6::from_row_slice(&message.covariance),
        age_s: message.age_s,
        unseen_cycles: message.unseen_cycles,
    })
}

fn message_from_vector(vector: &Vector3<f64>) -> VectorMessage {
    VectorMessage { x: vector.x, y: vector.y, z: vector.z }
}

fn vector_from_message(message: VectorMessage) -> Result<Vector3<f64>, ConvertError> {
    let VectorMessage { x: x_m, y: y_m, z: z_m } = message;
    let vector = Vector3::new(x_m, y_m, z_m);
    if vector.iter().all(|value| value.is_finite()) {
        Ok(vector)
    } else {
        Err(ConvertError::Position { x_m, y_m, z_m })
    }
}

#[cfg(test)]
mod tests {
    use geometry::{Cloud, Stamp};
    use nalgebra::{Isometry3, Point3};

    use super::*;
    use crate::cdr;

    fn track() -> Track {
        Track {
            id: 3,
            position_m: Point3::new(2.0, -0.5, 0.1),
            velocity_m_per_s: Vector3::new(0.0, 1.4, 0.0),
            extent_m: Vector3::new(0.4, 0.5, 1.7),
            covariance: Matrix6::from_fn(|row, column| (row * 6 + column) as f64),
            age_s: 1.5,
            unseen_cycles: 2,
        }
    }

    #[test]
    fn tracks_come_back_from_the_wire() {
        let cloud =
            Cloud { stamp: Stamp::from_nanos(5), frame_id: "map".to_owned(), points_m: Vec::new() };
        let cycle = SegmentedCycle {
            depth: None,
            scan_rays: std::sync::Arc::default(),
            index: 9,
            static_cloud: cloud.clone(),
            dynamic_cloud: cloud,
            map_from_rig: Isometry3::identity(),
            setup: geometry::CycleSetup::default(),
            retracted_m: Vec::new(),
        };
        let message = message_from_tracks(&cycle, &[track()]);
        let decoded: Tracks = cdr::decode(&cdr::encode(&message).unwrap()).unwrap();
        assert_eq!((decoded.cycle, decoded.header.frame_id.as_str()), (9, "map"));
        assert_eq!(tracks_from_message(&decoded), Ok(vec![track()]));
    }

    #[test]
    fn a_track_that_is_nowhere_is_refused() {
        let mut message = message_from_track(&track());
        message.velocity.y = f64::NAN;
        assert!(matches!(track_from_message(&message), Err(ConvertError::Position { .. })));
    }
}
