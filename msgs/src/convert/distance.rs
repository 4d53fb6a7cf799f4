//! How far places of the map are from the nearest obstacle.

use geometry::{DistanceAt, DistanceLattice, PlaceState};

use super::header_of;
use crate::geometry_msgs::Point;
use crate::stillmap_msgs::{DistanceField, Distances};

/// The message of distances.
#[must_use]
pub fn message_from_distances(distances: &geometry::Distances) -> Distances {
    let away = |at: &DistanceAt| -> [f32; 3] {
        at.nearest.and_then(|nearest| nearest.away).map_or([0.0; 3], Into::into)
    };
    Distances {
        header: header_of(distances.stamp, &distances.frame_id),
        distances: distances.at.iter().map(distance_m).collect(),
        gradients: distances.at.iter().flat_map(away).collect(),
        states: distances.at.iter().map(state).collect(),
    }
}

/// The message of a lattice of distances.
#[must_use]
pub fn field_from_distances(lattice: &DistanceLattice) -> DistanceField {
    let [x, y, z] = lattice.origin_m.coords.into();
    let [size_x, size_y, size_z] = lattice.size.map(|along| along as u32);
    DistanceField {
        header: header_of(lattice.stamp, &lattice.frame_id),
        origin: Point { x, y, z },
        resolution: lattice.edge_m,
        size_x,
        size_y,
        size_z,
        max_distance: lattice.max_distance_m,
        distances: lattice.at.iter().map(distance_m).collect(),
        states: lattice.at.iter().map(state).collect(),
    }
}

/// As REP-117 has it for ranges: +Inf is too far to be measured.
fn distance_m(at: &DistanceAt) -> f32 {
    at.nearest.map_or(f32::INFINITY, |nearest| nearest.distance_m)
}

fn state(at: &DistanceAt) -> u8 {
    match at.place {
        PlaceState::Unknown => Distances::UNKNOWN,
        PlaceState::Free => Distances::FREE,
        PlaceState::Behind => Distances::BEHIND,
    }
}

#[cfg(test)]
mod tests {
    use geometry::{NearestObstacle, Stamp};
    use nalgebra::{Point3, Vector3};

    use super::*;

    fn answers() -> Vec<DistanceAt> {
        let nearest = |distance_m, away| Some(NearestObstacle { distance_m, away });
        vec![
            DistanceAt { nearest: nearest(0.5, Some(Vector3::y())), place: PlaceState::Free },
            DistanceAt { nearest: nearest(0.25, None), place: PlaceState::Behind },
            DistanceAt::default(),
        ]
    }

    #[test]
    fn each_place_has_its_distance_gradient_and_state() {
        let stamp = Stamp::from_nanos(1_500_000_000);
        let at = answers();
        let message =
            message_from_distances(&geometry::Distances { stamp, frame_id: "map".to_owned(), at });
        assert_eq!(message.header, header_of(stamp, "map"));
        assert_eq!(message.distances, [0.5, 0.25, f32::INFINITY]);
        assert_eq!(message.gradients, [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(message.states, [Distances::FREE, Distances::BEHIND, Distances::UNKNOWN]);
    }

    #[test]
    fn a_lattice_keeps_its_order_and_place() {
        let message = field_from_distances(&DistanceLattice {
            stamp: Stamp::from_nanos(7),
            frame_id: "map".to_owned(),
            origin_m: Point3::new(-1.0, 2.0, 0.5),
            edge_m: 0.05,
            size: [3, 1, 1],
            max_distance_m: 2.0,
            at: answers(),
        });
        assert_eq!(message.origin, Point { x: -1.0, y: 2.0, z: 0.5 });
        assert_eq!((message.size_x, message.size_y, message.size_z), (3, 1, 1));
        assert_eq!((message.resolution, message.max_distance), (0.05, 2.0));
        assert_eq!(message.distances, [0.5, 0.25, f32::INFINITY]);
        assert_eq!(message.states, [1, 2, 0]);
    }
}
