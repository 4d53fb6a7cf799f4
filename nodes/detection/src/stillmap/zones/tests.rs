use super::super::testing::{StillPlatform, still_turn};
use super::*;

const BEAMS: usize = 360;
const OBJECT: Range<usize> = 178..184;

fn turn_of(object_m: f32) -> Turn {
    let mut ranges_m = vec![4.0_f32; BEAMS];
    ranges_m[OBJECT].fill(object_m);
    still_turn(&StillPlatform::default(), &ranges_m)
}

/// For how many cycles a zone is kept that was measured for `measured_cycles`, when nothing is seen any more.
fn kept_cycles(measured_cycles: u32, platform_moves: bool) -> usize {
    let mut keeper = ZoneKeeper::new(&DetectionConfig::default());
    let mut zones = |turn: &Turn, runs: &[MovingBeams]| {
        let unknown = vec![None; BEAMS];
        keeper.zones(turn, runs, &unknown, &(0..BEAMS), platform_moves)
    };
    for _ in 0..measured_cycles {
        let runs = [MovingBeams { beams: OBJECT, has_travelled: true }];
        assert_eq!(zones(&turn_of(2.0), &runs).len(), 1);
    }
    (0..20).take_while(|_| zones(&turn_of(f32::INFINITY), &[]).len() == 1).count()
}

/// Regression: a robot alone met a chair from one place in ten, and had a zone for a second each time.
#[test]
fn from_a_platform_that_moves_a_zone_is_kept_no_longer_than_it_was_measured() {
    let most = DetectionConfig::default().max_held_cycles;
    for measured_cycles in [1, 3, most, most + 5] {
        let kept = kept_cycles(measured_cycles, true);
        assert_eq!(kept, measured_cycles.min(most) as usize, "measured in {measured_cycles}");
        assert_eq!(kept_cycles(measured_cycles, false), most as usize);
    }
}
