//! A robot that drives behind a person: the person goes, what both pass by stays.

use crate::program::{succeed, summary};

/// A sixteenth of the pixels, for a quick test.
const SMALL_CAMERA: &str = "  depth_camera:\n    camera: {width_px: 160, height_px: 120, fx_px: 144.0, fy_px: 144.0, cx_px: \
                            79.5, cy_px: 59.5, distortion: None}\n    rate_hz: 15.0\n";
const CORRIDOR: &str =
    include_str!("../../../nodes/laboratory/simulator/scenes/following/corridor.yaml");

/// Regression: the beam between the legs met the end of the corridor, the zone reached to it, and the walls became a part of
/// the person: 4 % of the static points were removed, 15 % with all pixels.
#[test]
fn the_walls_beside_a_person_who_is_followed_stay() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scene, bag, out) = (path("corridor.yaml"), path("corridor.mcap"), path("out"));
    std::fs::write(&scene, format!("{CORRIDOR}{SMALL_CAMERA}")).unwrap();
    succeed(["simulate", &scene, "-o", &bag]);
    succeed(["run", &bag, "--no-timing", "--out", &out]);
    let truth = &summary(out.as_ref())["truth"];
    let share = |of: &str| truth[of]["share"].as_f64().unwrap();
    let (removed, lost) = (share("object_points"), share("static_points"));
    // In the first five cycles nothing shows that he moves; what they left in the map is retracted then.
    let left = truth["map"]["object_only_left"].as_u64().unwrap();
    assert!(left <= 20, "{left} voxels of the person are left in the map");
    assert!(removed > 0.9, "{removed} of the person's points are removed");
    assert!(lost < 0.01, "{lost} of the static points are removed");
}
