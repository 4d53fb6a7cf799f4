use proptest::prelude::*;

use super::*;

const DEGREE_RAD: f64 = std::f64::consts::PI / 180.0;

/// 90 beams, the first at -45 degrees, with the deviations given as `(beam, deviation)` above a small
/// one.
fn deviations(raised: &[(usize, f32)]) -> Vec<f32> {
    let mut std_dev_m = vec![0.02; 90];
    for &(beam, deviation_m) in raised {
        std_dev_m[beam] = deviation_m;
    }
    std_dev_m
}

fn azimuths() -> Vec<f64> {
    (0..90).map(|beam| (f64::from(beam) - 45.0) * DEGREE_RAD).collect()
}

fn bounded_by(run_bound: RunBound) -> DetectionConfig {
    let rec_hv = crate::RecHvConfig { run_bound, ..crate::RecHvConfig::default() };
    DetectionConfig { rec_hv, ..DetectionConfig::default() }
}

fn finder() -> ZoneFinder {
    ZoneFinder::new(&DetectionConfig::default())
}

fn find(finder: &mut ZoneFinder, raised: &[(usize, f32)]) -> ZoneSearch {
    finder.find(&azimuths(), &deviations(raised))
}

/// The zone reaches from beam to beam, with the tolerance of one degree at each side.
#[track_caller]
fn check_beams(zone: Option<DynamicZone>, right: usize, left: usize) {
    let zone = zone.expect("a zone");
    let bounds_deg = (zone.azimuth_min_rad / DEGREE_RAD, zone.azimuth_max_rad / DEGREE_RAD);
    let expected_deg = (right as f64 - 46.0, left as f64 - 44.0);
    assert!(
        (bounds_deg.0 - expected_deg.0).abs() < 1e-9
            && (bounds_deg.1 - expected_deg.1).abs() < 1e-9,
        "{bounds_deg:?} is not {expected_deg:?}"
    );
}

#[test]
fn the_two_largest_peaks_bound_the_zone() {
    let search = find(&mut finder(), &[(30, 0.5), (31, 0.57), (40, 0.48), (41, 0.55), (42, 0.4)]);
    check_beams(search.zone, 31, 41);
    assert_eq!(search.zone.unwrap().source, ZoneSource::Measured);
    assert_eq!(search.zone.unwrap().peak_std_dev_m, 0.57);
    assert_eq!((search.max_std_dev_m, search.high_variability_beams), (Some(0.57), 5));
    assert_eq!(search.unmeasured, None);
}

#[test]
fn the_zone_is_equation_5_with_the_tolerance() {
    let zone = find(&mut finder(), &[(30, 0.6), (40, 0.6)]).zone.unwrap();
    // theta_min = 45 degrees from the y axis; alpha grows to the right, against the azimuth.
    let (alpha_1_rad, alpha_2_rad) = zone.alphas_rad();
    assert!((alpha_1_rad / DEGREE_RAD - (90.0 + 5.0 - 1.0)).abs() < 1e-9);
    assert!((alpha_2_rad / DEGREE_RAD - (90.0 + 15.0 + 1.0)).abs() < 1e-9);
}

#[test]
fn outer_ends_bound_the_zone_if_so_configured() {
    let config = bounded_by(RunBound::OuterEnd);
    let raised = [(29, 0.5), (30, 0.6), (31, 0.5), (40, 0.5), (41, 0.6), (42, 0.5)];
    let search = ZoneFinder::new(&config).find(&azimuths(), &deviations(&raised));
    check_beams(search.zone, 29, 42);
}

#[test]
fn of_equal_peaks_the_outer_one_bounds() {
    check_beams(
        find(&mut finder(), &[(29, 0.6), (30, 0.6), (40, 0.6), (41, 0.6)]).zone, //
        29,
        41,
    );
}

#[test]
fn at_the_minimum_nothing_moves_and_just_above_it_does() {
    let quiet = find(&mut finder(), &[(30, 0.4), (40, 0.4)]);
    assert_eq!(quiet.zone, None);
    assert_eq!(
        quiet.unmeasured,
        Some(Unmeasured::Quiet { max_std_dev_m: 0.4, min_std_dev_m: 0.4 })
    );
    check_beams(find(&mut finder(), &[(30, 0.401), (40, 0.401)]).zone, 30, 40);
}

#[test]
fn half_of_the_largest_deviation_is_not_high_variability() {
    // 0.5 is exactly half of 1.0: only one peak is left, which bounds no zone.
    let search = find(&mut finder(), &[(30, 1.0), (40, 0.5)]);
    assert_eq!((search.zone, search.high_variability_beams), (None, 1));
    assert_eq!(search.unmeasured, Some(Unmeasured::Unbounded { beams: 1 }));
    check_beams(find(&mut finder(), &[(30, 1.0), (40, 0.501)]).zone, 30, 40);
}

#[test]
fn a_single_run_bounds_a_zone_with_three_beams_and_not_with_two() {
    check_beams(find(&mut finder(), &[(0, 0.7), (1, 0.6), (2, 0.6)]).zone, 1, 2);
    check_beams(find(&mut finder(), &[(10, 0.5), (11, 0.6), (12, 0.5)]).zone, 10, 12);
    assert_eq!(find(&mut finder(), &[(10, 0.6), (11, 0.6)]).zone, None);
}

#[test]
fn a_run_between_the_largest_divides_the_zone_and_the_longest_run_decides() {
    let raised = [(20, 1.0), (30, 0.6), (50, 0.9), (51, 0.9), (52, 0.9)];
    check_beams(find(&mut finder(), &raised).zone, 30, 52);
}

#[test]
fn the_candidate_nearest_to_the_previous_zone_is_taken() {
    let raised = [(20, 1.0), (30, 0.6), (50, 0.9), (51, 0.9), (52, 0.9)];
    let mut finder = finder();
    check_beams(find(&mut finder, &[(18, 0.8), (27, 0.8)]).zone, 18, 27);
    check_beams(find(&mut finder, &raised).zone, 20, 30);
}

#[test]
fn a_cycle_without_motion_holds_the_previous_zone_with_its_width() {
    let mut finder = finder();
    find(&mut finder, &[(30, 0.6), (40, 0.5)]);
    for cycles in 1..=DetectionConfig::default().max_held_cycles {
        let zone = find(&mut finder, &[]).zone;
        check_beams(zone, 30, 40);
        assert_eq!(zone.unwrap().source, ZoneSource::Held { cycles });
        assert_eq!(zone.unwrap().peak_std_dev_m, 0.6);
    }
    assert_eq!(find(&mut finder, &[]).zone, None);
    // It is forgotten, and not held again by a later cycle.
    assert_eq!(find(&mut finder, &[(60, 0.6)]).zone, None);
}

#[test]
fn the_largest_run_widens_a_held_zone() {
    let mut finder = finder();
    find(&mut finder, &[(30, 0.6), (40, 0.6)]);
    check_beams(find(&mut finder, &[(42, 0.6), (43, 0.6)]).zone, 28, 42);
    check_beams(find(&mut finder, &[(44, 0.6)]).zone, 27, 43);
}

#[test]
fn a_measurement_ends_holding() {
    let mut finder = finder();
    find(&mut finder, &[(30, 0.6), (40, 0.6)]);
    find(&mut finder, &[]);
    let zone = find(&mut finder, &[(32, 0.6), (42, 0.6)]).zone;
    check_beams(zone, 32, 42);
    assert_eq!(zone.unwrap().source, ZoneSource::Measured);
}

#[test]
fn a_cycle_without_deviations_holds_too() {
    let mut finder = finder();
    let why = Unmeasured::TooFewReturns { returns: 1 };
    assert_eq!(finder.hold(why, 0.0).zone, None);
    find(&mut finder, &[(30, 0.6), (40, 0.6)]);
    let search = finder.hold(why, 0.0);
    check_beams(search.zone, 30, 40);
    assert_eq!(search.unmeasured, Some(why));
    finder.clear();
    assert_eq!(finder.hold(why, 0.0).zone, None);
}

#[test]
fn the_tolerance_does_not_leave_the_aperture() {
    let zone = find(&mut finder(), &[(0, 0.6), (89, 0.6)]).zone.unwrap();
    assert!((zone.azimuth_min_rad / DEGREE_RAD + 45.0).abs() < 1e-9);
    assert!((zone.azimuth_max_rad / DEGREE_RAD - 45.0).abs() < 1e-9);
}

#[test]
fn a_scan_without_beams_has_no_zone() {
    let search = finder().find(&[], &[]);
    assert!(matches!(search.unmeasured, Some(Unmeasured::Quiet { .. })));
}

/// Only the largest deviation of the cycle must exceed the minimum, not those that bound the zone.
#[test]
fn the_candidate_near_the_previous_zone_may_have_smaller_deviations() {
    let mut finder = ZoneFinder::new(&DetectionConfig::default());
    find(&mut finder, &[(1, 1.6), (44, 0.9)]);
    let zone = find(&mut finder, &[(1, 0.6), (3, 0.34), (5, 0.39)]).zone.unwrap();
    assert_eq!((zone.source, zone.peak_std_dev_m), (ZoneSource::Measured, 0.39));
}

proptest! {
    #[test]
    fn every_zone_is_within_the_aperture_and_the_right_way_round(
        cycles in prop::collection::vec(
            prop::collection::vec((0usize..90, 0.0f32..2.0), 0..12),
            1..20,
        ),
        outer_end in any::<bool>(),
    ) {
        let run_bound = if outer_end { RunBound::OuterEnd } else { RunBound::Peak };
        let config = bounded_by(run_bound);
        let mut finder = ZoneFinder::new(&config);
        for raised in &cycles {
            let search = find(&mut finder, raised);
            let Some(zone) = search.zone else { continue };
            let half_rad = 0.5 * config.aperture_rad;
            prop_assert!(zone.azimuth_min_rad >= -half_rad && zone.azimuth_max_rad <= half_rad);
            prop_assert!(zone.azimuth_min_rad < zone.azimuth_max_rad);
            let is_measured = zone.source == ZoneSource::Measured;
            prop_assert_eq!(is_measured, search.unmeasured.is_none());
            if is_measured {
                // The candidate nearest to the previous zone need not hold the cycle's largest deviation,
                // but its bounds are of high variability: above half of it.
                let least_m = config.rec_hv.high_variability_share * config.min_std_dev_m;
                prop_assert!(f64::from(zone.peak_std_dev_m) > least_m);
            }
        }
    }
}
