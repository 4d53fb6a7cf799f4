use super::super::testing::{StillPlatform, still_turn};
use super::*;

const BEAMS: usize = 360;
const OBJECT: Range<usize> = 178..184;

fn turn_of(object_m: f32) -> Turn {
    let mut ranges_m = vec![4.0_f32; BEAMS];
    ranges_m[OBJECT].fill(object_m);
    still_turn(&StillPlatform::default(), &ranges_m)
}

/// For how many cycles a zone is kept that was measured for `measured_cycles`, when all that is seen there is
/// `then_m` away, of which the evidence says `verdict`.
fn kept_cycles(
    measured_cycles: u32,
    platform_moves: bool,
    (then_m, verdict): (f32, Verdict),
) -> usize {
    let mut keeper = ZoneKeeper::new(&DetectionConfig::default());
    let mut zones = |turn: &Turn, runs: &[MovingBeams], verdict: Verdict| {
        let verdicts: Vec<_> = turn.beams.iter().map(|beam| beam.met.map(|_| verdict)).collect();
        let sight = Sight { turn, verdicts: &verdicts, within: &(0..BEAMS), platform_moves };
        keeper.zones(&sight, runs, &vec![None; BEAMS])
    };
    for _ in 0..measured_cycles {
        let runs = [MovingBeams { beams: OBJECT, has_travelled: true }];
        assert_eq!(zones(&turn_of(2.0), &runs, Verdict::Moving { static_rate: 0.1 }).len(), 1);
    }
    (0..20).take_while(|_| zones(&turn_of(then_m), &[], verdict).len() == 1).count()
}

const NOTHING: (f32, Verdict) = (f32::INFINITY, Verdict::Unseen);

/// Regression: a robot alone met a chair from one place in ten, and had a zone for a second each time.
#[test]
fn from_a_platform_that_moves_a_zone_is_kept_no_longer_than_it_was_measured() {
    let most = DetectionConfig::default().max_held_cycles;
    for measured_cycles in [1, 3, most, most + 5] {
        let kept = kept_cycles(measured_cycles, true, NOTHING);
        assert_eq!(kept, measured_cycles.min(most) as usize, "measured in {measured_cycles}");
        assert_eq!(kept_cycles(measured_cycles, false, NOTHING), most as usize);
    }
}

/// Regression: what was found to be background kept its zone as long as it was seen.
#[test]
fn from_a_platform_that_moves_a_zone_is_over_where_background_is_met_at_its_place() {
    let kept = |platform_moves, seen| kept_cycles(4, platform_moves, seen);
    assert_eq!(kept(true, (2.05, Verdict::Background)), 0);
    // One that is hidden, or of which nothing is known, may be there.
    assert_eq!(kept(true, (1.0, Verdict::Background)), 4);
    assert_eq!(kept(true, (2.05, Verdict::Unsure)), 4);
    // From a standing platform a foot that rests beside the wall is the object.
    assert_eq!(kept(false, (2.05, Verdict::Background)), 7);
    assert_eq!(kept(false, (4.0, Verdict::Background)), 0);
}
