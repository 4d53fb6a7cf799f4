use geometry::Scan;
use nalgebra::Isometry3;

use super::super::testing::{Wall, cuboid, room};
use super::world::World;

/// The walker is nearer; beyond, a beam that misses the leg of a table hits the wall.
const FARTHEST_M: f32 = 2.8;

/// A body, and a foot beside it that is too narrow to be an object by itself.
fn walker(x_m: f64, y_m: f64) -> Vec<Wall> {
    let mut walls = room();
    walls.extend(cuboid([x_m, y_m], [0.4, 0.4]));
    walls.extend(cuboid([x_m, y_m + 0.55], [0.03, 0.03]));
    walls
}

#[test]
fn the_beams_that_hit_what_moves_are_moving_beams_in_all_directions_and_no_others() {
    let pose = Isometry3::identity();
    for x_m in [2.0, -1.2] {
        let mut world = World::new(5);
        world.look(&room(), 20);
        let scan = |world: &mut World, walls: &[Wall]| -> Scan {
            world.scanner.scan(walls, &pose, world.cycle, &mut world.dice)
        };
        let empty = scan(&mut world, &room());
        let (mut hit, mut found, mut others, mut behind) = (0, 0, 0, 0);
        for cycle in 0..20 {
            let scan = scan(&mut world, &walker(x_m, 0.1 * f64::from(cycle) - 1.0));
            let detected = world.step_with(&scan, &pose);
            let moving = detected.cycle.moving_beams;
            assert!(moving.is_sorted_by_key(|beam| beam.index));
            for index in 0..scan.ranges_m.len() {
                let (now_m, wall_m) = (scan.measured_range_m(index), empty.measured_range_m(index));
                let (Some(now_m), Some(wall_m)) = (now_m, wall_m) else { continue };
                let known = moving.iter().find(|beam| beam.index as usize == index);
                if now_m > wall_m - 0.3 || now_m > FARTHEST_M {
                    others += usize::from(known.is_some());
                    continue;
                }
                hit += 1;
                found += usize::from(known.is_some());
                let background_m = known.and_then(|beam| beam.background_m);
                behind += usize::from(background_m.is_some_and(|m| (m - wall_m).abs() < 0.2));
            }
        }
        assert!(hit > 200 && others == 0, "{x_m}: {hit} hits, {others} others");
        assert!(found as f64 > 0.97 * hit as f64, "{x_m}: {found} of {hit}");
        assert!(behind as f64 > 0.8 * hit as f64, "{x_m}: {behind} of {hit}");
    }
}

/// The share of a pole's returns that are moving beams while a walker passes it so closely that both are one segment; nothing else
/// is in sight. The pole appears so many cycles before.
fn share_of_pole(cycles_before: u32) -> f64 {
    const STEP_M: f64 = 0.12;
    const POLE_Y_M: f64 = 0.84;
    const PASSES: u32 = 14;
    let pose = Isometry3::identity();
    let mut world = World::new(3);
    world.scanner.dropouts = 0.0;
    let (mut hit, mut found) = (0, 0);
    for cycle in 0..PASSES + 3 {
        let walker_y_m = -1.4 + STEP_M * f64::from(cycle);
        let mut walls = cuboid([2.0, walker_y_m], [0.3, 0.3]);
        if cycle + cycles_before >= PASSES {
            walls.extend(cuboid([2.0, POLE_Y_M], [0.12, 0.12]));
        }
        let scan = world.scanner.scan(&walls, &pose, world.cycle, &mut world.dice);
        let moving = world.step_with(&scan, &pose).cycle.moving_beams;
        if cycle < PASSES {
            continue;
        }
        for index in 0..scan.ranges_m.len() {
            let Some(range_m) = scan.measured_range_m(index) else { continue };
            let y_m = f64::from(range_m) * scan.azimuth_rad(index).sin();
            if y_m > walker_y_m + 0.2 && y_m > POLE_Y_M - 0.1 {
                hit += 1;
                found += usize::from(moving.iter().any(|beam| beam.index as usize == index));
            }
        }
    }
    f64::from(found as u32) / f64::from(hit)
}

#[test]
fn a_leg_that_was_background_for_a_cycle_moves_with_its_person_and_a_pole_that_stood_there_does_not()
 {
    let (leg, pole) = (share_of_pole(1), share_of_pole(14));
    assert!(leg > 0.3 && pole == 0.0, "{leg} of the leg, {pole} of the pole");
}
