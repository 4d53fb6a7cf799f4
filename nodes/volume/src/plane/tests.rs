use geometry::Stamp;
use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;

const EDGE_M: f64 = 0.05;

fn plane() -> PlaneOccupancy {
    PlaneOccupancy::new(PlaneConfig { edge_m: EDGE_M, max_blocks: 10_000, ends_at_occupied: false })
        .unwrap()
}

/// A fan from a place to a wall at x = `wall_m`, a ray a degree.
fn fan(from_m: [f64; 2], wall_m: f64) -> Vec<PlaneRay> {
    let from_m = Point2::from(from_m);
    let ray = |degree: i32| {
        let azimuth_rad = f64::from(degree).to_radians();
        let length_m = (wall_m - from_m.x) / azimuth_rad.cos();
        let to_m = from_m + nalgebra::Vector2::new(azimuth_rad.cos(), azimuth_rad.sin()) * length_m;
        PlaneRay { from_m, to_m, hits: true, joins_next: degree < 40 }
    };
    (-40..=40).map(ray).collect()
}

fn after(cycles: i32, rays: &[PlaneRay]) -> PlaneOccupancy {
    let mut plane = plane();
    take(&mut plane, 0, cycles, rays);
    plane
}

fn take(plane: &mut PlaneOccupancy, from: i32, cycles: i32, rays: &[PlaneRay]) {
    for cycle in from..from + cycles {
        plane.begin_cycle(Stamp::from_secs_nanos(100 + cycle, 0));
        plane.take_rays(rays);
    }
}

fn state_at(plane: &PlaneOccupancy, x_m: f64, y_m: f64) -> CellState {
    plane.state(plane.cell_of(&Point2::new(x_m, y_m)).unwrap())
}

#[test]
fn space_before_a_wall_is_free_the_wall_occupied_and_what_is_behind_unknown() {
    let plane = after(4, &fan([0.0, 0.0], 2.52));
    for y in -30..=30 {
        let y_m = 0.05 * f64::from(y) + 0.01;
        assert_eq!(state_at(&plane, 2.52, y_m), CellState::Occupied, "{y_m}");
        assert_eq!(state_at(&plane, 2.43, y_m), CellState::Free, "{y_m}");
        assert_eq!(state_at(&plane, 2.58, y_m), CellState::Unknown, "{y_m}");
    }
}

#[test]
fn a_wall_between_two_cells_is_in_the_one_behind_whatever_the_noise_of_ranges() {
    let mut plane = plane();
    for cycle in 0..40 {
        // The noise of ranges is more than half a cell: 1.5 % of 2.5 m.
        let noise_m = 0.038 * [-1.0, 0.3, 0.9, -0.2, -0.7, 0.6, 0.0, -0.4][cycle as usize % 8];
        take(&mut plane, cycle, 1, &fan([0.0, 0.0], 2.5 + noise_m));
    }
    for y in -20..=20 {
        let y_m = 0.05 * f64::from(y) + 0.01;
        assert_eq!(state_at(&plane, 2.52, y_m), CellState::Occupied, "{y_m}");
        assert_ne!(state_at(&plane, 2.47, y_m), CellState::Occupied, "{y_m}");
        assert_eq!(state_at(&plane, 2.42, y_m), CellState::Free, "{y_m}");
    }
}

#[test]
fn neighbours_farther_apart_than_a_body_leave_a_gap() {
    // 1 degree is 15 cm at 8.6 m.
    let plane = after(4, &fan([0.0, 0.0], 12.02));
    let between_rad = 0.5_f64.to_radians();
    let at =
        |range_m: f64| state_at(&plane, range_m * between_rad.cos(), range_m * between_rad.sin());
    assert_eq!((at(8.0), at(9.5)), (CellState::Free, CellState::Unknown));
}

#[test]
fn what_stood_and_left_is_cleared() {
    let mut plane = plane();
    take(&mut plane, 0, 20, &fan([0.0, 0.0], 1.52));
    assert_eq!(state_at(&plane, 1.52, 0.01), CellState::Occupied);
    take(&mut plane, 20, 400, &fan([0.0, 0.0], 2.52));
    assert_eq!(state_at(&plane, 1.52, 0.01), CellState::Free);
    assert_eq!(state_at(&plane, 2.52, 0.01), CellState::Occupied);
}

#[test]
fn what_is_seen_behind_something_now_and_then_is_not_free_until_that_has_gone() {
    let config = PlaneConfig { edge_m: EDGE_M, max_blocks: 10_000, ends_at_occupied: true };
    let (near, far) = (fan([0.0, 0.0], 1.52), fan([0.0, 0.0], 2.52));
    let mut plane = PlaneOccupancy::new(config).unwrap();
    for round in 0..10 {
        take(&mut plane, 5 * round, 4, &near);
        take(&mut plane, 5 * round + 4, 1, &far);
    }
    assert_eq!(state_at(&plane, 2.0, 0.01), CellState::Unknown);
    take(&mut plane, 50, 400, &far);
    assert_eq!(
        (state_at(&plane, 1.52, 0.01), state_at(&plane, 2.0, 0.01)),
        (CellState::Free, CellState::Free)
    );
}

#[test]
fn what_moves_is_free_before_it_and_never_occupied() {
    let moving: Vec<_> =
        fan([0.0, 0.0], 1.52).into_iter().map(|ray| PlaneRay { hits: false, ..ray }).collect();
    let plane = after(50, &moving);
    plane.for_each_known(|cell, state| assert_eq!(state, CellState::Free, "{cell:?}"));
    assert_eq!(state_at(&plane, 1.2, 0.0), CellState::Free);
    assert_eq!(state_at(&plane, 1.72, 0.0), CellState::Unknown);
}

#[test]
fn a_correction_moves_a_block_with_the_moment_it_was_seen_first() {
    let mut plane = after(4, &fan([0.0, 0.0], 2.52));
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.1);
    let motion = Isometry3::from_parts(Translation3::new(0.3, -0.2, 0.01), turn);
    plane.correct(|seen| {
        assert_eq!(seen, Stamp::from_secs_nanos(100, 0));
        motion
    });
    let expected = |x_m: f64, y_m: f64| {
        let place = motion * nalgebra::Point3::new(x_m, y_m, 0.0);
        state_at(&plane, place.x, place.y)
    };
    let (mut walls, mut free) = (0, 0);
    for y in -20..=20 {
        let y_m = 0.05 * f64::from(y);
        walls += usize::from(expected(2.525, y_m) == CellState::Occupied);
        free += usize::from(expected(2.3, y_m) == CellState::Free);
    }
    // A turned wall passes between the middles of some cells.
    assert!(walls >= 34 && free == 41, "{walls} {free}");
    assert_eq!(expected(2.65, 0.0), CellState::Unknown);
}

/// Each small correction took a cell of the earlier block into the next one, which was seen at the earlier moment from there on.
#[test]
fn what_was_seen_late_moves_with_its_own_moment_after_small_corrections() {
    let mut plane = plane();
    let block_m = 8.0 * EDGE_M;
    for (seconds, first_m) in [(100, 0.0), (200, block_m)] {
        for cycle in 0..6 {
            plane.begin_cycle(Stamp::from_secs_nanos(seconds + cycle, 0));
            for x in 0..8 {
                plane.hit(&Point2::new(first_m + EDGE_M * (f64::from(x) + 0.5), 0.12));
            }
        }
    }
    for step in 0..6 {
        let along_m = if step % 2 == 0 { 0.7 * EDGE_M } else { -0.7 * EDGE_M };
        plane.correct(|_| Isometry3::translation(along_m, 0.0, 0.0));
    }
    let late = Stamp::from_secs_nanos(150, 0);
    plane.correct(|seen| Isometry3::translation(0.0, if seen > late { 2.0 } else { 0.0 }, 0.0));
    let moved = (8..16)
        .filter(|x| state_at(&plane, EDGE_M * (f64::from(*x) + 0.5), 2.12) == CellState::Occupied);
    assert!(moved.count() >= 7);
    assert_eq!(state_at(&plane, 0.5 * block_m, 0.12), CellState::Occupied);
}

/// A place far away moved sideways by its height in cells, taken for metres.
#[test]
fn a_correction_that_tilts_moves_what_is_far_away_by_no_more_than_the_tilt() {
    let mut plane = after(4, &fan([20.0, 0.0], 22.52));
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.05);
    plane.correct(|_| Isometry3::from_parts(Translation3::identity(), tilt));
    let walls = (-20..=20).filter(|y| {
        let y_m = 0.05 * f64::from(*y) + 0.01;
        // The cosine takes 2.8 cm, less than a cell; the height of the place one cell more or less.
        (-1..=1).any(|x| state_at(&plane, 22.475 + 0.05 * f64::from(x), y_m) == CellState::Occupied)
    });
    assert!(walls.count() >= 38);
}

#[test]
fn a_correction_that_is_none_changes_nothing() {
    let mut plane = after(4, &fan([0.0, 0.0], 2.52));
    let cells = |plane: &PlaneOccupancy| {
        let mut cells = Vec::new();
        plane.for_each_known(|cell, state| cells.push((cell, state)));
        cells
    };
    let before = cells(&plane);
    plane.correct(|_| Isometry3::identity());
    assert_eq!(cells(&plane), before);
}

#[test]
fn blocks_beyond_the_bound_are_refused_and_counted() {
    let config = PlaneConfig { edge_m: EDGE_M, max_blocks: 5, ends_at_occupied: false };
    let mut plane = PlaneOccupancy::new(config).unwrap();
    take(&mut plane, 0, 3, &fan([0.0, 0.0], 4.02));
    assert_eq!(plane.blocks(), 5);
    assert!(plane.refused_cells() > 0);
}

proptest! {
    #[test]
    fn no_ray_does_harm(
        ends in prop::collection::vec(prop::array::uniform4(-1e3..1e3_f64), 0..20),
        odd in prop::sample::select(vec![f64::NAN, f64::INFINITY, -1e300, 0.0]),
    ) {
        let mut rays: Vec<_> = ends
            .into_iter()
            .map(|[x, y, to_x, to_y]| PlaneRay {
                from_m: Point2::new(x, y),
                to_m: Point2::new(to_x, to_y),
                hits: x > 0.0,
                joins_next: y > 0.0,
            })
            .collect();
        rays.push(PlaneRay {
            from_m: Point2::new(0.0, odd),
            to_m: Point2::new(odd, 1.0),
            hits: true,
            joins_next: true,
        });
        let mut plane =
            PlaneOccupancy::new(PlaneConfig { edge_m: 1.0, max_blocks: 50, ends_at_occupied: true }).unwrap();
        take(&mut plane, 0, 2, &rays);
        prop_assert!(plane.blocks() <= 50);
    }
}
