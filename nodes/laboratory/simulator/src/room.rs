//! One furnished room.
//!
//! 5 m deep (x), 6 m wide (y), 2.6 m high, with doorways in the side walls that face each other, so
//! that objects can enter on one side and leave on the other. Furniture stands along the far wall.
//!
//! A scanner 1.15 m up in the middle of the room, half a metre before the rear wall (the demo's), meets in
//! its forward quarter the far wall, the side walls behind the doorways, the shelf (its sides, its back and the
//! fourth row of books), the lamp, and the black monitor, which returns nothing: seven or eight
//! beams in each turn. It looks over the chair, the table and the cabinet. Its largest step in depth is 0.36 m
//! along the beam, from the shelf's left side to the far wall. A beam that meets now one side of a step and now
//! the other deviates over three turns by at most 0.47 of the step, here 0.17 m: well below the 0.4 m that
//! Rec-HV takes for motion.

use std::f64::consts::FRAC_PI_2;

use crate::scenes::Shell;
use crate::{Body, Material, Paint, Shape, Texture};

/// The room's extent along x, y and z. The floor is at z = 0, y = 0 in the middle, x = 0 at the rear wall.
pub(crate) const DEPTH_M: f64 = 5.0;
pub(crate) const WIDTH_M: f64 = 6.0;
pub(crate) const HEIGHT_M: f64 = 2.6;

/// The room and its furniture.
pub(crate) fn furnished_room() -> Vec<Body> {
    let shell = Shell {
        depth_m: DEPTH_M,
        width_m: WIDTH_M,
        height_m: HEIGHT_M,
        door_m: (2.0, 3.3),
        corridor_m: 1.2,
        ..Shell::default()
    };
    let mut bodies = shell.bodies();
    bodies.extend(table());
    bodies.extend(chair());
    bodies.extend(shelf());
    bodies.push(Body::cuboid(
        "cabinet",
        [4.55, -2.3, 0.0],
        [5.0, -1.3, 0.95],
        Material::polished(0.6, 1.3),
    ));
    bodies.push(Body {
        name: "lamp".to_owned(),
        shape: Shape::Sphere { radius_m: 0.12 },
        pose: [4.78, -1.6, 1.07, 0.0, 0.0, 0.0],
        material: Material::matt(0.7),
    });
    bodies
}

/// A table against the far wall, with a monitor that is off.
fn table() -> Vec<Body> {
    let (x_m, y_m, top_m) = ((4.35, 4.97), (-1.1, 0.2), 0.75);
    let mut bodies = vec![
        Body::cuboid(
            "table top",
            [x_m.0, y_m.0, top_m - 0.03],
            [x_m.1, y_m.1, top_m],
            Material::WOOD,
        ),
        Body::cuboid("monitor", [4.7, -0.75, 0.83], [4.74, -0.2, 1.17], Material::BLACK_GLASS),
        Body::cuboid(
            "monitor foot",
            [4.62, -0.6, top_m],
            [4.82, -0.35, 0.83],
            Material::DARK_PLASTIC,
        ),
    ];
    for (x_m, y_m) in corners(x_m, y_m, 0.05) {
        bodies.push(Body {
            name: "table leg".to_owned(),
            shape: Shape::Cylinder { radius_m: 0.03, height_m: top_m - 0.03 },
            pose: [x_m, y_m, (top_m - 0.03) / 2.0, 0.0, 0.0, 0.0],
            material: Material::WOOD,
        });
    }
    bodies
}

/// A chair beside the table, its back to the wall.
fn chair() -> Vec<Body> {
    let (x_m, y_m, seat_m) = ((4.42, 4.84), (0.5, 0.92), 0.45);
    let wood = Material::WOOD;
    let mut bodies = vec![
        Body::cuboid("chair seat", [x_m.0, y_m.0, seat_m - 0.04], [x_m.1, y_m.1, seat_m], wood),
        Body {
            name: "chair back".to_owned(),
            shape: Shape::Box { size_m: [0.03, 0.42, 0.4] },
            // Leaning back a little.
            pose: [x_m.1 - 0.01, 0.71, 0.68, 0.0, 0.12, 0.0],
            material: wood,
        },
    ];
    for (x_m, y_m) in corners(x_m, y_m, 0.03) {
        bodies.push(Body {
            name: "chair leg".to_owned(),
            shape: Shape::Cylinder { radius_m: 0.02, height_m: seat_m },
            pose: [x_m, y_m, seat_m / 2.0, 0.0, 0.0, 0.0],
            material: wood,
        });
    }
    bodies
}

/// An open shelf with books against the far wall.
fn shelf() -> Vec<Body> {
    let (front_m, y_m, top_m) = (4.68, (1.25, 2.15), 1.8);
    let wood = Material::WOOD;
    let mut bodies = vec![
        Body::cuboid("shelf side", [front_m, y_m.0, 0.0], [DEPTH_M, y_m.0 + 0.02, top_m], wood),
        Body::cuboid("shelf side", [front_m, y_m.1 - 0.02, 0.0], [DEPTH_M, y_m.1, top_m], wood),
        Body {
            name: "shelf back".to_owned(),
            shape: Shape::Rectangle { size_m: [top_m, y_m.1 - y_m.0] },
            // Turned upright, facing the room.
            pose: [DEPTH_M - 0.01, f64::midpoint(y_m.0, y_m.1), top_m / 2.0, 0.0, FRAC_PI_2, 0.0],
            material: wood,
        },
    ];
    for board in 0..6 {
        let z_m = 0.02 + f64::from(board) * (top_m - 0.04) / 5.0;
        bodies.push(Body::cuboid(
            "shelf board",
            [front_m, y_m.0, z_m - 0.02],
            [DEPTH_M, y_m.1, z_m],
            wood,
        ));
        // Rows of books of different length and depth; the top board stays empty.
        if board < 5 {
            let row = f64::from(board);
            bodies.push(Body::cuboid(
                "books",
                [4.74 + 0.02 * row, y_m.0 + 0.04 + 0.03 * row, z_m],
                [4.95, y_m.1 - 0.3 + 0.04 * row, z_m + 0.2 + 0.015 * row],
                Material::matt(0.35 + 0.05 * row).painted(Paint::with(
                    [0.3; 3],
                    Texture::Spines { width_m: 0.035 },
                    0.1,
                )),
            ));
        }
    }
    bodies
}

/// The four corners of a rectangle, moved inwards.
fn corners(x_m: (f64, f64), y_m: (f64, f64), inset_m: f64) -> [(f64, f64); 4] {
    let (near_m, far_m) = (x_m.0 + inset_m, x_m.1 - inset_m);
    let (right_m, left_m) = (y_m.0 + inset_m, y_m.1 - inset_m);
    [(near_m, right_m), (near_m, left_m), (far_m, right_m), (far_m, left_m)]
}
