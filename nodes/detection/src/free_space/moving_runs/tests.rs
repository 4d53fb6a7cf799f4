use super::super::testing::{StaticPlatform, static_scan};
use super::*;

const SMALLEST_M: f64 = 0.08;

/// The runs, from the first beam to behind the last, of a scan of a wall at 6 m with these returns before it,
/// whose classes are given.
fn runs(before: &[(Range<usize>, f32, Option<ReturnClass>)]) -> Vec<(usize, usize)> {
    let mut ranges_m = vec![6.0_f32; 360];
    let mut classes = vec![Some(ReturnClass::Background); 360];
    for (beams, range_m, class) in before {
        ranges_m[beams.clone()].fill(*range_m);
        classes[beams.clone()].fill(*class);
    }
    let scan = static_scan(&StaticPlatform::default(), &ranges_m);
    moving_runs(&scan, &classes, 100..260, SMALLEST_M)
        .into_iter()
        .map(|run| (run.beams.start, run.beams.end))
        .collect()
}

fn moving(background_rate: f64) -> Option<ReturnClass> {
    Some(ReturnClass::InFreeSpace { background_rate })
}

#[test]
fn a_run_needs_evidence_and_the_width_of_an_object() {
    let nothing: Vec<(usize, usize)> = vec![];
    // At 3 m one beam may be a leg, at 1 m it is noise, whatever the evidence.
    assert_eq!(runs(&[(180..181, 3.0, moving(0.005))]), [(180, 181)]);
    assert_eq!(runs(&[(180..181, 1.0, moving(0.005))]), nothing);
    assert_eq!(runs(&[(180..183, 1.0, moving(0.005))]), nothing);
    assert_eq!(runs(&[(180..184, 1.0, moving(0.005))]), [(180, 184)]);
    // Three beams with little evidence count as much as one with a lot.
    assert_eq!(runs(&[(180..182, 3.0, moving(0.125))]), nothing);
    assert_eq!(runs(&[(180..183, 3.0, moving(0.125))]), [(180, 183)]);
}

#[test]
fn gaps_are_bridged_if_the_range_continues() {
    let sure = moving(0.01);
    // Four beams without a return at 2 m are 14 cm.
    let bridged = [(180..186, 2.0, sure), (186..190, f32::INFINITY, None), (190..196, 2.1, sure)];
    assert_eq!(runs(&bridged), [(180, 196)]);
    let parted = [(180..186, 2.0, sure), (186..191, f32::INFINITY, None), (191..196, 2.1, sure)];
    assert_eq!(runs(&parted), [(180, 190), (190, 196)]);
    // Two objects side by side at two depths are two.
    assert_eq!(runs(&[(180..186, 2.0, sure), (186..192, 3.0, sure)]), [(180, 186), (186, 192)]);
    // One beam past the object does not split it, two do.
    let one = [(180..186, 2.0, sure), (187..192, 2.0, sure)];
    assert_eq!(runs(&one), [(180, 192)]);
    assert_eq!(runs(&[(180..186, 2.0, sure), (188..193, 2.0, sure)]), [(180, 186), (188, 193)]);
}

#[test]
fn a_run_is_widened_over_its_own_surface_only() {
    let sure = moving(0.01);
    let unsure = Some(ReturnClass::Ambiguous);
    let same_surface = [(180..186, 2.0, sure), (186..189, 2.05, unsure)];
    assert_eq!(runs(&same_surface), [(180, 189)]);
    // A beam without a return may have hit it, up to 15 cm on.
    assert_eq!(runs(&[(180..186, 2.0, sure), (186..188, f32::INFINITY, None)]), [(180, 188)]);
    assert_eq!(runs(&[(180..186, 2.0, sure), (186..196, f32::INFINITY, None)]), [(180, 190)]);
    let other_surface = [(180..186, 2.0, sure), (186..189, 2.5, unsure)];
    assert_eq!(runs(&other_surface), [(180, 186)]);
}

#[test]
fn a_single_beam_between_two_surfaces_is_not_an_object() {
    let sure = moving(0.001);
    // An edge at 2 m, one mixed beam at 4 m, then the wall at 6 m.
    let mixed = [(170..180, 2.0, Some(ReturnClass::Background)), (180..181, 4.0, sure)];
    assert_eq!(runs(&mixed), vec![]);
    // The same beam before the wall on both sides.
    assert_eq!(runs(&[(180..181, 4.0, sure)]), [(180, 181)]);
}

#[test]
fn no_run_leaves_the_range_of_beams() {
    let sure = moving(0.001);
    assert_eq!(runs(&[(90..110, 2.0, sure), (250..300, 3.0, sure)]), [(100, 110), (250, 260)]);
}
