//! Textured panels in a zig-zag.

use crate::odometry::rooms::scene;
use crate::scenes::{boarded, sheet, with_pictures};
use crate::{Body, Lamp, Lighting, Material, Scene};

/// Eight panels, 1.3 m from the camera's path, facing alternately to one side and to the other; a floor of boards.
pub(super) fn zig_zag() -> Scene {
    const WIDTH_M: f64 = 1.0;
    const TURN_RAD: f64 = 0.7;
    const X_M: f64 = 1.3;
    let material = with_pictures(Material::CARD);
    let spacing_m = WIDTH_M * TURN_RAD.cos();
    let mut bodies: Vec<Body> = (0..8)
        .map(|panel: u8| {
            let turn_rad = if panel.is_multiple_of(2) { TURN_RAD } else { -TURN_RAD };
            let place = [X_M, (f64::from(panel) - 3.5) * spacing_m];
            sheet("panel", place, turn_rad, (0.0, 2.4), WIDTH_M, material)
        })
        .collect();
    let (min_m, max_m) = ([-2.0, -4.5, -0.1], [4.0, 4.5, 0.0]);
    bodies.push(Body::cuboid("floor", min_m, max_m, boarded(Material::WOOD)));
    let lamps = [[-0.5, -2.0, 2.8], [-0.5, 2.0, 2.8]]
        .map(|position_m| Lamp { position_m, brightness: 1.6 });
    scene(bodies, Lighting::of_lamps(0.4, lamps.to_vec()))
}
