//! A flat: a corridor with three rooms on each side, and a path through all of them.

use std::f64::consts::PI;

use crate::noise::{FrameNoise, Stream};
use crate::odometry::rooms::{books, checkered, on_a_desk, scene};
use crate::odometry::ways::carried;
use crate::scenes::{block, boarded, plant, post, rack, sofa, table, with_pictures};
use crate::{Body, Lamp, Lighting, Material, Paint, Path, Scene};

/// The length and width of the corridor, from wall to wall.
const ROOM_M: f64 = 4.5;
const ROOMS_A_SIDE: u8 = 3;
const ROOM_DEPTH_M: f64 = 4.2;
const HALF_CORRIDOR_M: f64 = 0.85;
const WALL_M: f64 = 0.1;
const HEIGHT_M: f64 = 2.6;
const DOOR_M: f64 = 1.0;
const DOOR_HEIGHT_M: f64 = 2.1;
const LENGTH_M: f64 = ROOM_M * ROOMS_A_SIDE as f64;
/// The distance from the corridor's axis to the far wall of a room.
const FAR_M: f64 = HALF_CORRIDOR_M + WALL_M + ROOM_DEPTH_M;

/// A room: the position of its middle along the corridor, and its side.
#[derive(Clone, Copy, Debug)]
struct Room {
    index: u8,
    x_m: f64,
    side: f64,
}

/// In the order of the path.
fn rooms() -> impl Iterator<Item = Room> {
    (0..2 * ROOMS_A_SIDE).map(|index| Room {
        index,
        x_m: (f64::from(index / 2) + 0.5) * ROOM_M,
        side: if index % 2 == 0 { 1.0 } else { -1.0 },
    })
}

/// The flat. The seed decides the furniture of each room.
pub(crate) fn flat(seed: u64) -> Scene {
    let white = Material::PLASTER;
    let slab =
        |name: &str, min_m: [f64; 3], max_m, material| Body::cuboid(name, min_m, max_m, material);
    let mut bodies = vec![
        slab("floor", [-WALL_M, -FAR_M, -WALL_M], [LENGTH_M + WALL_M, FAR_M, 0.0], boarded(white)),
        slab("ceiling", [-WALL_M, -FAR_M, HEIGHT_M], [LENGTH_M, FAR_M, HEIGHT_M + WALL_M], white),
        slab("end wall", [-WALL_M, -FAR_M, 0.0], [0.0, FAR_M, HEIGHT_M], with_pictures(white)),
        slab(
            "end wall",
            [LENGTH_M, -FAR_M, 0.0],
            [LENGTH_M + WALL_M, FAR_M, HEIGHT_M],
            with_pictures(white),
        ),
    ];
    let mut lamps = Vec::new();
    for room in rooms() {
        bodies.extend(walls(room));
        bodies.extend(furniture(room, seed));
        // Walls do not block light here, so each lamp is weak.
        let position_m = [room.x_m + 0.4, room.side * (FAR_M - 1.8), HEIGHT_M - 0.3];
        lamps.push(Lamp { position_m, brightness: 1.1 });
    }
    scene(bodies, Lighting::of_lamps(0.34, lamps))
}

/// The walls of a room but for the flat's end walls: to the corridor with its door, to the next room, and outside.
fn walls(Room { index, x_m, side }: Room) -> Vec<Body> {
    const SHADES: [[f64; 3]; 6] = [
        [0.72, 0.7, 0.64],
        [0.6, 0.68, 0.72],
        [0.74, 0.66, 0.52],
        [0.62, 0.7, 0.6],
        [0.72, 0.62, 0.62],
        [0.68, 0.68, 0.7],
    ];
    let shade = SHADES[usize::from(index) % SHADES.len()];
    let paper = with_pictures(Material::PLASTER.painted(Paint::grained(shade, 0.06)));
    let wall = |x_m: [f64; 2], y_m: [f64; 2], z_m: [f64; 2]| {
        let [near_m, far_m] = y_m.map(|y_m| side * y_m);
        let min_m = [x_m[0], near_m.min(far_m), z_m[0]];
        Body::cuboid("wall", min_m, [x_m[1], near_m.max(far_m), z_m[1]], paper)
    };
    let (from_m, to_m) = (x_m - ROOM_M / 2.0, x_m + ROOM_M / 2.0);
    let inner = [HALF_CORRIDOR_M, HALF_CORRIDOR_M + WALL_M];
    vec![
        wall([from_m, x_m - DOOR_M / 2.0], inner, [0.0, HEIGHT_M]),
        wall([x_m + DOOR_M / 2.0, to_m], inner, [0.0, HEIGHT_M]),
        wall([x_m - DOOR_M / 2.0, x_m + DOOR_M / 2.0], inner, [DOOR_HEIGHT_M, HEIGHT_M]),
        wall([from_m, to_m], [FAR_M, FAR_M + WALL_M], [0.0, HEIGHT_M]),
        wall([to_m - WALL_M / 2.0, to_m + WALL_M / 2.0], [inner[1], FAR_M], [0.0, HEIGHT_M]),
    ]
}

/// The furniture along the walls of a room; its middle and the path to the door are free.
fn furniture(room: Room, seed: u64) -> Vec<Body> {
    const KINDS: usize = 6;
    let noise = FrameNoise::new(seed, Stream::Way, u64::from(room.index));
    let any = |draw: usize, most: f64| most * (2.0 * f64::from(noise.draw(draw).uniform()) - 1.0);
    let first = (f64::from(noise.draw(0).uniform()) * KINDS as f64) as usize;
    // Positions along the two side walls and the far wall, as seen from the door.
    let far_m = FAR_M - 0.35;
    let places = [[-1.85, far_m - 0.9], [1.85, far_m - 1.4], [-0.9, far_m], [0.9, far_m]];
    let mut bodies = Vec::new();
    for (index, [along_m, across_m]) in places.into_iter().enumerate() {
        let place = [
            room.x_m + along_m + any(4 * index + 1, 0.05),
            room.side * (across_m + any(4 * index + 2, 0.15)),
        ];
        bodies.extend(piece((first + index * 5 + usize::from(room.index)) % KINDS, place));
    }
    bodies
}

/// A piece of furniture of a kind, no larger than 0.7 m across.
fn piece(kind: usize, place: [f64; 2]) -> Vec<Body> {
    match kind {
        0 => {
            let mut desk = table(place, [0.65, 1.2], 0.75, Material::WOOD);
            desk.extend(on_a_desk(place, 0.75));
            desk
        }
        1 => books(place, 1.1),
        2 => plant(place),
        3 => rack(place, 1.1, Material::WOOD),
        4 => {
            let [x_m, y_m] = place;
            let mut seat = sofa([0.0, 0.0], 1.3, Material::CLOTH);
            for body in &mut seat {
                body.pose[0] += x_m;
                body.pose[1] += y_m;
            }
            seat
        }
        _ => vec![
            block("cabinet", place, 0.0, (0.0, 1.1), [0.5, 0.8], Material::VARNISH),
            block("box", place, 0.4, (1.1, 1.45), [0.35, 0.3], checkered()),
            post("lamp", [place[0], place[1] + 0.3], 0.1, (1.1, 1.5), Material::CARD),
        ],
    }
}

/// From one end of the corridor through each room and along the corridor back to the start, looking ahead.
pub(super) fn through_all_rooms(seed: u64) -> Path {
    const HEIGHT_M: f64 = 1.35;
    /// One pose per second: the speed of a person with a hand-held camera in a flat.
    const STEP_S: f64 = 1.0;
    const STEP_M: f64 = 0.6;
    let mut corners = vec![[0.8, 0.0]];
    for Room { x_m, side, .. } in rooms() {
        let at = |along_m: f64, across_m: f64| [x_m + along_m, side * across_m];
        corners.extend([
            at(0.0, 0.0),
            at(0.0, 1.6),
            at(0.9, 2.3),
            at(0.7, 3.2),
            at(-0.5, 3.2),
            at(-0.8, 2.3),
            at(0.0, 1.6),
            at(0.0, 0.0),
        ]);
    }
    corners.extend([[LENGTH_M - 0.9, 0.0], [0.8, 0.0]]);
    // It turns twice at the end of the corridor, so that it ends with its first heading.
    let mut near: Vec<[f64; 6]> = Vec::new();
    let mut yaw_rad = 0.0;
    for pair in corners.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let (dx_m, dy_m) = (to[0] - from[0], to[1] - from[1]);
        let length_m = dx_m.hypot(dy_m);
        if length_m < 1e-6 {
            continue;
        }
        let before_rad = yaw_rad;
        let turn_rad = dy_m.atan2(dx_m) - before_rad;
        yaw_rad = before_rad + (turn_rad + PI).rem_euclid(2.0 * PI) - PI;
        turn_on_the_spot(&mut near, from, (before_rad, yaw_rad), HEIGHT_M);
        let steps = (length_m / STEP_M).ceil();
        for step in 1..=steps as u32 {
            let share = f64::from(step) / steps;
            let place = [from[0] + share * dx_m, from[1] + share * dy_m];
            near.push([place[0], place[1], HEIGHT_M, yaw_rad, 0.1, 0.0]);
        }
    }
    turn_on_the_spot(&mut near, corners[0], (yaw_rad, yaw_rad + PI), HEIGHT_M);
    near.insert(0, [corners[0][0], corners[0][1], HEIGHT_M, 0.0, 0.1, 0.0]);
    carried(STEP_S, near, 1.0, seed).path()
}

/// Turns slowly enough for images without blur.
fn turn_on_the_spot(
    near: &mut Vec<[f64; 6]>,
    place: [f64; 2],
    (from_rad, to_rad): (f64, f64),
    height_m: f64,
) {
    const MOST_A_STEP_RAD: f64 = 0.6;
    let steps = ((to_rad - from_rad).abs() / MOST_A_STEP_RAD).ceil();
    for step in 1..=steps as u32 {
        let yaw_rad = from_rad + f64::from(step) / steps * (to_rad - from_rad);
        near.push([place[0], place[1], height_m, yaw_rad, 0.1, 0.0]);
    }
}
