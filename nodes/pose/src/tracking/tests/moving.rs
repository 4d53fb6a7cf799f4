//! Moving objects are excluded from the camera's pose.

use nalgebra::{Translation3, Vector3};

use super::*;
use crate::frame::MovingThing;

/// One who comes in from the left and goes by at 1.4 m/s, two metres before the camera.
fn walker_at(time_s: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(-3.0 + 1.4 * time_s, 0.0, 2.0), Default::default())
}

fn walker() -> Thing {
    Thing::boxed([0.0; 3], [0.45, 0.8, 0.15], 300, 20, 31)
}

/// The error, by root of the mean square, over the time in which the walker goes by.
fn rms_m(with_walker: bool, hints: impl Fn(f64) -> Vec<MovingThing>) -> (f64, usize) {
    let (mut tracker, mut camera) = (tracker(), at_ease(30));
    let (room, walker) = (Thing::room(4000, 300, 30), walker());
    let (mut squares, mut left_out) = (0.0, 0);
    const FRAMES: u32 = 130;
    for index in 0..FRAMES {
        let time_s = f64::from(index) * PERIOD_S;
        let mut things = vec![(&room, Isometry3::identity())];
        if with_walker {
            things.push((&walker, walker_at(time_s)));
        }
        let frame = camera.frame(time_s, &things);
        let moving = hints(time_s);
        let hints = Hints { moving: &moving, ..Hints::default() };
        let tracked = tracker.step(&frame, &camera.model, &hints);
        let pose = tracked.pose.unwrap_or_else(|| panic!("{index}: {:?}", tracked.trouble));
        squares += error(&pose.camera_from_map, &looking_about(time_s)).0.powi(2);
        left_out += tracked.count(FeatureStatus::LeftOut);
    }
    ((squares / f64::from(FRAMES)).sqrt(), left_out)
}

#[test]
fn one_who_goes_by_changes_little() {
    let (alone_m, _) = rms_m(false, |_| Vec::new());
    let (beside_m, _) = rms_m(true, |_| Vec::new());
    assert!(alone_m < 0.01 && beside_m < alone_m + 0.002, "{alone_m} {beside_m}");
}

#[test]
fn features_of_things_that_are_known_to_move_are_left_out() {
    let known = |time_s: f64| {
        vec![MovingThing {
            middle_in_map_m: walker_at(time_s).translation.vector.into(),
            half_extent_m: Vector3::new(0.6, 1.0, 0.3),
        }]
    };
    let (known_m, left_out) = rms_m(true, known);
    assert!(known_m < 0.01, "{known_m}");
    assert!(left_out > 3_000, "{left_out}");
    // Nothing of the room is left out: it is farther away.
    let (_, of_room) = rms_m(false, known);
    assert!(of_room < left_out / 20, "{of_room}");
}
