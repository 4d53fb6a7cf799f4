use geometry::Scan;

use super::*;
use crate::ScanOdometryConfig;
use crate::testing::{Random, Scanner, World};

fn lines(scan: &Scan) -> (ScanReturns, Vec<Option<LocalLine>>) {
    let turn = ScanReturns::new(scan, &ScanOdometryConfig::default());
    let lines = local_lines(&turn, &turn.deskewed(&Default::default()));
    (turn, lines)
}

fn still(_: f64) -> nalgebra::Isometry2<f64> {
    nalgebra::Isometry2::identity()
}

#[test]
fn walls_have_their_normals_up_to_the_corners() {
    let world = World::default().with_box([-2.0, -1.5], [3.0, 2.0]);
    for (beams, noise_m) in [(360, 0.003), (1440, 0.01)] {
        let scanner = Scanner { noise_m, ..Scanner::full_turn(beams) };
        let (_, lines) = lines(&scanner.scan(&world, &still, 0, &mut Random::new(1)));
        let found: Vec<_> = lines.iter().flatten().collect();
        assert!(found.len() > beams * 9 / 10, "{} of {beams}", found.len());
        let mut squares = 0.0;
        for line in &found {
            let axis = line.normal.x.abs().max(line.normal.y.abs());
            let off_rad = axis.min(1.0).acos();
            squares += off_rad * off_rad / line.normal_variance_rad2;
            assert!(line.normal.dot(&line.position_m.coords) < 0.0);
        }
        // Of the size that is said; most is said by the bearing's noise, which these scans do not have.
        let ratio = squares / found.len() as f64;
        assert!((0.05..2.0).contains(&ratio), "{beams}: {ratio}");
    }
}

#[test]
fn a_step_in_depth_parts_two_surfaces() {
    let world = World {
        walls: vec![
            [[2.0, -3.0].into(), [2.0, 0.0].into()],
            [[3.0, 0.0].into(), [3.0, 3.0].into()],
        ],
        ..World::default()
    };
    let scanner = Scanner { noise_m: 0.002, ..Scanner::full_turn(720) };
    let (turn, lines) = lines(&scanner.scan(&world, &still, 0, &mut Random::new(1)));
    for (one, line) in turn.returns.iter().zip(lines) {
        if one.direction.y.abs() < 0.3 && one.direction.x > 0.0 {
            let normal = line.unwrap().normal;
            assert!(normal.x < -0.98, "{normal} at {:?}", one.direction);
        }
    }
}

#[test]
fn lone_returns_have_no_line() {
    let mut scan = Scanner::full_turn(360).scan(&World::default(), &still, 0, &mut Random::new(1));
    for beam in [10, 11, 100, 200, 201, 202] {
        scan.ranges_m[beam] = 2.0;
    }
    let (turn, lines) = lines(&scan);
    assert_eq!((turn.returns.len(), lines.len()), (6, 6));
    assert!(lines.iter().all(Option::is_none));
}

#[test]
fn the_seam_of_a_full_turn_cuts_no_surface() {
    let world = World::default().with_box([-2.0, -2.0], [2.0, 2.0]);
    let scanner = Scanner { noise_m: 0.0, ..Scanner::full_turn(360) };
    // The seam points at the wall behind, squarely.
    let (_, lines) = lines(&scanner.scan(&world, &still, 0, &mut Random::new(1)));
    let (first, last) = (lines[0].unwrap(), lines[359].unwrap());
    let beside = lines[40].unwrap();
    for line in [first, last] {
        assert!((line.normal.x - 1.0).abs() < 1e-3, "{}", line.normal);
        assert!(line.normal_variance_rad2 < 2.0 * beside.normal_variance_rad2);
    }
}
