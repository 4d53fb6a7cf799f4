//! The furniture of the rooms of Table 2.

use std::f64::consts::FRAC_PI_2;

use crate::{Body, Material, Shape};

/// A position on the floor: `[x_m, y_m]`.
pub(crate) type Place = [f64; 2];

/// A cuboid at a height over a position, rotated about z.
pub(crate) fn block(
    name: &str,
    [x_m, y_m]: Place,
    yaw_rad: f64,
    z_m: (f64, f64),
    [depth_m, width_m]: [f64; 2],
    material: Material,
) -> Body {
    Body {
        name: name.to_owned(),
        shape: Shape::Box { size_m: [depth_m, width_m, z_m.1 - z_m.0] },
        pose: [x_m, y_m, f64::midpoint(z_m.0, z_m.1), yaw_rad, 0.0, 0.0],
        material,
    }
}

/// An upright cylinder.
pub(crate) fn post(
    name: &str,
    [x_m, y_m]: Place,
    radius_m: f64,
    z_m: (f64, f64),
    material: Material,
) -> Body {
    Body {
        name: name.to_owned(),
        shape: Shape::Cylinder { radius_m, height_m: z_m.1 - z_m.0 },
        pose: [x_m, y_m, f64::midpoint(z_m.0, z_m.1), 0.0, 0.0, 0.0],
        material,
    }
}

/// An upright pane or sheet, `width_m` wide; with no yaw it faces along x.
pub(crate) fn sheet(
    name: &str,
    [x_m, y_m]: Place,
    yaw_rad: f64,
    z_m: (f64, f64),
    width_m: f64,
    material: Material,
) -> Body {
    Body {
        name: name.to_owned(),
        // Turned upright: its x becomes down, its y stays.
        shape: Shape::Rectangle { size_m: [z_m.1 - z_m.0, width_m] },
        pose: [x_m, y_m, f64::midpoint(z_m.0, z_m.1), yaw_rad, FRAC_PI_2, 0.0],
        material,
    }
}

/// A table on four legs.
pub(crate) fn table(
    [x_m, y_m]: Place,
    [depth_m, width_m]: [f64; 2],
    height_m: f64,
    material: Material,
) -> Vec<Body> {
    const TOP_M: f64 = 0.03;
    const LEG_INSET_M: f64 = 0.05;
    const LEG_RADIUS_M: f64 = 0.025;
    let under_top_m = height_m - TOP_M;
    let size_m = [depth_m, width_m];
    let mut bodies =
        vec![block("table top", [x_m, y_m], 0.0, (under_top_m, height_m), size_m, material)];
    for (towards_x, towards_y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let leg = [
            x_m + towards_x * (depth_m / 2.0 - LEG_INSET_M),
            y_m + towards_y * (width_m / 2.0 - LEG_INSET_M),
        ];
        bodies.push(post("table leg", leg, LEG_RADIUS_M, (0.0, under_top_m), material));
    }
    bodies
}

/// A sofa that faces the sensors.
pub(crate) fn sofa([x_m, y_m]: Place, width_m: f64, material: Material) -> Vec<Body> {
    let arm = |side: f64| {
        let place = [x_m, y_m + side * (width_m / 2.0 - 0.1)];
        block("sofa arm", place, 0.0, (0.0, 0.62), [0.8, 0.2], material)
    };
    vec![
        block("sofa seat", [x_m, y_m], 0.0, (0.0, 0.42), [0.8, width_m], material),
        block("sofa back", [x_m + 0.3, y_m], 0.0, (0.42, 0.85), [0.2, width_m], material),
        arm(-1.0),
        arm(1.0),
    ]
}

/// A plant in a pot: leaves as balls of uneven size around the stem, at the height of the scanner too.
pub(crate) fn plant([x_m, y_m]: Place) -> Vec<Body> {
    /// Offset from the stem along x and y, height, radius.
    const LEAVES: [[f64; 4]; 7] = [
        [0.0, 0.0, 1.5, 0.12],
        [0.12, 0.08, 1.3, 0.1],
        [-0.1, 0.12, 1.22, 0.09],
        [0.02, -0.16, 1.17, 0.11],
        [-0.12, -0.05, 1.05, 0.1],
        [0.08, 0.14, 0.95, 0.12],
        [0.0, -0.05, 0.8, 0.1],
    ];
    let mut bodies = vec![
        post("pot", [x_m, y_m], 0.18, (0.0, 0.4), Material::matt(0.4)),
        post("stem", [x_m, y_m], 0.02, (0.4, 1.5), Material::matt(0.3)),
    ];
    bodies.extend(LEAVES.iter().map(|[dx_m, dy_m, z_m, radius_m]| Body {
        name: "leaves".to_owned(),
        shape: Shape::Sphere { radius_m: *radius_m },
        pose: [x_m + dx_m, y_m + dy_m, *z_m, 0.0, 0.0, 0.0],
        material: Material::LEAVES,
    }));
    bodies
}

/// A curtain before a wall: folds of alternating depth.
pub(crate) fn curtain(x_m: f64, y_m: (f64, f64), top_m: f64, material: Material) -> Vec<Body> {
    const FOLD_RADIUS_M: f64 = 0.05;
    let folds = ((y_m.1 - y_m.0) / (2.0 * FOLD_RADIUS_M)).max(0.0) as usize;
    (0..folds)
        .map(|fold| {
            let towards_room_m = if fold % 2 == 0 { 0.06 } else { 0.0 };
            let place = [x_m - towards_room_m, y_m.0 + (2.0 * fold as f64 + 1.0) * FOLD_RADIUS_M];
            post("curtain fold", place, FOLD_RADIUS_M, (0.05, top_m), material)
        })
        .collect()
}

/// A rack of boards with boxes of uneven depth on them, open to both sides.
pub(crate) fn rack([x_m, y_m]: Place, width_m: f64, material: Material) -> Vec<Body> {
    const DEPTH_M: f64 = 0.4;
    const BOARDS: u8 = 5;
    const BOARD_GAP_M: f64 = 0.42;
    let mut bodies = Vec::new();
    for board in 0..BOARDS {
        let row = f64::from(board);
        let z_m = 0.1 + row * BOARD_GAP_M;
        let size_m = [DEPTH_M, width_m];
        bodies.push(block("rack board", [x_m, y_m], 0.0, (z_m - 0.02, z_m), size_m, material));
        if board + 1 < BOARDS {
            // Each row is filled from the other end, and further back, than the one below.
            let towards = if board % 2 == 0 { 1.0 } else { -1.0 };
            let place = [x_m + 0.02 * row, y_m + towards * width_m * 0.17];
            let top_m = z_m + 0.22 + 0.03 * row;
            let size_m = [DEPTH_M * 0.8, width_m * 0.55];
            let boxes = Material::matt(0.35 + 0.1 * row);
            bodies.push(block("boxes", place, 0.0, (z_m, top_m), size_m, boxes));
        }
    }
    let top_m = 0.1 + f64::from(BOARDS - 1) * BOARD_GAP_M;
    for side in [-1.0, 1.0] {
        let place = [x_m, y_m + side * width_m / 2.0];
        bodies.push(block("rack side", place, 0.0, (0.0, top_m), [DEPTH_M, 0.03], material));
    }
    bodies
}
