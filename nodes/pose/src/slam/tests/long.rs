//! A camera that goes round and round in one room.

use super::*;

/// A frame's time; the camera turns by three degrees meanwhile.
const FRAME_S: f64 = 0.1;
const ROUND_S: f64 = 12.0;
/// 300 are an hour, and hold, too.
const ROUNDS: usize = 10;

/// Round and round, looking outwards, a little higher or lower and nearer or farther each time.
fn round_and_round(time_s: f64) -> Isometry3<f64> {
    let turn =
        UnitQuaternion::from_scaled_axis(Vector3::y() * (time_s / ROUND_S * std::f64::consts::TAU));
    let nod = UnitQuaternion::from_scaled_axis(Vector3::x() * (0.1 * (0.23 * time_s).sin()));
    let out_m = 0.5 + 0.15 * (0.31 * time_s).sin();
    let place = turn * Vector3::z() * out_m + Vector3::y() * 0.15 * (0.17 * time_s).sin();
    Isometry3::from_parts(Translation3::from(place), turn * nod)
}

/// What there was after so many rounds.
#[derive(Clone, Copy, Debug)]
struct Size {
    keyframes: usize,
    bytes: usize,
    remembered: usize,
}

/// The map's size after each of these rounds, and how far off the camera was at most after the first.
fn sizes(rounds: usize) -> (Vec<Size>, f64) {
    let (room, mut camera) = (room(), Camera::new(round_and_round, Spoil::default(), 7));
    let mut slam = Slam::inline(&config()).unwrap();
    let frames = (ROUND_S / FRAME_S) as usize;
    let begin = round_and_round(0.0);
    let (mut sizes, mut off_m) = (Vec::new(), 0.0_f64);
    for index in 0..rounds * frames {
        let time_s = index as f64 * FRAME_S;
        let frame = camera.frame(time_s, &[(&room, Isometry3::identity())]);
        let done = slam.step(&frame, &camera.model, &Hints::default());
        if index >= frames {
            // The map is the first camera's.
            let truth = begin.inverse() * round_and_round(time_s);
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
    let (sizes, off_m) = sizes(ROUNDS);
    println!("{sizes:?}, {off_m:.4} m off");
    assert_saturated(&sizes, off_m);
}
