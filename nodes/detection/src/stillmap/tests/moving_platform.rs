use geometry::pose_from_vector;

use super::super::testing::{Dice, PERIOD_S, room};
use super::world::World;

/// Zones on the path of a platform: cycles, and cycles with a zone.
fn false_zones(seed: u64, noise: (f64, f64), pose_at: impl Fn(f64) -> [f64; 6]) -> (u32, u32) {
    let mut world = World::new(seed);
    let mut pose_dice = Dice::new(seed + 1000);
    let (mut cycles, mut false_cycles) = (0, 0);
    for cycle in 0..300_u32 {
        let vector = pose_at(f64::from(cycle) * PERIOD_S);
        let mut told = vector;
        told[0] += noise.0 * pose_dice.normal();
        told[1] += noise.0 * pose_dice.normal();
        told[3] += noise.1 * pose_dice.normal();
        let detected = world.step(&room(), &pose_from_vector(&vector), &pose_from_vector(&told));
        cycles += 1;
        if !detected.cycle.zones.is_empty() {
            false_cycles += 1;
            if std::env::var_os("SHOW").is_some() {
                println!("seed {seed} cycle {cycle} {vector:?}: {:?}", detected.cycle.zones);
            }
        }
    }
    (cycles, false_cycles)
}

/// To and fro at 0.5 m/s while turning to and fro at 0.5 rad/s.
fn to_and_fro(time_s: f64) -> [f64; 6] {
    let wave = |period_s: f64| {
        let phase = (time_s / period_s).fract();
        period_s * (0.5 - 2.0 * (phase - 0.5).abs()) * 0.5
    };
    [wave(8.0), 0.3 * wave(5.0), 0.0, 0.5 * wave(6.0) * 2.0, 0.0, 0.0]
}

#[test]
fn an_empty_room_has_no_zone_on_a_moving_platform() {
    for noise in [(0.0, 0.0), (0.01, 0.5_f64.to_radians())] {
        let (mut cycles, mut false_cycles) = (0, 0);
        for seed in 1..6 {
            let told = false_zones(seed, noise, to_and_fro);
            cycles += told.0;
            false_cycles += told.1;
        }
        println!("pose noise {noise:?}: {false_cycles} of {cycles} cycles have a zone");
        assert!(100 * false_cycles < cycles, "{false_cycles} of {cycles}");
    }
}
