//! Scenes of the simulator, each with its truth: who moves goes, what stays is kept.

use serde_json::Value;

use crate::program::{succeed, summary};

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../nodes/laboratory/simulator/scenes");

/// What a run of a scene gives against its truth.
struct Found {
    /// The share of the points of what moves that is removed.
    removed: f64,
    /// The share of the static points that is removed.
    lost: f64,
    /// Voxels of what moves that are left in the map.
    left: u64,
}

/// Simulates a scene of this name with small images, and runs its bag.
fn found_in(scene: &str, small: &[&str]) -> Found {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scene, parameters) =
        (format!("{SCENES}/{scene}.yaml"), format!("{SCENES}/{scene}.params.yaml"));
    let (bag, out) = (path("scene.mcap"), path("out"));
    succeed([&["simulate", &scene, "-o", &bag], small].concat());
    let mut run = vec!["run", &bag, "--no-timing", "--out", &out];
    if std::path::Path::new(&parameters).is_file() {
        run.extend(["--params-file", &parameters]);
    }
    succeed(run);
    let truth: &Value = &summary(out.as_ref())["truth"];
    let share = |of: &str| truth[of]["share"].as_f64().unwrap();
    Found {
        removed: share("object_points"),
        lost: share("static_points"),
        left: truth["map"]["object_only_left"].as_u64().unwrap(),
    }
}

/// Regression: the beam between the legs met the end of the corridor, the zone reached to it, and the walls became a part of
/// the person: 4 % of the static points were removed, 15 % with all pixels.
#[test]
fn the_walls_beside_a_person_who_is_followed_stay() {
    let small = ["--depth-size", "160", "120"];
    let Found { removed, lost, left } = found_in("following/corridor", &small);
    // In the first five cycles nothing shows that he moves; what they left in the map is retracted then.
    assert!(left <= 20, "{left} voxels of the person are left in the map");
    assert!(removed > 0.9, "{removed} of the person's points are removed");
    assert!(lost < 0.01, "{lost} of the static points are removed");
}

/// Regression: half of the scans of a robot with six images a second were dropped.
#[test]
fn what_moves_goes_whatever_the_sensors_are() {
    for name in ["images-6-hz", "perfect", "scanner-upside-down", "camera-pitched", "no-laser"] {
        let small = ["--depth-size", "80", "60", "--seconds", "9"];
        let Found { removed, lost, left } = found_in(&format!("sensors/{name}"), &small);
        println!("{name}: {removed} removed, {lost} lost, {left} left");
        assert!(left <= 40, "{name}: {left} voxels of the persons are left in the map");
        assert!(removed > 0.85, "{name}: {removed} of the persons' points are removed");
        assert!(lost < 0.003, "{name}: {lost} of the static points are removed");
    }
}
