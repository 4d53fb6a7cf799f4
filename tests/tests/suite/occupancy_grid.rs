//! The occupancy grid of a run: against the true floor plan, and as a foreign reader loads it.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::program::{stillmap, succeed};
use crate::python::python_with;

/// A scene with a person who crosses it, run with a grid; returns the score.
fn scored(scene: &str, source: &str, folder: &Path) -> Value {
    let (bag, out) = (folder.join("room.mcap"), folder.join(source));
    let (bag, out) = (bag.to_str().unwrap(), out.to_str().unwrap());
    if !Path::new(bag).exists() {
        let simulated = ["--scene", scene, "--object", "person", "--depth-size", "320", "240"];
        succeed(["simulate", "-o", bag].into_iter().chain(simulated));
    }
    succeed(["run", bag, "--grid", source, "--out", out]);
    let grid = format!("{out}/grid.yaml");
    let mut eval = vec!["eval", "grid", &grid, "--scene", scene, "--json"];
    eval.extend((source == "scan").then_some("--scan"));
    serde_json::from_str(&succeed(eval)).unwrap()
}

#[test]
fn a_grid_is_right_and_has_no_phantom_of_the_person() {
    let folder = tempfile::tempdir().unwrap();
    for source in ["height_band", "scan"] {
        let score = scored("A", source, folder.path());
        let number = |name: &str| score[name].as_f64().unwrap();
        assert!(number("right_to_a_cell") >= 0.999, "{source}: {score}");
        assert!(number("right") >= 0.99 && number("phantoms") == 0.0, "{source}: {score}");
        assert!(number("free") > 1500.0 && number("occupied") > 50.0, "{source}: {score}");
    }
}

#[test]
fn a_foreign_reader_loads_the_map_as_it_is() {
    let Some(python) = python_with("pillow") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // A floor with a wall along its border of greatest x, and a post at (0.5, 1.5) m.
    let at = |cell: i32| cell as f32 * 0.02 + 0.01;
    let lattice = || (0..100).flat_map(|a| (0..100).map(move |b| (a, b)));
    let floor = lattice().map(|(x, y)| nalgebra::Point3::new(at(x), at(y), -0.8));
    let wall = lattice().map(|(y, z)| nalgebra::Point3::new(2.01, at(y), at(z) - 0.8));
    let post = (0..50).map(|z| nalgebra::Point3::new(0.52, 1.52, at(z) - 0.8));
    let points: Vec<_> = floor.chain(wall).chain(post).collect();
    std::fs::write(path("house.ply"), geometry::ply::encode(&points)).unwrap();
    succeed(["export", &path("house.ply"), "-o", &path("house.yaml")]);
    let loaded = Command::new(python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/peers/map_server/load.py"))
        .arg(path("house.yaml"))
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&loaded.stderr);
    assert!(loaded.status.success(), "{stderr}");
    let map: Value = serde_json::from_slice(&loaded.stdout).unwrap();
    assert_eq!(
        (map["resolution"].as_f64(), map["counts"]["occupied"].as_u64()),
        (Some(0.05), Some(41))
    );
    assert_eq!(map["counts"]["free"].as_u64(), Some(40 * 40 - 1));
    let origin = |axis: usize| map["origin"][axis].as_f64().unwrap();
    let cell = |x_m: f64, y_m: f64| {
        let along = |m: f64, axis: usize| ((m - origin(axis)) / 0.05).floor();
        map["cells"][format!("{} {}", along(x_m, 0), along(y_m, 1))].as_str().map(str::to_owned)
    };
    assert_eq!(cell(0.52, 1.52).as_deref(), Some("occupied"));
    assert_eq!(cell(1.52, 0.52).as_deref(), Some("free"));
    assert_eq!((cell(2.02, 0.3).as_deref(), cell(2.3, 0.3)), (Some("occupied"), None));
}

#[test]
fn a_grid_that_cannot_be_made_is_said_and_the_other_results_are_there() {
    let folder = tempfile::tempdir().unwrap();
    let (bag, out) = (folder.path().join("room.mcap"), folder.path().join("out"));
    let (bag, out) = (bag.to_str().unwrap(), out.to_str().unwrap());
    // Too short for a floor to be found in: one cycle at most.
    let small = ["--scene", "H", "--seconds", "1.5", "--depth-size", "160", "120"];
    succeed(["simulate", "-o", bag].into_iter().chain(small));
    // One of an earlier run does not stay.
    std::fs::create_dir(out).unwrap();
    std::fs::write(Path::new(out).join("grid.yaml"), "image: grid.pgm").unwrap();
    let output = stillmap(["run", bag, "--grid", "height_band", "--overwrite", "--out", out]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("there is no grid") && stderr.contains("grid_floor"), "{stderr}");
    assert_eq!(output.status.code(), Some(3));
    assert!(Path::new(out).join("map.ply").exists());
    assert!(!Path::new(out).join("grid.yaml").exists());
}
