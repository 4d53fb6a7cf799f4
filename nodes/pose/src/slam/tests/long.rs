//! Cameras that go round and round where they have been.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::*;

/// A frame's time.
const FRAME_S: f64 = 0.1;

/// Somebody's round, again and again.
struct Drive {
    map_from_camera: fn(f64) -> Isometry3<f64>,
    round_s: f64,
    rooms: Vec<Room>,
}

/// A room, and from where it is seen: the half sides of a box about its middle.
struct Room {
    things: Thing,
    middle_m: [f64; 3],
    seen_within_m: f64,
}

impl Room {
    fn is_seen_from(&self, place: &Vector3<f64>) -> bool {
        // Any height will do.
        [0, 2].iter().all(|&axis| (place[axis] - self.middle_m[axis]).abs() < self.seen_within_m)
    }
}

/// Round and round on the spot, looking outwards, a little higher or lower and nearer or farther each time.
fn on_the_spot(time_s: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * (time_s / SPOT_ROUND_S * TAU));
    let nod = UnitQuaternion::from_scaled_axis(Vector3::x() * (0.1 * (0.23 * time_s).sin()));
    let out_m = 0.5 + 0.15 * (0.31 * time_s).sin();
    let place = turn * Vector3::z() * out_m + Vector3::y() * 0.15 * (0.17 * time_s).sin();
    Isometry3::from_parts(Translation3::from(place), turn * nod)
}

/// The camera turns by three degrees from frame to frame.
const SPOT_ROUND_S: f64 = 12.0;
/// 300 are an hour, and hold, too.
const SPOT_ROUNDS: usize = 10;

fn in_one_room() -> Drive {
    // Seen from everywhere.
    let room = Room { things: room(), middle_m: [0.0; 3], seen_within_m: f64::INFINITY };
    Drive { map_from_camera: on_the_spot, round_s: SPOT_ROUND_S, rooms: vec![room] }
}

/// Through four rooms and back, looking ahead, each time on another path.
fn through_the_flat(time_s: f64) -> Isometry3<f64> {
    let along_rad = time_s / FLAT_ROUND_S * TAU;
    let out_m = 2.5 + 0.3 * (0.31 * time_s).sin();
    let height_m = 0.1 * (0.17 * time_s).sin();
    let place = Vector3::new(out_m * along_rad.sin(), height_m, out_m * along_rad.cos());
    let heading_rad = along_rad + FRAC_PI_2 + 0.2 * (0.23 * time_s).sin();
    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * heading_rad);
    Isometry3::from_parts(Translation3::from(place), turn)
}

/// 16 m at 0.65 m/s.
const FLAT_ROUND_S: f64 = 24.0;
/// 150 are an hour, and hold, too.
const FLAT_ROUNDS: usize = 8;

/// Four rooms of 5 by 5 m about a corner, with doors so wide that the next room is seen from 1.2 m before its wall.
fn in_a_flat() -> Drive {
    let middles = [(-2.5, -2.5), (-2.5, 2.5), (2.5, -2.5), (2.5, 2.5)];
    let rooms = middles.iter().zip(11..).map(|(&(x, z), seed)| {
        let middle_m = [x, 0.0, z];
        let things = Thing::boxed(middle_m, [2.5, 1.3, 2.5], 1500, 80, seed);
        Room { things, middle_m, seen_within_m: 2.5 + 1.2 }
    });
    Drive { map_from_camera: through_the_flat, round_s: FLAT_ROUND_S, rooms: rooms.collect() }
}

/// The state after this many rounds.
#[derive(Clone, Copy, Debug)]
struct Size {
    keyframes: usize,
    bytes: usize,
    remembered: usize,
}

/// The map's size after each of these rounds, and how far off the camera was at most after the first.
fn sizes(drive: &Drive, rounds: usize) -> (Vec<Size>, f64) {
    let mut camera = Camera::new(drive.map_from_camera, Spoil::default(), 7);
    let mut slam = Slam::inline(&config()).unwrap();
    let frames = (drive.round_s / FRAME_S) as usize;
    let begin = (drive.map_from_camera)(0.0);
    let (mut sizes, mut off_m) = (Vec::new(), 0.0_f64);
    for index in 0..rounds * frames {
        let time_s = index as f64 * FRAME_S;
        let map_from_camera = (drive.map_from_camera)(time_s);
        let seen = drive.rooms.iter();
        let seen = seen.filter(|room| room.is_seen_from(&map_from_camera.translation.vector));
        let seen: Vec<_> = seen.map(|room| (&room.things, Isometry3::identity())).collect();
        let frame = camera.frame(time_s, &seen);
        let done = slam.step(&frame, &camera.model, &Hints::default());
        if index >= frames {
            // The map is the first camera's.
            let truth = begin.inverse() * map_from_camera;
            let (shift_m, _) = error(&done.camera_from_map().unwrap(), &truth);
            off_m = off_m.max(shift_m);
        }
        if (index + 1) % frames == 0 {
            let map = slam.mapping().map();
            let (keyframes, bytes) = (map.keyframes().len(), map.memory().bytes());
            sizes.push(Size { keyframes, bytes, remembered: slam.remembered() });
        }
    }
    (sizes, off_m)
}

/// From the middle of the rounds on nothing grows by more than a sixth, and the camera is where it is thought to be.
fn assert_saturated(sizes: &[Size], off_m: f64) {
    let (half, last) = (sizes[sizes.len() / 2 - 1], sizes[sizes.len() - 1]);
    let grown = |now: usize, before: usize| now as f64 / before as f64;
    assert!(grown(last.keyframes, half.keyframes) < 1.17, "{half:?} {last:?}");
    assert!(grown(last.bytes, half.bytes) < 1.17, "{half:?} {last:?}");
    assert!(last.remembered < 2000, "{last:?}");
    assert!(off_m < 0.05, "{off_m}");
}

/// Everything in this room is farther off than what counts as close: its keyframes never went.
#[test]
fn in_a_room_that_is_known_the_map_no_longer_grows() {
    let (sizes, off_m) = sizes(&in_one_room(), SPOT_ROUNDS);
    println!("{sizes:?}, {off_m:.4} m off");
    assert_saturated(&sizes, off_m);
}

#[test]
fn in_a_flat_that_is_known_the_map_no_longer_grows() {
    let (sizes, off_m) = sizes(&in_a_flat(), FLAT_ROUNDS);
    println!("{sizes:?}, {off_m:.4} m off");
    assert_saturated(&sizes, off_m);
}
