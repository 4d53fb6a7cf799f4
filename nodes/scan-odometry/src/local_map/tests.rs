use super::*;

fn line(x: f64, y: f64) -> Option<LocalLine> {
    Some(LocalLine {
        position_m: Point2::new(x, y),
        normal: Vector2::new(0.0, -1.0),
        half_length_m: 0.15,
        offset_variance_m2: 1e-4,
        normal_variance_rad2: 1e-2,
    })
}

/// A wall along y = 1, seen from the origin.
fn wall() -> Vec<Option<LocalLine>> {
    (0..21).map(|index| line(-1.0 + 0.1 * f64::from(index), 1.0)).collect()
}

fn map_of(lines: &[Option<LocalLine>], config: &ScanOdometryConfig) -> LocalMap {
    let mut map = LocalMap::new(config);
    map.take_in(&vec![None; lines.len()], lines, &Isometry2::identity(), Moment::default());
    map
}

fn nearest(map: &LocalMap, x: f64, y: f64) -> Option<Meeting> {
    map.nearest(&Point2::new(x, y), &Vector2::y(), None, 1, 0.25)
}

#[test]
fn the_line_next_to_a_return_is_found_with_its_distance() {
    let map = map_of(&wall(), &ScanOdometryConfig::default());
    assert_eq!(map.lines().len(), 21);
    let matched = nearest(&map, 0.52, 0.93).unwrap();
    assert_eq!(matched.line, 15);
    // In front of the wall by 7 cm; the left of a normal that points to -y is +x.
    assert!(
        (matched.residual_m - 0.07).abs() < 1e-12 && (matched.along_m - 0.02).abs() < 1e-12,
        "{matched:?}"
    );
    assert_eq!(nearest(&map, 0.5, 0.7), None);
    assert_eq!(nearest(&map, 1.25, 1.0), None);
}

#[test]
fn lines_that_face_elsewhere_are_not_matched() {
    let map = map_of(&wall(), &ScanOdometryConfig::default());
    let matched = |direction: Vector2<f64>, normal: Vector2<f64>| {
        map.nearest(&Point2::new(0.0, 1.0), &direction, Some(&normal), 1, 0.25).is_some()
    };
    assert!(matched(Vector2::y(), -Vector2::y()));
    assert!(!matched(-Vector2::y(), -Vector2::y()), "from behind");
    assert!(!matched(Vector2::y(), Vector2::x()), "a surface at right angles");
}

#[test]
fn scans_refine_a_line_until_it_is_settled() {
    let mut map = map_of(&[line(0.0, 1.0)], &ScanOdometryConfig::default());
    // The wall is at 1.02 and rises by 0.1 to the right.
    let scan = |map: &mut LocalMap, shift_m: f64, number: u64| {
        let matched: Vec<_> = [-0.1, 0.0, 0.1]
            .iter()
            .map(|&x| {
                let point = Point2::new(x, 1.02 + 0.1 * x + shift_m);
                Some((map.nearest(&point, &Vector2::y(), None, 1, 0.25).unwrap(), 1e4))
            })
            .collect();
        let now = Moment { scan: number, travelled_m: 0.0 };
        map.take_in(&matched, &[None; 3], &Isometry2::identity(), now);
    };
    for number in 1..60 {
        scan(&mut map, 0.0, number);
    }
    let settled = map.lines()[0];
    assert!((settled.position_m.y - 1.02).abs() < 0.001, "{settled:?}");
    assert!((settled.normal.x / -settled.normal.y - 0.1).abs() < 0.01, "{settled:?}");
    // Nothing moves it any more.
    for number in 60..90 {
        scan(&mut map, 0.05, number);
    }
    assert_eq!(map.lines()[0].position_m, settled.position_m);
}

#[test]
fn a_covered_place_gets_no_second_line() {
    let mut map = map_of(&wall(), &ScanOdometryConfig::default());
    let again: Vec<_> = (0..5).map(|index| line(0.01 + 0.1 * f64::from(index), 1.0)).collect();
    let matched: Vec<_> = again
        .iter()
        .map(|line| nearest(&map, line.unwrap().position_m.x, 1.0).map(|matched| (matched, 1e4)))
        .collect();
    map.take_in(&matched, &again, &Isometry2::identity(), Moment { scan: 1, travelled_m: 0.0 });
    assert_eq!(map.lines().len(), 21);
}

#[test]
fn what_is_far_or_old_or_never_seen_again_is_forgotten() {
    let config = ScanOdometryConfig {
        reach_m: 5.0,
        memory_distance_m: 2.0,
        ..ScanOdometryConfig::default()
    };
    let left_after = |seen: u64, at: Isometry2<f64>, now: Moment| {
        let mut map = map_of(&[line(0.0, 1.0)], &config);
        for scan in 1..=seen {
            let matched = nearest(&map, 0.0, 1.0).map(|matched| (matched, 1e4));
            map.take_in(
                &[matched],
                &[None],
                &Isometry2::identity(),
                Moment { scan, travelled_m: 0.0 },
            );
        }
        map.take_in(&[], &[], &at, now);
        map.lines().len()
    };
    let here = Isometry2::identity();
    assert_eq!(left_after(0, here, Moment { scan: 10, travelled_m: 0.0 }), 1);
    assert_eq!(left_after(0, here, Moment { scan: 11, travelled_m: 0.0 }), 0, "seen once");
    assert_eq!(left_after(5, here, Moment { scan: 1000, travelled_m: 1.9 }), 1, "proven");
    assert_eq!(
        left_after(5, here, Moment { scan: 1000, travelled_m: 2.1 }),
        0,
        "far along the path"
    );
    let far = Isometry2::translation(5.1, 0.0);
    assert_eq!(left_after(5, far, Moment { scan: 10, travelled_m: 0.0 }), 0, "out of reach");
}

#[test]
fn the_longest_unseen_go_when_there_are_too_many() {
    let config = ScanOdometryConfig { max_lines: 100, ..ScanOdometryConfig::default() };
    let many = |y: f64| (0..80).map(|index| line(0.1 * f64::from(index), y)).collect::<Vec<_>>();
    let mut map = map_of(&many(1.0), &config);
    let now = Moment { scan: 1, travelled_m: 0.0 };
    map.take_in(&vec![None; 80], &many(3.0), &Isometry2::identity(), now);
    assert_eq!(map.lines().len(), 100);
    assert_eq!(map.lines().iter().filter(|line| line.born == 1).count(), 80);
}
