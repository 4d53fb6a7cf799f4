use super::super::testing::{Scanner, room};
use super::world::World;

/// 4 seeds of 500 cycles for each noise: not one zone.
#[test]
fn an_empty_room_has_no_zone() {
    for noise_m in [0.01, 0.02, 0.03] {
        for seed in 1..5 {
            let mut world = World::new(seed);
            world.scanner = Scanner { noise_m, ..Scanner::A1 };
            world.look(&room(), 500);
        }
    }
}
