//! The images of a colour camera, black where something moves.

use std::collections::BTreeMap;
use std::path::Path;

use msgs::builtin_interfaces::Time;
use msgs::convert;
use msgs::sensor_msgs::Image;
use serde_json::Value;

use super::{DEPTH, SCAN, Shares, filtered, messages, of};
use crate::bags::small_room;
use crate::coloured_map::coloured_room;
use crate::program::{stillmap, succeed};

const COLOUR: &str = "/camera/rgb/image_raw";

/// Which pixels of the images of a bag show an object, by their stamps.
fn labels(bag: &Path) -> BTreeMap<Time, Vec<bool>> {
    let labels = of::<Image>(&messages(bag), "/truth/labels").into_iter().map(|message| {
        let labels = convert::labels_from_message(&message).unwrap();
        (message.header.stamp, labels.object_ids().iter().map(|id| *id > 0).collect())
    });
    labels.collect()
}

/// How much of the colour images is black: of all pixels, with a depth or without. All else of the bag is as it was.
fn shares(bag: &Path, out: &Path, labels: &BTreeMap<Time, Vec<bool>>) -> Shares {
    let (raw, now) = (messages(bag), messages(out));
    assert_eq!(raw.len(), now.len());
    for (raw, now) in raw.iter().zip(&now) {
        assert_eq!((&raw.topic, raw.log_time), (&now.topic, now.log_time));
        let is_filtered = [SCAN, DEPTH, COLOUR].iter().any(|topic| raw.is_on(topic));
        assert!(is_filtered || raw.data == now.data, "{} is not as it was", raw.topic);
    }
    let mut pixels = Shares::default();
    for (raw, now) in of::<Image>(&raw, COLOUR).iter().zip(of::<Image>(&now, COLOUR)) {
        assert_eq!(Image { data: raw.data.clone(), ..now.clone() }, *raw);
        let Some(labels) = labels.get(&raw.header.stamp) else { continue };
        for (pixel, (raw, now)) in raw.data.chunks(3).zip(now.data.chunks(3)).enumerate() {
            assert!(raw == now || now == [0; 3]);
            pixels.add(labels[pixel], now == [0; 3] && raw != [0; 3]);
        }
    }
    pixels
}

#[test]
fn registered_images_are_black_where_something_moves_and_as_they_were_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let bag = coloured_room(folder.path());
    let (out, printed) = filtered(&bag, &["--colour"]);
    let pixels = shares(&bag, &out, &labels(&bag));
    println!("{printed}\n{pixels:?}: {:.4} gone, {:.5} kept", pixels.gone(), pixels.kept());
    // Of these small images the margin is 0.6 %.
    assert!(pixels.gone() > 0.98 && pixels.kept() > 0.99, "{pixels:?}");
    assert_eq!(printed["colours"]["messages"], of::<Image>(&messages(&bag), COLOUR).len());
    assert_eq!(printed["not_filtered"], Value::Array(Vec::new()));
    // Everything else is what it is without the option.
    let without = folder.path().join("without.mcap");
    succeed(["filter", bag.to_str().unwrap(), "-o", without.to_str().unwrap()]);
    for (with, without) in messages(&out).iter().zip(messages(&without)) {
        assert!(with.is_on(COLOUR) || with.data == without.data, "{} differs", with.topic);
    }
}

/// A person walks before a wall. The colour camera is 5 cm beside the depth camera, finer, and takes its images 16 ms later.
const SCENE: &str = "
name: parallax
duration_s: 6.0
scene:
  bodies:
    - {name: floor, shape: {box: {size_m: [6.0, 8.0, 0.1]}}, pose: [2.5, 0, -0.05, 0, 0, 0], material: &plaster {reflectivity: 0.8, max_incidence_rad: 1.396}}
    - {name: wall, shape: {rectangle: {size_m: [2.6, 8.0]}}, pose: [4.5, 0, 1.3, 0, 1.5707963, 0], material: *plaster}
    - {name: right, shape: {rectangle: {size_m: [6.0, 2.6]}}, pose: [2.5, -3.5, 1.3, 0, 0, 1.5707963], material: *plaster}
    - {name: left, shape: {rectangle: {size_m: [6.0, 2.6]}}, pose: [2.5, 3.5, 1.3, 0, 0, 1.5707963], material: *plaster}
  objects:
    - id: 1
      name: person
      figure: {walker: {height_m: 1.8, stride_m: 1.45, gait_phase_rad: 0.5}}
      path: {spline: {start_s: 1.0, through_m: [[2.2, 3.0], [2.8, 1.0], [2.2, -0.8], [2.6, -3.0]], speed_m_per_s: 1.2}}
rig:
  path: {waypoints: [{time_s: 0.0, pose: [0.3, 0, 1.2, 0, 0, 0]}]}
";
const DEPTH_CAMERA: &str = "
  depth_camera:
    camera: {width_px: 160, height_px: 120, fx_px: 144.0, fy_px: 144.0, cx_px: 79.5, cy_px: 59.5, distortion: None}
  colour_camera:
    rig_from_camera: [0, -0.05, 0, -1.5707963267948966, 0, -1.5707963267948966]
    delay_s: 0.016
    camera: {width_px: 240, height_px: 180, fx_px: 216.0, fy_px: 216.0, cx_px: 119.5, cy_px: 89.5, distortion: None}
";
/// A depth camera in the colour camera's place: its labels are those of the colour images.
const COLOUR_CAMERA: &str = "
  depth_camera:
    rig_from_camera: [0, -0.05, 0, -1.5707963267948966, 0, -1.5707963267948966]
    first_image_s: 0.032666666666666667
    camera: {width_px: 240, height_px: 180, fx_px: 216.0, fy_px: 216.0, cx_px: 119.5, cy_px: 89.5, distortion: None}
";

#[test]
fn a_colour_camera_beside_the_depth_camera_and_later_is_masked_where_it_sees_who_moves() {
    let folder = tempfile::tempdir().unwrap();
    let simulated = |name: &str, cameras: &str| {
        let scene = folder.path().join(format!("{name}.yaml"));
        std::fs::write(&scene, format!("{SCENE}{}", cameras.trim_start_matches('\n'))).unwrap();
        let bag = folder.path().join(format!("{name}.mcap"));
        let scene = scene.to_str().unwrap();
        succeed(["simulate", "--file", scene, "-o", bag.to_str().unwrap()]);
        bag
    };
    let (bag, truth) = (simulated("seen", DEPTH_CAMERA), simulated("truth", COLOUR_CAMERA));
    let place = folder.path().join("place.yaml");
    let parameter = "colour_from_depth: [-0.05, 0.0, 0.0, 0.0, 0.0, 0.0]";
    std::fs::write(&place, format!("detection: {{ros__parameters: {{{parameter}}}}}")).unwrap();
    let (out, printed) = filtered(&bag, &["--colour", "--params-file", place.to_str().unwrap()]);
    let labels = labels(&truth);
    let pixels = shares(&bag, &out, &labels);
    println!("{printed}\n{pixels:?}: {:.4} gone, {:.5} kept", pixels.gone(), pixels.kept());
    assert!(pixels.moving > 100_000, "{pixels:?}");
    assert!(pixels.gone() > 0.98 && pixels.kept() > 0.98, "{pixels:?}");
    // Without its place the mask is beside who moves.
    let (out, _) = filtered(&bag, &["--colour", "--overwrite"]);
    let beside = shares(&bag, &out, &labels);
    println!("{beside:?}");
    assert!(1.0 - beside.gone() > 2.0 * (1.0 - pixels.gone()), "{beside:?}");
}

#[test]
fn a_bag_whose_colours_cannot_be_masked_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let out = folder.path().join("out.mcap");
    let refused =
        stillmap(["filter", bag.to_str().unwrap(), "-o", out.to_str().unwrap(), "--colour"]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(1) && said.contains("colour"), "{said}");
    assert!(!out.exists());
}
