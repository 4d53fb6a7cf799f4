use super::*;

/// A grid from lines, the last of which is the row of least y: `.` free, `#` occupied, `?` unknown.
fn grid(lines: &[&str]) -> OccupancyGrid {
    let cell = |letter: char| match letter {
        '.' => GridCell::Free,
        '#' => GridCell::Occupied,
        _ => GridCell::Unknown,
    };
    OccupancyGrid {
        resolution_m: 0.5,
        least: [-2, 3],
        width: lines[0].len(),
        height: lines.len(),
        cells: lines.iter().rev().flat_map(|line| line.chars()).map(cell).collect(),
        ..OccupancyGrid::default()
    }
}

#[test]
fn each_kind_of_wrong_cell_is_counted_as_what_it_is() {
    let plan = grid(&[
        "#####", //
        "#...#", "#...#", "#...#", "#...#",
    ]);
    let measured = grid(&[
        "##.##", // the wall has a gap
        "#..##", // and is a cell too thick
        "#...?", "#.#.#", // somebody stood there
        "?...#",
    ]);
    let in_sight = vec![true; 25];
    let score = score(&measured, &plan, &in_sight);
    assert_eq!((score.free, score.occupied), (11, 12));
    assert_eq!((score.free_in_body, score.occupied_beside_body, score.phantoms), (1, 1, 1));
    assert!((score.right - 20.0 / 23.0).abs() < 1e-12, "{score:?}");
    // The gap has free cells beside it, the thick wall occupied ones; the phantom has none.
    assert!((score.right_to_a_cell - 22.0 / 23.0).abs() < 1e-12, "{score:?}");
    assert!((score.right_to_be_seen - 20.0 / 23.0).abs() < 1e-12, "{score:?}");
    assert_eq!((score.in_sight, score.known_to_be_seen), (25, 23));
    assert!((score.unknown_in_sight - 2.0 / 25.0).abs() < 1e-12);
}

#[test]
fn what_nobody_can_see_is_told_apart() {
    // A top in the second column reaches into the third one, which it hides; the wall in the fifth is missed in one row.
    let plan = grid(&[".#..#", ".#..#"]);
    let measured = grid(&[".##.#", ".##.."]);
    let is_before_the_top = [0, 5];
    let in_sight: Vec<bool> = (0..10).map(|cell| is_before_the_top.contains(&cell)).collect();
    let score = score(&measured, &plan, &in_sight);
    assert!((score.right - 7.0 / 10.0).abs() < 1e-12, "{score:?}");
    assert_eq!(score.known_to_be_seen, 6);
    assert!((score.right_to_be_seen - 5.0 / 6.0).abs() < 1e-12, "{score:?}");
}

#[test]
fn a_grid_like_the_plan_is_right_and_one_that_knows_nothing_has_no_share() {
    let plan = grid(&["#.", ".."]);
    let same = score(&plan, &plan, &[true; 4]);
    assert!(same.right == 1.0 && same.right_to_a_cell == 1.0 && same.unknown_in_sight == 0.0);
    let nothing = score(&grid(&["??", "??"]), &plan, &[false, true, true, true]);
    assert!(nothing.right == 0.0 && nothing.unknown_in_sight == 1.0 && nothing.in_sight == 3);
}

#[test]
fn what_is_behind_a_body_beside_the_view_or_too_far_is_not_in_sight() {
    let plan = grid(&[
        "......", //
        "...#..", "......",
    ]);
    // In the leftmost cell of the middle row, looking along x.
    let sight = |half_view_rad, near_m, reach_m| Sight {
        looks: vec![(Point2::new(-0.75, 2.25), 0.0)],
        half_view_rad,
        near_m,
        reach_m,
        height_m: 1.0,
    };
    let seen = |sight: &Sight| -> Vec<usize> {
        let cells = sight.cells(&plan);
        (0..cells.len()).filter(|cell| cells[*cell]).collect()
    };
    let all_around = seen(&sight(std::f64::consts::PI, 0.0, 10.0));
    assert!(!all_around.contains(&9), "the body");
    assert!(!all_around.contains(&10) && !all_around.contains(&11), "behind it: {all_around:?}");
    assert!([6, 7, 8, 0, 12, 5, 17].iter().all(|cell| all_around.contains(cell)), "{all_around:?}");
    assert_eq!(seen(&sight(0.1, 0.0, 10.0)), [6, 7, 8]);
    assert_eq!(seen(&sight(0.1, 0.4, 0.6)), [7]);
}
