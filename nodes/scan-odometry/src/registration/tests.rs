use proptest::prelude::*;

use super::*;
use crate::local_line::local_lines;
use crate::local_map::Moment;
use crate::scan_returns::ScanReturns;
use crate::testing::{Random, Scanner, World};

fn config() -> ScanOdometryConfig {
    ScanOdometryConfig::default()
}

/// A map of one scan taken at `map_from`, and another scan taken at `scan_from`.
struct Case {
    map: LocalMap,
    turn: ScanReturns,
}

impl Case {
    fn new(world: &World, map_from: &Isometry2<f64>, scan_from: &Isometry2<f64>) -> Self {
        let scanner = Scanner { noise_m: 0.002, ..Scanner::full_turn(720) };
        let mut random = Random::new(1);
        let mut turn = |pose: Isometry2<f64>| {
            ScanReturns::new(&scanner.scan(world, &|_| pose, 0, &mut random), &config())
        };
        let (first, turn) = (turn(*map_from), turn(*scan_from));
        let mut map = LocalMap::new(&config());
        let lines = local_lines(&first, &first.deskewed(&Default::default()));
        map.take_in(&vec![None; lines.len()], &lines, map_from, Moment::default());
        Self { map, turn }
    }

    fn register(&self, start: &Isometry2<f64>, sigma: f64) -> Option<Registration> {
        let sightings = self.turn.deskewed(&Default::default());
        let lines = local_lines(&self.turn, &sightings);
        let view = View { turn: &self.turn, sightings: &sightings, lines: &lines };
        let covariance = Matrix3::from_diagonal_element(sigma * sigma);
        register(
            &self.map,
            &view,
            &Prior { odom_from_middle: *start, covariance },
            start,
            &config(),
        )
    }
}

proptest! {
    /// The jacobian is that of the distance.
    #[test]
    fn the_jacobian_is_the_change_of_the_distance(
        x in -5.0..5.0_f64, y in -5.0..5.0_f64, angle in -3.0..3.0_f64, turned in -3.0..3.0_f64,
    ) {
        const STEP: f64 = 1e-6;
        let pose = Isometry2::new(Vector2::new(0.3, -0.8), turned);
        let (point, normal) = (nalgebra::Point2::new(x, y), Vector2::new(angle.cos(), angle.sin()));
        let distance = |increment: Vector3<f64>| normal.dot(&(pose * motion(&increment) * point).coords);
        let jacobian = change_of_distance(&pose.rotation.inverse_transform_vector(&normal), &point.coords);
        for axis in 0..3 {
            let step = Vector3::ith(axis, STEP);
            let numeric = (distance(step) - distance(-step)) / (2.0 * STEP);
            prop_assert!((numeric - jacobian[axis]).abs() < 1e-6, "{axis}: {numeric} {}", jacobian[axis]);
        }
    }
}

#[test]
fn a_known_motion_is_found_from_a_prediction_that_is_off() {
    let world = World::furnished();
    let from = Isometry2::new(Vector2::new(0.2, 0.1), 0.4);
    for (x, y, turn) in [(0.0, 0.0, 0.0), (0.1, -0.05, 0.05), (-0.15, 0.1, -0.1), (0.2, 0.2, 0.15)]
    {
        let to = from * Isometry2::new(Vector2::new(x, y), turn);
        let registration = Case::new(&world, &from, &to).register(&from, 0.3).unwrap();
        let error = increment(&to.inv_mul(&registration.odom_from_middle));
        assert!(error.xy().norm() < 0.003 && error.z.abs() < 0.001, "{x} {y} {turn}: {error}");
        assert!(registration.matched_share > 0.9, "{}", registration.matched_share);
        assert_eq!(registration.observability.weak().count(), 0);
    }
}

#[test]
fn directions_that_a_wall_does_not_determine_keep_the_prediction() {
    let wall = World { walls: vec![[[-50.0, 2.0].into(), [50.0, 2.0].into()]], ..World::default() };
    let case = Case::new(&wall, &Isometry2::identity(), &Isometry2::translation(0.3, 0.1));
    let start = Isometry2::translation(0.05, 0.0);
    let found = case.register(&start, 0.3).unwrap();
    let error = increment(&Isometry2::translation(0.05, 0.1).inv_mul(&found.odom_from_middle));
    assert!(error.norm() < 0.003, "{error}");
    assert_eq!(found.observability.weak().count(), 1);
    assert!(found.covariance.m11 < 1e-9 && found.covariance.m22 > 0.0, "{}", found.covariance);
}

#[test]
fn a_tight_prior_counts_and_a_loose_one_does_not() {
    let world = World::furnished();
    let case = Case::new(&world, &Isometry2::identity(), &Isometry2::identity());
    let start = Isometry2::translation(0.02, 0.0);
    let off = |sigma: f64| case.register(&start, sigma).unwrap().odom_from_middle.translation.x;
    assert!(off(1e-6) > 0.019, "{}", off(1e-6));
    assert!(off(0.1).abs() < 0.002, "{}", off(0.1));
}

#[test]
fn an_empty_map_matches_nothing() {
    let case = Case::new(&World::default(), &Isometry2::identity(), &Isometry2::identity());
    assert!(case.register(&Isometry2::identity(), 0.1).is_none());
}
