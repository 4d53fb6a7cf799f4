//! Tracks.

use geometry::{CycleTracks, Track};
use nalgebra::{Matrix6, Vector3};

use super::ConvertError;
use super::pose::{header_of, message_from_point, point_from_message};
use super::stamp_from_time;
use crate::geometry_msgs::Vector3 as VectorMessage;
use crate::stillmap_msgs::{Track as TrackMessage, Tracks};

/// The tracks of one cycle as a message, in the map frame.
#[must_use]
pub fn message_from_tracks(cycle: &CycleTracks) -> Tracks {
    Tracks {
        header: header_of(cycle.stamp, &cycle.map_frame_id),
        cycle: cycle.index,
        tracks: cycle.tracks.iter().map(message_from_track).collect(),
    }
}

/// The tracks of a message.
///
/// # Errors
/// When a position or a velocity is not finite.
pub fn tracks_from_message(message: &Tracks) -> Result<CycleTracks, ConvertError> {
    let tracks: Result<Vec<Track>, _> = message.tracks.iter().map(track_from_message).collect();
    Ok(CycleTracks {
        index: message.cycle,
        stamp: stamp_from_time(message.header.stamp),
        map_frame_id: message.header.frame_id.clone(),
        tracks: tracks?,
    })
}

fn message_from_track(track: &Track) -> TrackMessage {
    let mut covariance = [0.0; 36];
    for (at, value) in covariance.iter_mut().enumerate() {
        *value = track.covariance.get((at / 6, at % 6)).copied().unwrap_or_default();
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
    use geometry::Stamp;
    use nalgebra::Point3;

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
        let cycle = CycleTracks {
            index: 9,
            stamp: Stamp::from_nanos(5),
            map_frame_id: "map".to_owned(),
            tracks: vec![track()],
        };
        let message = message_from_tracks(&cycle);
        let decoded: Tracks = cdr::decode(&cdr::encode(&message).unwrap()).unwrap();
        assert_eq!(tracks_from_message(&decoded), Ok(cycle));
    }

    #[test]
    fn a_track_that_is_nowhere_is_refused() {
        let mut message = message_from_track(&track());
        message.velocity.y = f64::NAN;
        assert!(matches!(track_from_message(&message), Err(ConvertError::Position { .. })));
    }
}
