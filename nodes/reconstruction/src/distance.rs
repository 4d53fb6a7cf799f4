//! How far places of the map are from the nearest obstacle: what is asked, and what cannot be answered.

use nalgebra::Point3;
use volume::DistanceConfigError;

/// The most places of one request: where each is in a block of its own, which is computed for it, they take some 2 s.
pub const MOST_PLACES: usize = 10_000;
/// The most places of a box: a slice of 25 by 25 m every 5 cm, which takes some 0.5 s when it is asked for first.
pub const MOST_BOX_PLACES: u64 = 250_000;

/// A box of the map, its sides along the axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MapBox {
    /// The least corner.
    pub least_m: Point3<f64>,
    /// The greatest corner; in a slice they have one coordinate in common.
    pub most_m: Point3<f64>,
}

/// There are no distances.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum DistanceError {
    /// The map is one of means of points.
    #[error("there are no distances: a map of the method rec_hv has none; free_space has them")]
    NoDistances,
    /// Nothing is in the map.
    #[error("there are no distances: the map is empty")]
    EmptyMap,
    /// Places of another frame.
    #[error("the places are in frame {asked:?}, the map in frame {map:?}")]
    AnotherFrame {
        /// The frame of the map.
        map: String,
        /// The frame of the places.
        asked: String,
    },
    /// A coordinate is no number.
    #[error("place {index} has a coordinate that is not finite: {x_m}, {y_m}, {z_m}")]
    NotFinite {
        /// Which place, counted from 0; of a box its corner.
        index: usize,
        /// Along x.
        x_m: f64,
        /// Along y.
        y_m: f64,
        /// Along z.
        z_m: f64,
    },
    /// The request is too large.
    #[error("{places} places: at most {most} are possible at a time")]
    TooManyPlaces {
        /// Of the request.
        places: u64,
        /// The bound.
        most: u64,
    },
    /// A box that ends before it begins.
    #[error("the box from {least_m:?} to {most_m:?} m ends before it begins")]
    TurnedBox {
        /// The corner that is to be the least.
        least_m: [f64; 3],
        /// The corner that is to be the greatest.
        most_m: [f64; 3],
    },
    /// A parameter has a value that means nothing.
    #[error(transparent)]
    Config(#[from] DistanceConfigError),
    /// Spilled tiles cannot be had.
    #[error(
        "the map around {x_m}, {y_m}, {z_m} m is spilled, and could not be read: a tile is unreadable, or max_map_blocks leaves no \
         room for the tiles within distance_max_m"
    )]
    Spilled {
        /// The place, along x.
        x_m: f64,
        /// Along y.
        y_m: f64,
        /// Along z.
        z_m: f64,
    },
}

/// Whether all places are numbers.
pub(crate) fn check_finite(places_m: &[Point3<f64>]) -> Result<(), DistanceError> {
    let is_finite = |place: &Point3<f64>| place.iter().all(|along| along.is_finite());
    match places_m.iter().enumerate().find(|(_, place)| !is_finite(place)) {
        None => Ok(()),
        Some((index, place)) => {
            let [x_m, y_m, z_m] = place.coords.into();
            Err(DistanceError::NotFinite { index, x_m, y_m, z_m })
        }
    }
}
