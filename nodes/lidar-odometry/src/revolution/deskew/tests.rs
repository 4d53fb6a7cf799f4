use geometry::Stamp;
use nalgebra::{Isometry3, Vector3};

use super::*;

/// The walls of a room, as planes `normal . p = distance_m` around a point within.
const WALLS: [([f64; 3], f64); 6] = [
    ([1.0, 0.0, 0.0], 30.0),
    ([-1.0, 0.0, 0.0], 25.0),
    ([0.0, 1.0, 0.0], 12.0),
    ([0.0, -1.0, 0.0], 18.0),
    ([0.0, 0.0, 1.0], 9.0),
    ([0.0, 0.0, -1.0], 1.7),
];

fn fast_car_in_a_bend() -> Twist {
    Twist {
        linear_m_per_s: Vector3::new(25.0, 0.3, -0.2),
        angular_rad_per_s: Vector3::new(0.1, -0.15, 0.9),
    }
}

/// A sweep of an HDL-64E in that room, from a scanner that moves; a tenth of the shots returns nothing.
fn swept(twist: &Twist) -> Revolution {
    let elevations_rad: Vec<f32> = (0..64).map(|row| 0.03 - 0.007 * row as f32).collect();
    let columns = 500;
    let turn_s = 0.1;
    let azimuth_rad = |column: usize| {
        std::f64::consts::PI - std::f64::consts::TAU * column as f64 / columns as f64
    };
    let azimuths_rad = (0..columns).map(|column| azimuth_rad(column) as f32).collect();
    let mut returns = Vec::new();
    for (row, elevation_rad) in elevations_rad.iter().enumerate() {
        for column in 0..columns {
            // Within a column the lasers follow each other.
            let time_s = turn_s * column as f64 / columns as f64 + 0.75e-6 * row as f64;
            let start_from_scanner = twist.displacement(time_s);
            let (sin, cos) = f64::from(*elevation_rad).sin_cos();
            let (sin_azimuth, cos_azimuth) = azimuth_rad(column).sin_cos();
            let direction = Vector3::new(cos * cos_azimuth, cos * sin_azimuth, sin);
            let range_m = range_to_walls_m(&start_from_scanner, &direction);
            returns.push((!(row + column).is_multiple_of(10)).then(|| LidarReturn {
                position_m: Point3::from((direction * range_m).cast::<f32>()),
                intensity: row as f32,
                time_s: time_s as f32,
            }));
        }
    }
    Revolution::new(Stamp::default(), "velodyne".to_owned(), elevations_rad, azimuths_rad, returns)
        .unwrap()
}

fn range_to_walls_m(start_from_scanner: &Isometry3<f64>, direction: &Vector3<f64>) -> f64 {
    let origin_m = start_from_scanner.translation.vector;
    let direction = start_from_scanner.rotation * direction;
    let ranges_m = WALLS.iter().map(|(normal, distance_m)| {
        let normal = Vector3::from(*normal);
        (distance_m - normal.dot(&origin_m)) / normal.dot(&direction)
    });
    ranges_m.filter(|range_m| *range_m > 0.0).fold(f64::INFINITY, f64::min)
}

/// How far the points are from the walls, seen from where the scanner was at `reference_s`.
fn worst_m(revolution: &Revolution, start_from_reference: &Isometry3<f64>) -> f64 {
    let off_m = |found: &LidarReturn| {
        let point_m = start_from_reference * found.position_m.cast::<f64>();
        let distances_m = WALLS.iter().map(|(normal, distance_m)| {
            (Vector3::from(*normal).dot(&point_m.coords) - distance_m).abs()
        });
        distances_m.fold(f64::INFINITY, f64::min)
    };
    revolution.measured().map(off_m).fold(0.0, f64::max)
}

#[test]
fn every_point_lies_on_its_wall_again_whatever_the_moment() {
    let twist = fast_car_in_a_bend();
    let sweep = swept(&twist);
    // The skew is large: 2.5 m of translation, 5 degrees of rotation.
    assert!(worst_m(&sweep, &Isometry3::identity()) > 1.0);
    for reference_s in [0.0, 0.05, 0.1] {
        let still = deskewed(&sweep, &twist, reference_s);
        assert_eq!(still.measured().count(), sweep.measured().count());
        let worst_m = worst_m(&still, &twist.displacement(reference_s));
        // Coordinates of up to 30 m are rounded to 2 um.
        assert!(worst_m < 2e-5, "{worst_m}");
    }
}

#[test]
fn columns_at_once_are_points_one_by_one() {
    let twist = fast_car_in_a_bend();
    let sweep = swept(&twist);
    let reference_s = 0.04;
    let by_columns = deskewed(&sweep, &twist, reference_s);
    for (before, after) in sweep.measured().zip(by_columns.measured()) {
        let motion = twist.displacement(f64::from(before.time_s) - reference_s);
        let expected_m = motion * before.position_m.cast::<f64>();
        assert!((expected_m - after.position_m.cast::<f64>()).norm() < 1e-5);
        assert_eq!((before.intensity, before.time_s), (after.intensity, after.time_s));
    }
}

#[test]
fn a_scanner_that_stands_changes_nothing() {
    let sweep = swept(&Twist::default());
    assert_eq!(deskewed(&sweep, &Twist::default(), 0.05), sweep);
}

#[test]
fn a_velocity_that_is_no_number_leaves_no_points() {
    let twist = Twist { linear_m_per_s: Vector3::new(f64::NAN, 0.0, 0.0), ..Twist::default() };
    assert_eq!(deskewed(&swept(&Twist::default()), &twist, 0.0).measured().count(), 0);
}
