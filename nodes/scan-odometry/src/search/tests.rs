use super::*;
use crate::ScanOdometryConfig;
use crate::local_line::local_lines;
use crate::local_map::Moment;
use crate::scan_returns::ScanReturns;
use crate::testing::{Random, Scanner, World};

const WINDOW: SearchWindow = SearchWindow { position_m: 0.5, turn_rad: 0.7 };

fn seen_from(pose: Isometry2<f64>) -> ScanReturns {
    let scanner = Scanner::full_turn(360);
    let scan = scanner.scan(&World::furnished(), &|_| pose, 0, &mut Random::new(1));
    ScanReturns::new(&scan, &ScanOdometryConfig::default())
}

#[test]
fn a_pose_far_from_the_prediction_is_found_to_a_cell() {
    let first = seen_from(Isometry2::identity());
    let mut map = LocalMap::new(&ScanOdometryConfig::default());
    let lines = local_lines(&first, &first.deskewed(&Default::default()));
    map.take_in(&vec![None; lines.len()], &lines, &Isometry2::identity(), Moment::default());
    for (x, y, turn) in [(0.3, -0.2, 0.5), (-0.45, 0.4, -0.6), (0.0, 0.0, 0.0)] {
        let pose = Isometry2::new(Vector2::new(x, y), turn);
        let sightings = seen_from(pose).deskewed(&Default::default());
        let found = search(&map, &sightings, &Isometry2::identity(), &WINDOW).unwrap();
        let error = pose.inv_mul(&found);
        assert!(
            error.translation.vector.norm() < 0.15 && error.rotation.angle().abs() < 0.06,
            "{error}"
        );
    }
}

#[test]
fn without_a_map_or_returns_nothing_is_found() {
    let map = LocalMap::new(&ScanOdometryConfig::default());
    let sightings = seen_from(Isometry2::identity()).deskewed(&Default::default());
    assert_eq!(search(&map, &sightings, &Isometry2::identity(), &WINDOW), None);
    assert_eq!(search(&map, &[], &Isometry2::identity(), &WINDOW), None);
}
