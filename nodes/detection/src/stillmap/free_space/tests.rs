use super::super::testing::{StillPlatform, still_turn};
use super::*;

fn evidence() -> FreeSpace {
    FreeSpace::new(&StillmapConfig::default())
}

/// Takes in `cycles` turns with these ranges, from time `from_ms` on.
fn see(evidence: &mut FreeSpace, ranges_m: &[f32], from_ms: u32, cycles: u32) {
    let turn = still_turn(&StillPlatform::default(), ranges_m);
    for cycle in 0..cycles {
        evidence.center_on(&turn.beams[0].origin_m);
        evidence.take_in(&turn, &[Met::Background; 360], from_ms + cycle * 100);
    }
}

fn verdict(evidence: &FreeSpace, beam: usize, range_m: f32, now_ms: u32) -> Verdict {
    let mut ranges_m = vec![f32::INFINITY; 360];
    ranges_m[beam] = range_m;
    let turn = still_turn(&StillPlatform::default(), &ranges_m);
    evidence.judge(&turn.beams[beam].met.unwrap(), now_ms)
}

#[test]
fn what_ends_in_space_seen_free_is_moving_and_what_ends_at_the_wall_is_not() {
    let mut evidence = evidence();
    let wall_m = vec![4.0_f32; 360];
    see(&mut evidence, &wall_m, 1, 2);
    // Two cycles are too few.
    assert_eq!(verdict(&evidence, 180, 2.0, 300), Verdict::Unseen);
    see(&mut evidence, &wall_m, 201, 10);
    for beam in 0..360 {
        for range_m in [0.3, 1.0, 2.0, 3.0, 3.6] {
            let verdict = verdict(&evidence, beam, range_m, 1300);
            assert!(
                matches!(verdict, Verdict::Moving { static_rate } if static_rate < 0.1),
                "{beam} {range_m}"
            );
        }
        assert_eq!(verdict(&evidence, beam, 4.0, 1300), Verdict::Background, "{beam}");
        for range_m in [3.9, 4.1] {
            let verdict = verdict(&evidence, beam, range_m, 1300);
            assert!(!matches!(verdict, Verdict::Moving { .. }), "{beam} {range_m}");
        }
        // Behind the wall nothing was seen.
        assert_eq!(verdict(&evidence, beam, 5.0, 1300), Verdict::Unseen);
    }
}

#[test]
fn a_beam_without_a_return_shows_nothing() {
    let mut evidence = evidence();
    let mut ranges_m = vec![4.0_f32; 360];
    ranges_m[170..190].fill(f32::INFINITY);
    see(&mut evidence, &ranges_m, 1, 20);
    assert_eq!(verdict(&evidence, 180, 2.0, 2100), Verdict::Unseen);
    assert!(matches!(verdict(&evidence, 150, 2.0, 2100), Verdict::Moving { .. }));
}

#[test]
fn beside_an_object_nothing_is_sure() {
    let mut evidence = evidence();
    let mut ranges_m = vec![4.0_f32; 360];
    ranges_m[175..185].fill(2.0);
    see(&mut evidence, &ranges_m, 1, 20);
    // The first beam past the object, at the object's depth and behind, is worn off.
    assert_eq!(verdict(&evidence, 185, 2.6, 2100), Verdict::Unseen);
    assert!(matches!(verdict(&evidence, 188, 2.6, 2100), Verdict::Moving { .. }));
}

#[test]
fn evidence_leaves_with_the_window_and_with_time() {
    let mut evidence = evidence();
    see(&mut evidence, &[4.0; 360], 1, 20);
    assert_eq!(verdict(&evidence, 180, 2.0, 130_000), Verdict::Unseen);
    evidence.center_on(&Point2::new(30.0, 0.0));
    evidence.center_on(&Point2::new(0.3, -0.2));
    assert_eq!(verdict(&evidence, 180, 2.0, 2100), Verdict::Unseen);
}
