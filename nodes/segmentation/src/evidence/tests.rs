use super::*;

const EDGE_M: f64 = 0.08;

fn evidence() -> Evidence {
    Evidence::new(&EvidenceLimits {
        grid: VoxelGrid::new(EDGE_M).unwrap(),
        reach_m: 8.0,
        min_background_s: 1.0,
        max_voxels: 100_000,
    })
}

/// Cycles at 7 Hz that see `points`, all of them static.
fn look(evidence: &mut Evidence, first: i64, cycles: i64, points: &[Point3<f64>]) {
    for cycle in first..first + cycles {
        evidence.begin_cycle(Stamp::from_nanos(cycle * 143_000_000));
        evidence.record(&Point3::new(0.04, 0.04, 0.04), points, &vec![false; points.len()]);
    }
}

#[test]
fn what_a_ray_passed_is_free_and_where_it_ends_is_background() {
    let mut evidence = evidence();
    let wall = Point3::new(4.04, 0.04, 0.04);
    look(&mut evidence, 0, 20, &[wall]);
    assert_eq!(evidence.known(&wall), Known::Background);
    assert_eq!(evidence.known(&Point3::new(2.0, 0.04, 0.04)), Known::Free);
    // Beside the ray and behind its end nothing is known.
    assert_eq!(evidence.known(&Point3::new(2.0, 0.2, 0.04)), Known::Unknown);
    assert_eq!(evidence.known(&Point3::new(4.2, 0.04, 0.04)), Known::Unknown);
    // The ray stops before its end, since depth is noisy.
    assert_eq!(evidence.known(&Point3::new(3.96, 0.04, 0.04)), Known::Unknown);
    assert!(evidence.is_beside_surface(&Point3::new(3.96, 0.04, 0.04)));
    assert!(!evidence.is_beside_surface(&Point3::new(3.8, 0.04, 0.04)));
}

#[test]
fn background_takes_time_however_many_cycles() {
    let mut evidence = evidence();
    let wall = Point3::new(4.04, 0.04, 0.04);
    look(&mut evidence, 0, 5, &[wall]);
    assert_eq!(evidence.known(&wall), Known::Unknown);
}

/// Milliseconds of 32 bits stood still after 49 days, and nothing became background any more.
#[test]
fn background_is_learned_after_months_as_on_the_first_day() {
    const DAY_CYCLES: i64 = 24 * 3600 * 1000 / 143;
    let (wall, later_wall) = (Point3::new(4.04, 0.04, 0.04), Point3::new(4.04, 2.04, 0.04));
    for days in [20, 30, 60, 400] {
        let mut evidence = evidence();
        look(&mut evidence, 0, 20, &[wall]);
        let later = days * DAY_CYCLES;
        look(&mut evidence, later, 5, &[wall, later_wall]);
        assert_eq!(evidence.known(&wall), Known::Background, "{days} days");
        assert_eq!(evidence.known(&later_wall), Known::Unknown, "{days} days");
        look(&mut evidence, later + 5, 15, &[wall, later_wall]);
        assert_eq!(evidence.known(&later_wall), Known::Background, "{days} days");
    }
}

/// The moment at which the start is moved changes no age.
#[test]
fn what_was_seen_just_before_the_start_is_moved_is_as_old_as_it_is() {
    let mut evidence = evidence();
    let (wall, chair) = (Point3::new(4.04, 0.04, 0.04), Point3::new(2.04, 1.04, 0.04));
    evidence.begin_cycle(Stamp::from_nanos(0));
    let cycle = LONGEST_MS as i64 / 143;
    look(&mut evidence, cycle - 13, 10, &[chair]);
    look(&mut evidence, cycle - 3, 7, &[wall]);
    assert_eq!(evidence.known(&wall), Known::Unknown, "0.86 s");
    look(&mut evidence, cycle + 4, 1, &[wall]);
    assert_eq!(evidence.known(&wall), Known::Background, "1.001 s");
    let stay = evidence.stay(&chair).unwrap();
    assert!((stay.lasted_s - 9.0 * 0.143).abs() < 2e-3, "{stay:?}");
    let last_met = Stamp::from_nanos((cycle - 4) * 143_000_000);
    assert!(stay.last_met.seconds_since(last_met).abs() < 2e-3, "{stay:?}");
}

#[test]
fn moving_points_make_no_background_but_clear_what_they_are_seen_through() {
    let mut evidence = evidence();
    let object = Point3::new(2.04, 0.04, 0.04);
    for cycle in 0..20 {
        evidence.begin_cycle(Stamp::from_nanos(cycle * 143_000_000));
        evidence.record(&Point3::new(0.04, 0.04, 0.04), &[object], &[true]);
    }
    assert_eq!(evidence.known(&object), Known::Unknown);
    assert_eq!(evidence.known(&Point3::new(1.0, 0.04, 0.04)), Known::Free);
}

#[test]
fn what_goes_away_is_forgotten_and_what_stays_is_learned() {
    let mut evidence = evidence();
    let (chair, wall) = (Point3::new(2.04, 0.04, 0.04), Point3::new(4.04, 0.04, 0.04));
    look(&mut evidence, 0, 100, &[chair]);
    assert_eq!(evidence.known(&chair), Known::Background);
    look(&mut evidence, 100, 150, &[wall]);
    assert_eq!(evidence.known(&chair), Known::Free);
    look(&mut evidence, 250, 60, &[chair]);
    assert_eq!(evidence.known(&chair), Known::Background);
}

#[test]
fn adopted_places_are_background_at_once() {
    let mut evidence = evidence();
    let (bag, wall) = (Point3::new(2.04, 0.04, 0.04), Point3::new(4.04, 0.04, 0.04));
    look(&mut evidence, 0, 20, &[wall]);
    assert_eq!(evidence.known(&bag), Known::Free);
    evidence.adopt(&[bag]);
    assert_eq!(evidence.known(&bag), Known::Background);
    let last_met = evidence.stay(&bag).unwrap().last_met;
    assert!(last_met.seconds_since(Stamp::from_nanos(19 * 143_000_000)).abs() < 2e-3);
}

#[test]
fn a_stay_lasts_from_the_first_time_that_something_was_met_to_the_last() {
    let mut evidence = evidence();
    let (chair, beside) = (Point3::new(2.04, 0.04, 0.04), Point3::new(2.04, 1.04, 0.04));
    look(&mut evidence, 7, 5, &[chair]);
    assert_eq!(evidence.stay(&chair), None, "no background yet");
    look(&mut evidence, 12, 10, &[beside]);
    let stay = evidence.stay(&chair).unwrap();
    assert!((stay.lasted_s - 4.0 * 0.143).abs() < 2e-3, "{stay:?}");
    assert!(stay.last_met.seconds_since(Stamp::from_nanos(11 * 143_000_000)).abs() < 2e-3);
    evidence.forget(&chair);
    assert_eq!((evidence.stay(&chair), evidence.known(&chair)), (None, Known::Unknown));
    assert!(evidence.is_untouched(&chair));
}

#[test]
fn numbers_that_mean_nothing_do_no_harm_and_the_bound_holds() {
    let limits = EvidenceLimits {
        grid: VoxelGrid::new(0.01).unwrap(),
        reach_m: 8.0,
        min_background_s: 1.0,
        max_voxels: 500,
    };
    let mut evidence = Evidence::new(&limits);
    let strange = [f64::NAN, f64::INFINITY, -1e300, 1e7, 0.0];
    let points: Vec<_> =
        strange.iter().flat_map(|&x| strange.map(|y| Point3::new(x, y, 1.0))).collect();
    for cycle in [i64::MIN, 0, i64::MAX] {
        evidence.begin_cycle(Stamp::from_nanos(cycle));
        evidence.record(&Point3::origin(), &points, &vec![false; points.len()]);
        for x in strange {
            evidence.record(&Point3::new(x, 0.0, 0.0), &points, &vec![false; points.len()]);
        }
    }
    assert!(evidence.voxels() <= 500);
    for point in &points {
        let _ = (evidence.known(point), evidence.is_beside_surface(point), evidence.stay(point));
    }
}

/// Regression: one hit of the cycle before kept a place from being taken for free.
#[test]
fn a_place_that_is_taken_for_free_is_free_whatever_ended_there() {
    let mut evidence = evidence();
    let place = Point3::new(2.04, 0.04, 0.04);
    look(&mut evidence, 0, 2, &[place]);
    evidence.take_for_free([&place]);
    assert_eq!(evidence.known(&place), Known::Free);
}
