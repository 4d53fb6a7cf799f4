//! The error of the position of an object.

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::figures::Sighting;

/// Errors of a position over the cycles of a run in which the object is in view.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct PositionErrors {
    pub(crate) mean_m: f64,
    pub(crate) rmse_m: f64,
    pub(crate) max_m: f64,
    /// The share of the cycles with the object in view that have a position.
    pub(crate) given_share: f64,
}

/// The kind of error.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Along {
    /// Along x: the depth, if the platform is at rest (Rec-HV 4.9).
    Depth,
    /// In the horizontal plane.
    Plane,
}

/// The kind of position.
pub(crate) type PositionOf = fn(&Sighting) -> Option<Point3<f64>>;

/// The mean of the points classified as dynamic.
pub(crate) const MEAN_OF_POINTS: PositionOf = |sighting| sighting.mean_of_points_m;
/// The nearest track.
pub(crate) const TRACK: PositionOf = |sighting| sighting.track_m;

impl PositionErrors {
    /// The errors over `sightings`; `None` when the object is never in view, or never has a position.
    pub(crate) fn of(
        sightings: &[Sighting],
        position_of: PositionOf,
        along: Along,
    ) -> Option<Self> {
        let in_view: Vec<_> = sightings.iter().filter(|sighting| sighting.in_camera).collect();
        let errors_m: Vec<f64> = in_view
            .iter()
            .filter_map(|sighting| {
                Some(along.length_m(&(position_of(sighting)? - sighting.true_m)))
            })
            .collect();
        let count = errors_m.len() as f64;
        (!errors_m.is_empty()).then(|| Self {
            mean_m: errors_m.iter().sum::<f64>() / count,
            rmse_m: (errors_m.iter().map(|error| error * error).sum::<f64>() / count).sqrt(),
            max_m: errors_m.iter().copied().fold(0.0, f64::max),
            given_share: count / in_view.len() as f64,
        })
    }
}

impl Along {
    fn length_m(self, error_m: &Vector3<f64>) -> f64 {
        match self {
            Self::Depth => error_m.x.abs(),
            Self::Plane => error_m.xy().norm(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::figures::tests::sighting;
    use super::*;

    fn at(x_m: f64, y_m: f64) -> Sighting {
        let true_m = Point3::new(2.0, 1.0, 0.0);
        Sighting { true_m, mean_of_points_m: Some(Point3::new(x_m, y_m, 9.0)), ..sighting(0) }
    }

    #[test]
    fn errors_by_hand() {
        let sightings = [at(2.03, 1.04), at(1.99, 1.0)];
        let depth = PositionErrors::of(&sightings, MEAN_OF_POINTS, Along::Depth).unwrap();
        assert!((depth.mean_m - 0.02).abs() < 1e-12 && (depth.max_m - 0.03).abs() < 1e-12);
        assert!((depth.rmse_m - (0.0005_f64).sqrt()).abs() < 1e-12);
        let plane = PositionErrors::of(&sightings, MEAN_OF_POINTS, Along::Plane).unwrap();
        assert!((plane.max_m - 0.05).abs() < 1e-12, "heights do not count: {plane:?}");
    }

    #[test]
    fn cycles_without_a_position_are_told_and_those_out_of_view_do_not_count() {
        let none = Sighting { mean_of_points_m: None, ..at(0.0, 0.0) };
        let out_of_view = Sighting { in_camera: false, ..at(5.0, 5.0) };
        let sightings = [at(2.0, 1.0), none, out_of_view];
        let errors = PositionErrors::of(&sightings, MEAN_OF_POINTS, Along::Plane).unwrap();
        assert_eq!((errors.mean_m, errors.given_share), (0.0, 0.5));
        assert_eq!(PositionErrors::of(&[none], MEAN_OF_POINTS, Along::Depth), None);
        assert_eq!(PositionErrors::of(&sightings, TRACK, Along::Depth), None);
    }
}
