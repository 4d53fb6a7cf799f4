use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::observability::{Coordinate, share};
use crate::testing::Random;

/// No coordinate is held.
const NONE: [bool; 6] = [false; 6];

/// Distances of returns at `lever_m` from planes with these normals, left by a correction that is not yet applied.
fn observation(
    lever_m: Vector3<f64>,
    normal: Vector3<f64>,
    correction: &Vector6<f64>,
    error_m: f64,
    group: usize,
) -> Observation {
    let by_turn = lever_m.cross(&normal);
    let jacobian = Vector6::new(normal.x, normal.y, normal.z, by_turn.x, by_turn.y, by_turn.z);
    let distance_m = error_m - jacobian.dot(correction);
    let linearised = Linearised { distance_m, jacobian, lever_m, normal };
    Observation { linearised, std_dev_m: 0.02, normal_std_dev_rad: 0.02, group }
}

/// A scan of the walls of a room: ahead, aside if requested, and the floor if requested.
fn room(
    correction: &Vector6<f64>,
    faces_sideways: bool,
    has_floor: bool,
    noise: &mut Random,
) -> Vec<Observation> {
    (0..600)
        .map(|index| {
            let beam = index % 60;
            let azimuth_rad = f64::from(beam as i32 - 30).to_radians();
            let lever_m = Vector3::new(4.0, 4.0 * azimuth_rad.tan(), 0.0);
            let normal = match beam {
                0..12 if faces_sideways => Vector3::y(),
                48..60 if has_floor => Vector3::z(),
                _ => Vector3::x(),
            };
            // The fitted normal is off by a degree and a half at random.
            let tilt = Vector3::new(noise.normal(), noise.normal(), noise.normal()) * 0.025;
            let fitted = Rotation3::new(tilt) * normal;
            let error_m = 0.02 * noise.normal();
            let mut one = observation(lever_m, fitted, correction, error_m, beam);
            // The distance is that from the true plane: the patch lies where it lies.
            one.linearised.distance_m =
                observation(lever_m, normal, correction, error_m, beam).linearised.distance_m;
            one
        })
        .collect()
}

fn fitted(observations: &[Observation]) -> Fit {
    fit(observations, &Vector6::zeros(), NONE, &CalibrationConfig::default()).unwrap()
}

#[test]
fn directions_that_the_walls_determine_are_found_and_the_rest_is_held() {
    let truth = Vector6::new(0.04, -0.03, 0.02, 0.01, -0.02, 0.03);
    for (faces_sideways, has_floor, held) in [
        (true, false, vec![Coordinate::Z, Coordinate::Roll, Coordinate::Pitch]),
        (false, false, vec![Coordinate::Y, Coordinate::Z, Coordinate::Roll, Coordinate::Pitch]),
    ] {
        // What is held is in truth as it was: what it costs otherwise is another question.
        let mut truth = truth;
        for coordinate in &held {
            truth[*coordinate as usize] = 0.0;
        }
        let observations = room(&truth, faces_sideways, has_floor, &mut Random::new(1));
        let fit = fitted(&observations);
        for coordinate in Coordinate::ALL {
            let index = coordinate as usize;
            let share = share(&fit.observability, coordinate);
            if held.contains(&coordinate) {
                assert!(share < 1e-12 && fit.total[index].abs() < 1e-12, "{coordinate}: {share}");
            } else {
                let std_dev = fit.covariance[(index, index)].sqrt();
                let off = (fit.total[index] - truth[index]).abs();
                assert!(share > 0.95 && off < 3.5 * std_dev, "{coordinate}: {off} {std_dev}");
            }
        }
    }
}

/// With a floor nothing is held but what it leaves open, and the floor's own height is found.
#[test]
fn a_floor_determines_the_height() {
    let truth = Vector6::new(0.02, 0.01, -0.015, 0.0, 0.0, 0.01);
    let fit = fitted(&room(&truth, true, true, &mut Random::new(2)));
    assert!(fit.observability.estimated() > 3);
    assert!(share(&fit.observability, Coordinate::X) > 0.95);
}

/// Random normals alone would seem to determine the height to a centimetre.
#[test]
fn normals_that_scatter_determine_nothing_by_themselves() {
    let observations = room(&Vector6::zeros(), false, false, &mut Random::new(3));
    // Required: 4.5 cm and 4.5 degrees.
    let usual = CalibrationConfig {
        max_std_dev_m: 0.045,
        max_std_dev_rad: 4.5_f64.to_radians(),
        ..CalibrationConfig::default()
    };
    let careless = CalibrationConfig { normal_noise_rad: 0.0, ..usual };
    let blind: Vec<Observation> =
        observations.iter().map(|one| Observation { normal_std_dev_rad: 0.0, ..*one }).collect();
    let fooled = fit(&blind, &Vector6::zeros(), NONE, &careless).unwrap();
    let careful = fit(&observations, &Vector6::zeros(), NONE, &usual).unwrap();
    assert!(fooled.observability.estimated() > careful.observability.estimated());
    assert_eq!(careful.observability.estimated(), 2);
}

#[test]
fn outliers_have_no_weight() {
    let truth = Vector6::new(0.05, 0.02, 0.0, 0.0, 0.0, 0.02);
    let mut observations = room(&truth, true, false, &mut Random::new(4));
    for (index, one) in observations.iter_mut().enumerate() {
        if index % 4 == 0 {
            one.linearised.distance_m += 0.25;
        }
    }
    let fit = fitted(&observations);
    for index in [0, 1, 5] {
        let off = (fit.total[index] - truth[index]).abs();
        assert!(off < 4.0 * fit.covariance[(index, index)].sqrt(), "{index}: {off}");
    }
    let unused = fit.weights.iter().filter(|weight| **weight == 0.0).count();
    assert!((140..170).contains(&unused), "{unused}");
}

/// Over many draws the squared error is as large as the covariance says: on average one for each coordinate.
#[test]
fn the_covariance_is_that_of_the_errors() {
    let truth = Vector6::new(0.03, -0.02, 0.0, 0.0, 0.0, 0.02);
    let draws = 60;
    let mut sum = 0.0;
    for draw in 0..draws {
        let fit = fitted(&room(&truth, true, false, &mut Random::new(100 + draw)));
        let chosen = [0, 1, 5];
        let covariance =
            nalgebra::Matrix3::from_fn(|row, column| fit.covariance[(chosen[row], chosen[column])]);
        let error = Vector3::from_fn(|row, _| fit.total[chosen[row]] - truth[chosen[row]]);
        sum += error.dot(&(covariance.try_inverse().unwrap() * error));
    }
    // 3 +- 0.32 by chance; the excess of groups, which is at least 1, makes it less.
    let mean = sum / draws as f64;
    assert!((1.9..4.0).contains(&mean), "{mean} where 3 is expected");
}

/// Errors that all returns of a beam share do not average out, and the covariance says so.
#[test]
fn errors_that_beams_share_make_the_estimate_less_sure() {
    let mut noise = Random::new(9);
    let mut observations = room(&Vector6::zeros(), true, false, &mut noise);
    let alone = fitted(&observations);
    let of_beam_m: Vec<f64> = (0..60).map(|_| 0.02 * noise.normal()).collect();
    for one in &mut observations {
        one.linearised.distance_m += of_beam_m[one.group];
    }
    let shared = fitted(&observations);
    let ratio = shared.covariance[(0, 0)] / alone.covariance[(0, 0)];
    // Ten returns a beam: 2 cm that do not average out, where 2 cm did.
    assert!((5.0..20.0).contains(&ratio), "{ratio}");
}

#[test]
fn nothing_comes_of_nothing() {
    let config = CalibrationConfig::default();
    assert!(fit(&[], &Vector6::zeros(), NONE, &config).is_none());
    let few = room(&Vector6::zeros(), true, false, &mut Random::new(5));
    let strict = CalibrationConfig { max_std_dev_m: 1e-6, max_std_dev_rad: 1e-6, ..config };
    assert!(fit(&few[..3], &Vector6::zeros(), NONE, &strict).is_none());
}

/// What was applied already counts as found: the total is from the start.
#[test]
fn a_correction_that_is_applied_is_part_of_the_total() {
    let truth = Vector6::new(0.03, 0.02, 0.0, 0.0, 0.0, 0.01);
    let at_start = fitted(&room(&truth, true, false, &mut Random::new(6)));
    let observations = room(&Vector6::zeros(), true, false, &mut Random::new(6));
    let applied = fit(&observations, &truth, NONE, &CalibrationConfig::default()).unwrap();
    assert!((applied.total - at_start.total).norm() < 2e-3, "{} {}", applied.total, at_start.total);
}
