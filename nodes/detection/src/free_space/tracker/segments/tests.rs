use super::super::super::testing::{StaticPlatform, static_scan};
use super::*;

const PERSON: Range<usize> = 100..104;

/// The segments of a person at 3 m before a wall at 6 m, with a surface at 1 m to the left, of which every return has
/// this class.
fn segments_beside(class: ReturnClass) -> Vec<Segment> {
    let mut ranges_m = [6.0; 360];
    ranges_m[PERSON].fill(3.0);
    ranges_m[PERSON.end..PERSON.end + 16].fill(1.0);
    let scan = static_scan(&StaticPlatform::default(), &ranges_m);
    let classes: Vec<_> = scan.beams.iter().map(|_| Some(class)).collect();
    segments(&scan, &classes, &[], 1)
}

/// Regression: a person who walked away behind a door frame was not found, since the frame is nearer.
#[test]
fn a_nearer_surface_at_one_side_may_hide_a_part() {
    let sides = |class| {
        let all = segments_beside(class);
        let person = all.iter().find(|segment| segment.beams == PERSON).unwrap();
        assert!(person.is_isolated);
        person.sighting.sides
    };
    assert_eq!(sides(ReturnClass::Background), [Side::Open, Side::BehindBackground]);
    assert_eq!(sides(ReturnClass::Unknown), [Side::Open, Side::BehindOther]);
}

#[test]
fn an_isolated_segment_and_the_runs_in_it_are_one() {
    let mut ranges_m = [6.0; 360];
    ranges_m[PERSON].fill(3.0);
    let scan = static_scan(&StaticPlatform::default(), &ranges_m);
    let classes = vec![Some(ReturnClass::Background); 360];
    let in_a_wall = 200..204;
    let all = segments(&scan, &classes, &[101..105, in_a_wall.clone()], 1);
    let beams: Vec<Range<usize>> = all.iter().map(|segment| segment.beams.clone()).collect();
    assert_eq!(beams, [PERSON.start..105, in_a_wall]);
    assert!(all[0].is_isolated && !all[1].is_isolated);
    assert!(all.iter().all(|segment| segment.sighting.space == Space::Free));
    let alone = segments(&scan, &classes, &[], 1);
    assert_eq!(alone.len(), 1);
    assert_eq!(alone[0].sighting.space, Space::Background);
}

/// The same of the centroid: a beam that passes between the legs would put it metres behind the person.
#[test]
fn a_beam_between_the_legs_does_not_move_the_centroid() {
    let mut ranges_m = [11.0; 360];
    ranges_m[PERSON].fill(1.4);
    ranges_m[PERSON.start + 1] = 11.0;
    let scan = static_scan(&StaticPlatform::default(), &ranges_m);
    let classes = vec![Some(ReturnClass::InFreeSpace { background_rate: 0.1 }); 360];
    let all = segments(&scan, &classes, &[PERSON], 1);
    let person = all.iter().find(|segment| segment.beams == PERSON).unwrap();
    assert_eq!(person.sighting.returns, PERSON.len() - 1);
    let range_m = distance(&person.sighting.platform_m, &person.sighting.centroid_m);
    assert!((range_m - 1.4).abs() < 0.05, "{range_m}");
}
