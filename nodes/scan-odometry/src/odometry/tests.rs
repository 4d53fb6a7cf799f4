mod any_input;
mod degenerate;
mod driving;
mod lost;
mod standing;
mod uncertainty;

use nalgebra::{Isometry2, Vector2};

use crate::testing::Found;

/// Metres and degrees.
fn shift_and_turn(error: &Isometry2<f64>) -> (f64, f64) {
    (error.translation.vector.norm(), error.rotation.angle().abs().to_degrees())
}

/// The largest errors over a run.
fn worst(found: &[Found]) -> (f64, f64) {
    found
        .iter()
        .map(|one| shift_and_turn(&one.error()))
        .fold((0.0, 0.0), |most, (shift, turn)| (f64::max(most.0, shift), f64::max(most.1, turn)))
}

/// The error at the end.
fn end(found: &[Found]) -> (f64, f64) {
    shift_and_turn(&found.last().unwrap().error())
}

fn assert_within(what: &str, (shift_m, turn_deg): (f64, f64), most: (f64, f64)) {
    println!("{what}: {:.2} mm, {turn_deg:.3} degrees", 1000.0 * shift_m);
    assert!(shift_m < most.0 && turn_deg < most.1, "{what}: {shift_m} m, {turn_deg} degrees");
}

fn standing(_: f64) -> Isometry2<f64> {
    Isometry2::new(Vector2::new(0.5, -0.3), 0.2)
}

/// Rounds of 1 m around the room's middle at 0.5 m/s, and so at 0.5 rad/s.
fn circling(time_s: f64) -> Isometry2<f64> {
    let turn_rad = 0.5 * time_s;
    Isometry2::new(Vector2::new(turn_rad.sin(), -turn_rad.cos()), turn_rad)
}
