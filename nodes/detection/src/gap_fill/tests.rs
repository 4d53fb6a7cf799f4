use proptest::prelude::*;

use super::*;

const A1: RangeLimits = RangeLimits { min_m: 0.15, max_m: 8.0 };
const GAP: f32 = f32::INFINITY;

/// Beams one degree apart, the first at `first_deg`; infinite ranges are gaps.
fn beams(first_deg: f64, ranges_m: &[f32]) -> Vec<Beam> {
    ranges_m
        .iter()
        .enumerate()
        .map(|(index, range_m)| Beam {
            index,
            azimuth_rad: (first_deg + index as f64).to_radians(),
            range_m: range_m.is_finite().then_some(*range_m),
        })
        .collect()
}

fn check_filled(first_deg: f64, ranges_m: &[f32], expected_m: &[f32]) {
    let filled = fill_gaps(&beams(first_deg, ranges_m), A1).unwrap();
    assert_eq!(filled.ranges_m.len(), expected_m.len());
    for (got, expected) in filled.ranges_m.iter().zip(expected_m) {
        // The thesis prints millimetres, of ranges that it had rounded for print.
        assert!((got - expected).abs() < 1.1e-3, "{:?} is not {expected_m:?}", filled.ranges_m);
    }
    for (range_m, filled) in ranges_m.iter().zip(&filled.is_filled) {
        assert_eq!(!range_m.is_finite(), *filled);
    }
}

#[test]
fn table_4_a_interpolation() {
    check_filled(
        91.0,
        &[3.697, GAP, 2.889, 2.891, GAP, GAP, GAP, GAP, GAP, 3.722],
        &[3.697, 3.293, 2.889, 2.891, 3.030, 3.168, 3.306, 3.445, 3.583, 3.722],
    );
}

#[test]
fn table_4_b_extrapolation_at_the_end() {
    check_filled(
        126.0,
        &[4.502, 4.576, GAP, GAP, GAP, GAP, GAP, GAP, GAP, GAP],
        &[4.502, 4.576, 4.650, 4.724, 4.798, 4.872, 4.946, 5.020, 5.094, 5.168],
    );
}

#[test]
fn the_start_is_extrapolated_from_the_first_two_returns() {
    check_filled(45.0, &[GAP, GAP, 3.0, 3.1, 9.9], &[2.8, 2.9, 3.0, 3.1, 9.9]);
}

#[test]
fn the_nearest_returns_need_not_be_neighbours() {
    check_filled(0.0, &[GAP, 3.0, GAP, 3.2, GAP], &[2.9, 3.0, 3.1, 3.2, 3.3]);
}

#[test]
fn an_extrapolation_stays_within_the_limits_of_the_scanner() {
    check_filled(0.0, &[1.0, 0.5, GAP, GAP, GAP], &[1.0, 0.5, 0.15, 0.15, 0.15]);
    check_filled(0.0, &[GAP, GAP, 7.9, 7.7], &[8.0, 8.0, 7.9, 7.7]);
}

#[test]
fn two_returns_of_one_azimuth_give_a_level_line() {
    let mut beams = beams(0.0, &[2.0, 3.0, GAP]);
    beams[1].azimuth_rad = beams[0].azimuth_rad;
    assert_eq!(fill_gaps(&beams, A1).unwrap().ranges_m, [2.0, 3.0, 2.5]);
}

#[test]
fn fewer_than_two_returns_are_an_error() {
    assert_eq!(fill_gaps(&[], A1), Err(TooFewReturns { returns: 0 }));
    assert_eq!(fill_gaps(&beams(0.0, &[GAP, GAP]), A1), Err(TooFewReturns { returns: 0 }));
    assert_eq!(fill_gaps(&beams(0.0, &[GAP, 2.0]), A1), Err(TooFewReturns { returns: 1 }));
}

proptest! {
    #[test]
    fn measured_beams_stay_and_every_range_is_within_the_limits(
        ranges_m in prop::collection::vec(prop::option::of(0.15f32..=8.0), 0..120),
        spacing_rad in prop_oneof![Just(0.0), Just(1e-300), 1e-9..0.1f64],
    ) {
        let beams: Vec<Beam> = ranges_m
            .iter()
            .enumerate()
            .map(|(index, range_m)| Beam {
                index,
                azimuth_rad: index as f64 * spacing_rad,
                range_m: *range_m,
            })
            .collect();
        let returns = ranges_m.iter().flatten().count();
        match fill_gaps(&beams, A1) {
            Err(error) => prop_assert!(returns < 2 && error.returns == returns),
            Ok(filled) => {
                prop_assert!(returns >= 2);
                prop_assert_eq!(filled.filled_beams(), beams.len() - returns);
                for (range_m, measured_m) in filled.ranges_m.iter().zip(&ranges_m) {
                    prop_assert!((A1.min_m..=A1.max_m).contains(range_m), "{}", range_m);
                    if let Some(measured_m) = measured_m {
                        prop_assert_eq!(range_m, measured_m);
                    }
                }
            }
        }
    }
}
