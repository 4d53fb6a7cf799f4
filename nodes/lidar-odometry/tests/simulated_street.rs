//! Pairs of simulated scans of a street, whose motion is known: up to 2 m and 5 degrees, from no guess.
// A test may stop where it stands, and says what it measured.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::num::NonZeroUsize;
use std::sync::Arc;

use estimation::{ScopedThreads, Serial};
use geometry::pose_vector;
use lidar_odometry::registration::{
    PreparationConfig, PreparedCloud, RegistrationConfig, register,
};
use nalgebra::{Isometry3, Point3, Vector3};
use simulator::{Path, Sample, Scenario, VelodyneModel};

/// Along the trajectory, in seconds; the motion of each pair: shift in metres, turn in degrees.
const PAIRS: [(f64, f64, f64); 5] =
    [(4.0, 0.5, 0.0), (9.0, 2.0, 1.0), (13.0, 1.0, -5.0), (20.0, 1.5, 3.0), (30.0, 2.0, -5.0)];

/// What a sensor that stands there sees.
fn scan(model: VelodyneModel, room_from_sensor: &Isometry3<f64>, seed: u64) -> PreparedCloud {
    let mut scenario = Scenario::road(model, seed).with_duration_s(0.11);
    scenario.rig.path = Path::still(pose_vector(room_from_sensor));
    let executor = ScopedThreads::new(NonZeroUsize::new(2).unwrap());
    let turn =
        scenario.samples().unwrap().with_executor(Arc::new(executor)).find_map(
            |sample| match sample {
                Sample::Velodyne(turn) => Some(turn),
                _ => None,
            },
        );
    let points_m: Vec<Point3<f32>> = turn
        .unwrap()
        .points
        .iter()
        .filter(|point| point.is_measured())
        .map(|point| Point3::from(point.position_m))
        .collect();
    PreparedCloud::new(&points_m, &PreparationConfig::default(), &executor).unwrap()
}

/// The medians over the pairs, in metres and degrees.
fn medians(model: VelodyneModel) -> (f64, f64) {
    let way = Scenario::road(model, 1).rig.path;
    let errors = PAIRS.map(|(at_s, shift_m, turn_deg)| {
        let from = way.pose_at(at_s);
        let turn = Vector3::new(0.0, 0.1, 1.0).normalize() * f64::to_radians(turn_deg);
        let motion = Isometry3::new(Vector3::new(1.0, 0.05, 0.02).normalize() * shift_m, turn);
        let (target, source) = (scan(model, &from, 1), scan(model, &(from * motion), 2));
        let config = RegistrationConfig::default();
        let found = register(&source, &target, &Isometry3::identity(), &config, &Serial).unwrap();
        let between = motion.inv_mul(&found.target_from_source);
        let error = (between.translation.vector.norm(), between.rotation.angle().to_degrees());
        println!(
            "{model:?} {shift_m} m {turn_deg} degrees: off {error:?}, {} steps",
            found.iterations
        );
        assert!(found.converged && found.observability.estimated() == 6);
        error
    });
    let median = |of: fn(&(f64, f64)) -> f64| {
        let mut sorted: Vec<f64> = errors.iter().map(of).collect();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    (median(|error| error.0), median(|error| error.1))
}

fn check(model: VelodyneModel) {
    let (metres, degrees) = medians(model);
    println!("{model:?}: median {metres:.4} m, {degrees:.4} degrees");
    assert!(metres < 0.01 && degrees < 0.05, "{model:?}: {metres} m, {degrees} degrees");
}

#[test]
fn pairs_of_64_rays_are_registered_to_a_centimetre() {
    check(VelodyneModel::Hdl64e);
}

#[test]
fn pairs_of_32_rays_are_registered_to_a_centimetre() {
    check(VelodyneModel::Hdl32e);
}

#[test]
fn pairs_of_16_rays_are_registered_to_a_centimetre() {
    check(VelodyneModel::Vlp16);
}
