//! Two saved maps become one, by the program.

use std::path::Path;

use geometry::ply;
use nalgebra::{Isometry3, Point3, Vector3};
use serde_json::Value;

use crate::program::{stillmap, succeed};

/// Points 4 cm apart on rectangles, each a corner and two sides.
fn points(faces: &[[[f64; 3]; 3]]) -> Vec<Point3<f64>> {
    let of_face = |[corner_m, first_m, second_m]: &[[f64; 3]; 3]| {
        let (corner_m, sides_m) =
            (Point3::from(*corner_m), [*first_m, *second_m].map(Vector3::from));
        let steps = sides_m.map(|side_m| (side_m.norm() / 0.04).round() as u32);
        let along = |step: u32, steps: u32| (f64::from(step) + 0.5) / f64::from(steps);
        let lattice = (0..steps[0]).flat_map(|a| (0..steps[1]).map(move |b| (a, b)));
        let place =
            |(a, b)| corner_m + sides_m[0] * along(a, steps[0]) + sides_m[1] * along(b, steps[1]);
        lattice.map(place).collect::<Vec<_>>()
    };
    faces.iter().flat_map(of_face).collect()
}

/// A room of 6 m by 4 m, open to a niche, with a cupboard at a place along the wall.
fn room(cupboard_m: f64) -> Vec<Point3<f64>> {
    let (up, high) = ([0.0, 0.0, 2.4], [0.0, 0.0, 1.2]);
    points(&[
        [[0.0; 3], [6.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
        [[0.0; 3], [6.0, 0.0, 0.0], up],
        [[0.0; 3], [0.0, 4.0, 0.0], up],
        [[6.0, 0.0, 0.0], [0.0, 2.5, 0.0], up],
        [[6.0, 2.5, 0.0], [1.2, 0.0, 0.0], up],
        [[0.0, 4.0, 0.0], [7.2, 0.0, 0.0], up],
        [[cupboard_m, 0.5, 0.0], [0.8, 0.0, 0.0], high],
        [[cupboard_m, 0.0, 0.0], [0.0, 0.5, 0.0], high],
        [[cupboard_m + 0.8, 0.0, 0.0], [0.0, 0.5, 0.0], high],
    ])
}

fn second_from_first() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(5.0, -3.0, 1.0), Vector3::z() * 1.3)
}

/// Two maps of the room, as of two days: `monday.ply`, and `tuesday.ply` from another origin and with the cupboard elsewhere.
pub(crate) fn write_two_days(folder: &Path) {
    let days =
        [("monday.ply", 1.0, Isometry3::identity()), ("tuesday.ply", 3.6, second_from_first())];
    for (name, cupboard_m, pose) in days {
        let points = room(cupboard_m).into_iter().map(|point| (pose * point).cast());
        std::fs::write(folder.join(name), ply::encode(&points.collect::<Vec<_>>())).unwrap();
    }
}

#[test]
fn two_maps_of_a_room_become_one_and_another_room_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let write = |name: &str, points: &[Point3<f64>], pose: &Isometry3<f64>| {
        let points_m: Vec<Point3<f32>> = points.iter().map(|point| (pose * point).cast()).collect();
        std::fs::write(path(name), ply::encode(&points_m)).unwrap();
    };
    write_two_days(folder.path());
    let there = second_from_first();
    let hall = points(&[
        [[0.0; 3], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]],
        [[0.0; 3], [9.0, 0.0, 0.0], [0.0, 0.0, 3.0]],
        [[0.0; 3], [0.0, 9.0, 0.0], [0.0, 0.0, 3.0]],
    ]);
    write("hall.ply", &hall, &there);
    let (out, changed) = (path("c.ply"), path("changed.ply"));
    let arguments =
        ["merge", &path("monday.ply"), &path("tuesday.ply"), "-o", &out, "--changes", &changed];
    let report: Value =
        serde_json::from_str(&succeed(arguments.iter().chain(&["--json"]))).unwrap();
    let found = |name: &str| report["second_in_first"][name].as_f64().unwrap();
    let expected = there.inverse();
    for (name, value) in ["x_m", "y_m", "z_m"].into_iter().zip(expected.translation.vector.iter()) {
        assert!((found(name) - value).abs() < 0.03, "{report}");
    }
    assert!((found("yaw_rad") + 1.3).abs() < 0.01, "{report}");
    for name in ["only_in_first", "only_in_second"] {
        assert_eq!(report[name].as_array().unwrap().len(), 1, "{report}");
    }
    assert!(ply::decode(&std::fs::read(&out).unwrap()).unwrap().len() > room(1.0).len());
    assert!(!ply::decode(&std::fs::read(&changed).unwrap()).unwrap().is_empty());
    // What is there stays, and what does not fit is refused.
    let refused = |arguments: &[&str]| {
        let output = stillmap(arguments);
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(refused(&arguments).contains("--overwrite"));
    let other = ["merge", &path("monday.ply"), &path("hall.ply"), "-o", &path("d.ply")];
    let said = refused(&other);
    assert!(said.contains("do not fit") && said.contains("m2"), "{said}");
    assert!(!folder.path().join("d.ply").exists());
}
