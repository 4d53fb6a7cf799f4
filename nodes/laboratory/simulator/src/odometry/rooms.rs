//! The rooms. Sizes and positions are chosen here.

use std::f64::consts::FRAC_PI_2;

use crate::scenes::{Shell, block, boarded, plant, post, rack, sofa, table, with_pictures};
use crate::{Body, Lighting, Material, Paint, Scene, Shape, Texture};

pub(crate) fn scene(bodies: Vec<Body>, lighting: Lighting) -> Scene {
    Scene { bodies, objects: Vec::new(), lighting }
}

/// An office of 6 x 7 m with furniture along all its walls. The middle is free.
pub(crate) fn office() -> Scene {
    let shell = Shell {
        depth_m: 6.0,
        width_m: 7.0,
        height_m: 2.7,
        door_m: (2.7, 3.7),
        corridor_m: 1.2,
        ..Shell::default()
    };
    let mut bodies = shell.bodies();
    bodies.extend(rack([5.7, -2.0], 1.6, Material::WOOD));
    bodies.extend(books([5.7, 1.9], 1.5));
    bodies.extend(table([5.3, 0.0], [0.8, 1.6], 0.75, Material::WOOD));
    bodies.extend(on_a_desk([5.3, 0.0], 0.75));
    bodies.extend(table([1.6, 3.0], [1.4, 0.7], 0.75, Material::WOOD));
    bodies.extend(on_a_desk([1.6, 3.0], 0.75));
    bodies.extend(plant([5.4, 3.1]));
    bodies.extend(plant([0.5, -3.0]));
    bodies.push(block("cabinet", [4.7, -3.2], 0.0, (0.0, 1.3), [0.9, 0.5], Material::VARNISH));
    bodies.push(block("box", [4.6, -3.2], 0.3, (1.3, 1.6), [0.4, 0.3], checkered()));
    bodies.push(block("carpet", [3.0, 0.0], 0.0, (0.0, 0.012), [2.6, 2.0], carpet()));
    bodies.push(block("box", [0.4, 2.2], 0.2, (0.0, 0.5), [0.5, 0.6], Material::CARD));
    bodies.push(block("box", [0.35, 2.25], -0.3, (0.5, 0.85), [0.35, 0.4], checkered()));
    bodies.push(post("floor lamp", [5.5, -3.1], 0.03, (0.0, 1.5), Material::POLISHED_METAL));
    bodies.push(post("lamp shade", [5.5, -3.1], 0.2, (1.5, 1.8), Material::CARD));
    bodies.extend(rear_sofa());
    scene(bodies, shell.lighting())
}

/// A sofa at the rear wall, facing into the room.
fn rear_sofa() -> Vec<Body> {
    let mut bodies = sofa([0.0, 0.0], 1.8, Material::CLOTH);
    for body in &mut bodies {
        // Turned by half a turn, and moved to the wall.
        let [x_m, y_m, ..] = body.pose;
        body.pose[0] = 0.5 - x_m;
        body.pose[1] = -0.8 - y_m;
    }
    bodies
}

/// The office with a desk in its middle.
pub(crate) fn desk() -> Scene {
    let mut office = office();
    office.bodies.retain(|body| body.name != "carpet");
    office.bodies.extend(table([2.6, 0.0], [0.9, 1.8], 0.75, Material::WOOD));
    office.bodies.extend(on_a_desk([2.6, 0.0], 0.75));
    office.bodies.push(block("book", [2.4, 0.6], 0.4, (0.75, 0.79), [0.2, 0.15], spines()));
    office.bodies.push(block("book", [2.42, 0.6], 0.1, (0.79, 0.82), [0.22, 0.16], checkered()));
    office
}

/// The objects on a desk of at least 0.7 x 1.4 m.
pub(crate) fn on_a_desk([x_m, y_m]: [f64; 2], top_m: f64) -> Vec<Body> {
    let at = |dx_m: f64, dy_m: f64| [x_m + dx_m, y_m + dy_m];
    let on = |height_m: f64| (top_m, top_m + height_m);
    let mug = Material::VARNISH.painted(Paint::grained([0.7, 0.1, 0.08], 0.05));
    let paper = Material::CARD.painted(Paint::with(
        [0.8, 0.8, 0.76],
        Texture::Posters { spacing_m: 0.21, share: 0.8 },
        0.02,
    ));
    let keys = Material::DARK_PLASTIC.painted(Paint::with(
        [0.25; 3],
        Texture::Boards { size_m: [0.019, 0.019], joint_m: 0.004, contrast: 0.2, staggered: true },
        0.05,
    ));
    vec![
        block("keyboard", at(-0.18, 0.0), 0.05, on(0.02), [0.15, 0.44], keys),
        block("monitor foot", at(0.15, 0.05), 0.0, on(0.1), [0.2, 0.25], Material::DARK_PLASTIC),
        block(
            "monitor",
            at(0.15, 0.05),
            0.0,
            (top_m + 0.1, top_m + 0.45),
            [0.05, 0.55],
            Material::BLACK_GLASS,
        ),
        post("mug", at(-0.1, 0.38), 0.04, on(0.1), mug),
        block("paper", at(-0.15, -0.4), 0.3, on(0.004), [0.3, 0.21], paper),
        block("paper", at(0.05, -0.5), -0.5, on(0.006), [0.3, 0.21], paper),
        block("books", at(0.2, -0.5), 0.1, on(0.24), [0.17, 0.3], spines()),
        block("box", at(0.18, 0.5), 0.5, on(0.14), [0.2, 0.26], checkered()),
        Body {
            name: "ball".to_owned(),
            shape: Shape::Sphere { radius_m: 0.06 },
            pose: [x_m - 0.2, y_m + 0.55, top_m + 0.06, 0.0, 0.0, 0.0],
            material: Material::matt(0.5).painted(Paint::with(
                [0.6, 0.5, 0.05],
                Texture::Checker { size_m: 0.04, other: [0.05, 0.1, 0.4] },
                0.05,
            )),
        },
    ]
}

/// A shelf of books before the far wall.
pub(crate) fn books([x_m, y_m]: [f64; 2], width_m: f64) -> Vec<Body> {
    const DEPTH_M: f64 = 0.3;
    let mut bodies = Vec::new();
    for row in 0..6 {
        let z_m = 0.1 + 0.36 * f64::from(row);
        let board = (z_m - 0.02, z_m);
        bodies.push(block("board", [x_m, y_m], 0.0, board, [DEPTH_M, width_m], Material::WOOD));
        if row < 5 {
            let share = 0.95 - 0.06 * f64::from(row * 3 % 5);
            let height_m = 0.22 + 0.02 * f64::from(row * 2 % 5);
            let place = [x_m + 0.03, y_m + (share - 0.95) * width_m / 2.0];
            let size_m = [DEPTH_M - 0.08, share * width_m - 0.06];
            bodies.push(block("books", place, 0.0, (z_m, z_m + height_m), size_m, spines()));
        }
    }
    for side in [-1.0, 1.0] {
        let place = [x_m, y_m + side * width_m / 2.0];
        bodies.push(block("shelf side", place, 0.0, (0.0, 1.9), [DEPTH_M, 0.03], Material::WOOD));
    }
    bodies
}

/// A hall of 16 x 12 m, 5 m high, with columns and crates.
pub(super) fn hall() -> Scene {
    let concrete = Material::PLASTER.painted(Paint::with(
        [0.5, 0.5, 0.48],
        Texture::Noise { size_m: 1.2, contrast: 0.25 },
        0.15,
    ));
    let tiles = Material::matt(0.5).painted(Paint::with(
        [0.4, 0.38, 0.36],
        Texture::Boards { size_m: [0.6, 0.6], joint_m: 0.008, contrast: 0.12, staggered: false },
        0.12,
    ));
    let shell = Shell {
        depth_m: 16.0,
        width_m: 12.0,
        height_m: 5.0,
        door_m: (7.0, 9.0),
        corridor_m: 2.0,
        opening: None,
        walls: concrete,
        floor: tiles,
    };
    let mut bodies = shell.bodies();
    // `Shell` has pictures on its walls and floors of boards; here they are concrete and tiles.
    for body in &mut bodies {
        if body.name == "floor" {
            body.material = tiles;
        } else if body.name != "far wall" {
            body.material = concrete;
        }
    }
    for x_m in [4.0, 8.0, 12.0] {
        for y_m in [-3.5, 3.5] {
            bodies.push(post("column", [x_m, y_m], 0.25, (0.0, 5.0), concrete));
        }
    }
    let crates = [[3.4, -1.9], [5.5, 2.3], [7.2, -2.4], [10.4, 2.6], [11.2, -1.0], [12.5, 1.2]];
    for (index, place) in (0_u32..).zip(crates) {
        let size_m = 0.6 + 0.12 * f64::from(index % 4);
        let yaw_rad = 0.5 * f64::from(index);
        let material = if index % 2 == 0 { Material::WOOD } else { checkered() };
        bodies.push(block("crate", place, yaw_rad, (0.0, size_m), [size_m, size_m], material));
    }
    scene(bodies, shell.lighting())
}

/// 22 m long, 2.2 m wide: plain walls, skirting boards, doors in unequal distances, lamps in the ceiling.
pub(super) fn corridor() -> Scene {
    const HALF_M: f64 = 1.1;
    const LENGTH_M: f64 = 22.0;
    const HEIGHT_M: f64 = 2.5;
    let white = Material::PLASTER.painted(Paint::grained([0.7, 0.7, 0.66], 0.015));
    let lino = Material::matt(0.4).painted(Paint::grained([0.22, 0.27, 0.24], 0.03));
    let door = Material::WOOD.painted(Paint::grained([0.3, 0.2, 0.12], 0.03));
    let skirting = Material::matt(0.3).painted(Paint::plain([0.12, 0.12, 0.13]));
    let lamp = Material::matt(0.9).painted(Paint::plain([1.0; 3]));
    let slab =
        |name: &str, min_m: [f64; 3], max_m, material| Body::cuboid(name, min_m, max_m, material);
    let mut bodies = vec![
        slab("floor", [-0.1, -HALF_M, -0.1], [LENGTH_M, HALF_M, 0.0], lino),
        slab("ceiling", [-0.1, -HALF_M, HEIGHT_M], [LENGTH_M, HALF_M, HEIGHT_M + 0.1], white),
        slab("rear wall", [-0.1, -HALF_M, 0.0], [0.0, HALF_M, HEIGHT_M], white),
        slab("far wall", [LENGTH_M, -HALF_M, 0.0], [LENGTH_M + 0.1, HALF_M, HEIGHT_M], white),
    ];
    for (side, doors_m) in [(1.0, [2.2, 6.9, 10.1, 16.4]), (-1.0, [3.8, 7.4, 13.2, 18.0])] {
        // The slab of a wall lies beyond its face, the skirting and the doors a little before it.
        let across = |from_m: f64, to_m: f64| {
            let (a_m, b_m) = (side * (HALF_M - from_m), side * (HALF_M + to_m));
            (a_m.min(b_m), a_m.max(b_m))
        };
        let mut add = |name: &str, x_m: [f64; 2], y_m: (f64, f64), top_m: f64, material| {
            bodies.push(slab(name, [x_m[0], y_m.0, 0.0], [x_m[1], y_m.1, top_m], material));
        };
        add("wall", [-0.1, LENGTH_M], across(0.0, 0.1), HEIGHT_M, white);
        add("skirting", [0.0, LENGTH_M], across(0.012, 0.0), 0.09, skirting);
        for door_m in doors_m {
            add("door", [door_m, door_m + 0.9], across(0.02, 0.0), 2.05, door);
            add("door frame", [door_m - 0.08, door_m], across(0.035, 0.0), 2.13, skirting);
            add("door frame", [door_m + 0.9, door_m + 0.98], across(0.035, 0.0), 2.13, skirting);
        }
    }
    let mut lighting = Lighting::of_lamps(0.4, Vec::new());
    for lamp_x_m in [2.5, 7.5, 12.5, 17.5] {
        let (low_m, high_m) = (HEIGHT_M - 0.04, HEIGHT_M);
        bodies.push(slab(
            "lamp",
            [lamp_x_m - 0.6, -0.15, low_m],
            [lamp_x_m + 0.6, 0.15, high_m],
            lamp,
        ));
        let position_m = [lamp_x_m, 0.0, HEIGHT_M - 0.2];
        lighting.lamps.push(crate::Lamp { position_m, brightness: 0.9 });
    }
    scene(bodies, lighting)
}

/// One wall, 2.6 m away from the first pose of the camera, larger than its view.
pub(crate) fn wall() -> Scene {
    let material =
        with_pictures(Material::PLASTER.painted(Paint::grained([0.7, 0.66, 0.56], 0.12)));
    let wall = Body {
        name: "wall".to_owned(),
        shape: Shape::Rectangle { size_m: [12.0, 20.0] },
        pose: [2.6, 0.0, 1.5, 0.0, FRAC_PI_2, 0.0],
        material,
    };
    let lamps = [[0.0, -1.5, 3.0], [0.0, 2.0, 3.0]]
        .map(|position_m| crate::Lamp { position_m, brightness: 2.5 });
    scene(vec![wall], Lighting::of_lamps(0.4, lamps.to_vec()))
}

pub(crate) fn checkered() -> Material {
    Material::CARD.painted(Paint::with(
        [0.7, 0.68, 0.6],
        Texture::Checker { size_m: 0.09, other: [0.08, 0.12, 0.3] },
        0.08,
    ))
}

fn spines() -> Material {
    let texture = Texture::Spines { width_m: 0.035 };
    Material::matt(0.5).painted(Paint::with([0.3; 3], texture, 0.1))
}

pub(crate) fn carpet() -> Material {
    let texture = Texture::Noise { size_m: 0.35, contrast: 0.5 };
    boarded(Material::CLOTH).painted(Paint::with([0.32, 0.08, 0.07], texture, 0.25))
}
