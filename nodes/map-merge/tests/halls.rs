//! Halls whose columns repeat: which place of a map is meant cannot be told where it has nothing besides, and is not guessed.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop where it stands")]

use std::f64::consts::FRAC_PI_2;

use estimation::Serial;
use geometry::{CameraModel, Distortion, MapView, OrientedPoints, Stamp, pose_from_vector};
use map_merge::{Merge, MergeError, SavedMap, merge};
use nalgebra::{Point3, Vector3};

const EDGE_M: f64 = 0.08;
const HEIGHT_M: f64 = 2.4;
/// Of a column, which is square.
const COLUMN_M: f64 = 0.4;

/// A hall along x with a row of columns in its middle, all alike.
#[derive(Clone, Copy)]
struct Hall {
    width_m: f64,
    pitch_m: f64,
    /// The part that a visit has seen.
    from_m: f64,
    to_m: f64,
    /// Whether it ends there with walls.
    ends: [bool; 2],
    /// Whether a store room of 2.2 m by 1.6 m is built into it, 1 m from the origin.
    has_store: bool,
}

const HALL: Hall = Hall {
    width_m: 7.0,
    pitch_m: 3.0,
    from_m: 0.0,
    to_m: 15.0,
    ends: [true, true],
    has_store: true,
};

/// Points on a rectangle, a corner and two sides; the normal is the product of the sides.
fn add_face(points: &mut OrientedPoints, corner_m: [f64; 3], sides_m: [[f64; 3]; 2]) {
    let (corner_m, sides_m) = (Point3::from(corner_m), sides_m.map(Vector3::from));
    let normal = sides_m[0].cross(&sides_m[1]).normalize();
    let steps = sides_m.map(|side_m| (side_m.norm() / EDGE_M).round().max(1.0) as u32);
    let along = |step: u32, steps: u32| (f64::from(step) + 0.5) / f64::from(steps);
    for (a, b) in (0..steps[0]).flat_map(|a| (0..steps[1]).map(move |b| (a, b))) {
        let place_m = corner_m + sides_m[0] * along(a, steps[0]) + sides_m[1] * along(b, steps[1]);
        points.points_m.push(place_m.cast());
        points.normals.push(normal.cast());
    }
}

impl Hall {
    fn map(&self) -> SavedMap {
        let Self { width_m, pitch_m, from_m, to_m, ends, has_store } = *self;
        let (length_m, up) = (to_m - from_m, [0.0, 0.0, HEIGHT_M]);
        let mut points = OrientedPoints::default();
        add_face(&mut points, [from_m, 0.0, 0.0], [[length_m, 0.0, 0.0], [0.0, width_m, 0.0]]);
        add_face(&mut points, [from_m, 0.0, 0.0], [up, [length_m, 0.0, 0.0]]);
        add_face(&mut points, [from_m, width_m, 0.0], [[length_m, 0.0, 0.0], up]);
        if ends[0] {
            add_face(&mut points, [from_m, 0.0, 0.0], [[0.0, width_m, 0.0], up]);
        }
        if ends[1] {
            add_face(&mut points, [to_m, 0.0, 0.0], [up, [0.0, width_m, 0.0]]);
        }
        if has_store {
            add_face(&mut points, [1.0, 1.6, 0.0], [up, [2.2, 0.0, 0.0]]);
            add_face(&mut points, [1.0, 0.0, 0.0], [up, [0.0, 1.6, 0.0]]);
            add_face(&mut points, [3.2, 0.0, 0.0], [[0.0, 1.6, 0.0], up]);
        }
        let first = (from_m / pitch_m).ceil() as i32;
        let middles = (first..).map(|column| (f64::from(column) + 0.5) * pitch_m);
        for x_m in middles.take_while(|x_m| *x_m < to_m) {
            let (x_m, y_m) = (x_m - COLUMN_M / 2.0, width_m / 2.0 - COLUMN_M / 2.0);
            let (along, across) = ([COLUMN_M, 0.0, 0.0], [0.0, COLUMN_M, 0.0]);
            add_face(&mut points, [x_m, y_m, 0.0], [along, up]);
            add_face(&mut points, [x_m, y_m + COLUMN_M, 0.0], [up, along]);
            add_face(&mut points, [x_m, y_m, 0.0], [up, across]);
            add_face(&mut points, [x_m + COLUMN_M, y_m, 0.0], [across, up]);
        }
        SavedMap { points, views: self.views(), edge_m: EDGE_M }
    }

    /// A camera that goes along both sides of the columns and looks around.
    fn views(&self) -> Vec<MapView> {
        let (width_px, height_px, fx_px, fy_px) = (80, 60, 57.0, 57.0);
        let (cx_px, cy_px, distortion) = (39.5, 29.5, Distortion::None);
        let camera = CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion };
        let rig_from_camera = pose_from_vector(&[0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2]);
        let steps = (self.to_m - self.from_m) as u32;
        let mut views = Vec::new();
        for step in 0..steps {
            for (side, turn) in (0..2).flat_map(|side| (0..4).map(move |turn| (side, turn))) {
                let x_m = self.from_m + f64::from(step) + 0.5;
                let y_m = self.width_m * (0.2 + 0.6 * f64::from(side));
                let place = [x_m, y_m, 1.2, 0.0, 0.0, f64::from(turn) * FRAC_PI_2];
                let map_from_camera = pose_from_vector(&place) * rig_from_camera;
                views.push(MapView { stamp: Stamp::default(), map_from_camera, camera });
            }
        }
        views
    }
}

fn merged(a: &SavedMap, b: &SavedMap) -> Result<Merge, MergeError> {
    merge(a, b, None, &Serial, &|| false)
}

/// Columns look alike: what has nothing else is not placed by them, and the message says between which places it cannot choose.
#[test]
fn a_part_that_shows_columns_alone_fits_in_several_places() {
    let middle = Hall { from_m: 4.5, to_m: 10.5, ends: [false, false], has_store: false, ..HALL };
    let error = merged(&HALL.map(), &middle.map()).unwrap_err();
    assert!(matches!(error, MergeError::Ambiguous { .. }), "{error}");
    let said = error.to_string();
    assert!(said.starts_with("the maps fit in two places: ") && said.contains(" m and "), "{said}");
}

#[test]
fn a_part_with_an_end_is_placed_and_a_wider_hall_refused() {
    let hall = HALL.map();
    let part = Hall { to_m: 9.0, ends: [true, false], ..HALL };
    let found = merged(&hall, &part.map()).unwrap().alignment.a_from_b;
    let middle_m = Point3::new(5.0, 3.0, 1.0);
    assert!((found * middle_m - middle_m).norm() < 0.03, "{found}");
    let wider = Hall { width_m: 8.0, ..HALL };
    let error = merged(&hall, &wider.map()).unwrap_err();
    assert!(matches!(error, MergeError::NoAgreement { .. }), "{error}");
    assert!(error.to_string().contains("contradict"), "{error}");
}

/// Regression: level surfaces that had gone counted as contradicting, though none counts as agreeing: a canteen whose tables were moved
/// over night was refused.
#[test]
fn tables_that_were_moved_are_no_contradiction() {
    let with_tables_at = |first_m: f64| {
        let mut map = HALL.map();
        for (x, y) in (0..6).flat_map(|x| (0..3).map(move |y| (f64::from(x), f64::from(y)))) {
            let corner_m = [first_m + 1.9 * x, 1.9 + 1.6 * y, 0.75];
            add_face(&mut map.points, corner_m, [[1.0, 0.0, 0.0], [0.0, 0.9, 0.0]]);
        }
        map
    };
    let Merge { alignment, changes, .. } =
        merged(&with_tables_at(3.4), &with_tables_at(4.35)).unwrap();
    let middle_m = Point3::new(5.0, 3.0, 1.0);
    assert!((alignment.a_from_b * middle_m - middle_m).norm() < 0.03, "{}", alignment.a_from_b);
    let agreement = alignment.agreement;
    assert!(agreement.contradicting_m2 < 0.01 * agreement.same_m2, "{agreement:?}");
    assert!(changes.gone.len() > 5, "{} groups", changes.gone.len());
}

/// Regression: what is too small to be a thing was put into the merged map, from either one, and stayed for good: a map that is merged
/// each day had the noise of all days.
#[test]
fn noise_through_which_the_other_map_was_seen_is_left_out() {
    let (clean, mut noisy) = (HALL.map(), HALL.map());
    let count = clean.points.points_m.len();
    for speck in 0..20 {
        // Between columns, with a wall behind.
        let x_m = [5.3, 8.3][speck % 2] + 0.3 * (speck / 4) as f64;
        let corner_m = [x_m, 2.5, [0.8, 1.4][speck / 2 % 2]];
        add_face(&mut noisy.points, corner_m, [[EDGE_M, 0.0, 0.0], [0.0, 0.0, 3.0 * EDGE_M]]);
    }
    assert_eq!(noisy.points.points_m.len(), count + 60);
    for (a, b) in [(&clean, &noisy), (&noisy, &clean)] {
        let found = merged(a, b).unwrap();
        // Of some it is not sure: views say nothing beside an edge.
        let left = found.merged.points.points_m.len() - count;
        assert!(left < 30, "{left} of 60 points");
    }
}
