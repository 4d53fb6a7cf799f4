//! How far a place of the map is from the nearest obstacle.

use nalgebra::{Point3, Vector3};

use crate::Stamp;

/// What is recorded of a place.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum PlaceState {
    /// Nothing: it was never seen, it is behind what was seen, or it is free and no surface is near: a map of surfaces keeps what
    /// is free beside surfaces alone.
    #[default]
    Unknown,
    /// It was seen to be free: it is before a surface.
    Free,
    /// It is behind a surface, by no more than the truncation of its distances.
    Behind,
}

/// The nearest obstacle of a place.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct NearestObstacle {
    /// How far away it is; never negative, also behind a surface.
    pub distance_m: f32,
    /// The direction in which the distance grows, of length 1; `None` where it grows in none, as between two walls.
    pub away: Option<Vector3<f32>>,
}

/// The answer for one place.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct DistanceAt {
    /// `None` where no obstacle is within the bound.
    pub nearest: Option<NearestObstacle>,
    /// What is recorded there. It does not depend on the distance.
    pub place: PlaceState,
}

/// The answers for some places.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Distances {
    /// When the map was last seen.
    pub stamp: Stamp,
    /// The frame of the map.
    pub frame_id: String,
    /// In the order of the places.
    pub at: Vec<DistanceAt>,
}

/// The distances of a box of the map, on a lattice. A slice has one layer.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct DistanceLattice {
    /// When the map was last seen.
    pub stamp: Stamp,
    /// The frame of the map.
    pub frame_id: String,
    /// The place of the first value.
    pub origin_m: Point3<f64>,
    /// How far places are apart.
    pub edge_m: f64,
    /// Places along x, y and z.
    pub size: [usize; 3],
    /// Farther distances are not computed.
    pub max_distance_m: f64,
    /// Of each place; x runs fastest, then y, then z.
    pub at: Vec<DistanceAt>,
}
