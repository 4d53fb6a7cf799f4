//! The plane that a path is drawn in.

use nalgebra::Vector3;
use serde::Serialize;

/// Two axes of the frame of the reference.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Plane {
    /// From above, in frames with z up.
    Xy,
    /// From above, in frames of a camera that looks ahead.
    Xz,
    /// From the front.
    Yz,
}

impl Plane {
    /// The plane without the axis of the least extent of the positions.
    #[must_use]
    pub fn of_largest_extent(places_m: &[Vector3<f64>]) -> Self {
        let extent_m = |axis: usize| {
            let (low, high) =
                places_m.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |range, place_m| {
                    (range.0.min(place_m[axis]), range.1.max(place_m[axis]))
                });
            high - low
        };
        let [x, y, z] = [0, 1, 2].map(extent_m);
        if z <= x && z <= y {
            Self::Xy
        } else if y <= x {
            Self::Xz
        } else {
            Self::Yz
        }
    }

    /// The names of its axes, to the right and upwards.
    #[must_use]
    pub fn axis_names(self) -> [&'static str; 2] {
        match self {
            Self::Xy => ["x", "y"],
            Self::Xz => ["x", "z"],
            Self::Yz => ["y", "z"],
        }
    }

    /// The coordinates of a position in it.
    pub(super) fn project(self, place_m: &Vector3<f64>) -> (f64, f64) {
        match self {
            Self::Xy => (place_m.x, place_m.y),
            Self::Xz => (place_m.x, place_m.z),
            Self::Yz => (place_m.y, place_m.z),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_extent_is_looked_along() {
        let plane = |x, y, z| Plane::of_largest_extent(&[Vector3::zeros(), Vector3::new(x, y, z)]);
        assert_eq!(plane(5.0, 4.0, 1.0), Plane::Xy);
        assert_eq!(plane(5.0, 1.0, 4.0), Plane::Xz);
        assert_eq!(plane(1.0, 3.0, 4.0), Plane::Yz);
        assert_eq!(plane(0.0, 0.0, 0.0), Plane::Xy);
    }
}
