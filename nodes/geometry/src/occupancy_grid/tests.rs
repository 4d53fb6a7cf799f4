use super::*;

use GridCell::{Free, Occupied, Unknown};

/// Three by two cells.
fn grid() -> OccupancyGrid {
    OccupancyGrid {
        stamp: Stamp::from_nanos(7),
        frame_id: "map".to_owned(),
        resolution_m: 0.05,
        least: [-3, 12],
        width: 3,
        height: 2,
        cells: vec![Unknown, Free, Occupied, Free, Free, Unknown],
    }
}

#[test]
fn a_cell_is_found_by_its_place_in_the_plane() {
    let grid = grid();
    assert_eq!([-3, -2, -1].map(|x| grid.at([x, 12])), [Unknown, Free, Occupied]);
    assert_eq!([-3, -2, -1].map(|x| grid.at([x, 13])), [Free, Free, Unknown]);
    for outside in [[-4, 12], [0, 12], [-3, 11], [-3, 14], [i32::MIN, i32::MAX]] {
        assert_eq!((grid.at(outside), grid.index(outside)), (Unknown, None));
    }
    assert_eq!([Free, Occupied, Unknown].map(|state| grid.count(state)), [3, 1, 2]);
}

#[test]
fn a_wider_grid_has_the_same_cells_and_room_for_the_other_ones() {
    let beside = OccupancyGrid { least: [-1, 9], ..grid() };
    let wider = grid().widened_to(&beside);
    assert_eq!((wider.least, wider.width, wider.height), ([-3, 9], 5, 5));
    for (x, y) in (-5..5).flat_map(|x| (7..16).map(move |y| (x, y))) {
        assert_eq!(wider.at([x, y]), grid().at([x, y]), "{x} {y}");
    }
    assert_eq!(wider.clone().widened_to(&grid()), wider);
    for far in [[i32::MIN, 12], [100, 100]] {
        assert_eq!(grid().widened_to(&OccupancyGrid { least: far, ..grid() }), grid());
    }
}

#[test]
fn the_image_has_the_greatest_y_first_and_the_shades_of_map_saver() {
    let pgm = grid().pgm();
    let header = b"P5\n3 2\n255\n";
    assert_eq!(&pgm[..header.len()], header);
    assert_eq!(&pgm[header.len()..], [254, 254, 205, 205, 254, 0]);
}

#[test]
fn the_yaml_says_where_the_image_is_without_rounding_errors() {
    let yaml = grid().map_yaml("a \"house\".pgm");
    let expected = "image: \"a \\\"house\\\".pgm\"\nmode: trinary\nresolution: 0.05\norigin: [-0.15, 0.6, 0.0]\n\
                    negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
    assert_eq!(yaml, expected);
    let whole = OccupancyGrid { least: [20, 0], ..grid() };
    assert!(
        whole.map_yaml("a.pgm").contains("origin: [1.0, 0.0, 0.0]"),
        "{}",
        whole.map_yaml("a.pgm")
    );
}

#[test]
fn the_shade_of_unknown_cells_lies_between_the_thresholds() {
    let occupancy = |shade: f64| (255.0 - shade) / 255.0;
    assert!((FREE_THRESHOLD..=OCCUPIED_THRESHOLD).contains(&occupancy(205.0)));
    assert!(occupancy(254.0) < FREE_THRESHOLD && occupancy(0.0) > OCCUPIED_THRESHOLD);
}

#[test]
fn the_part_that_has_changed_is_the_smallest() {
    let before = grid();
    let mut after = before.clone();
    assert_eq!(after.changed_since(&before), None);
    after.cells[1] = Occupied;
    assert_eq!(after.changed_since(&before), Some(GridPart { x: 1, y: 0, width: 1, height: 1 }));
    after.cells[5] = Free;
    let part = after.changed_since(&before).unwrap();
    assert_eq!(part, GridPart { x: 1, y: 0, width: 2, height: 2 });
    // Regression: sums of these overflowed.
    let none = GridPart { x: usize::MAX, y: 0, width: usize::MAX, height: usize::MAX };
    assert_eq!(after.cells_of(none), []);
    assert_eq!(after.cells_of(part), [Occupied, Occupied, Free, Free]);
    assert!(after.is_same_part(&before));
    assert!(!OccupancyGrid { least: [-3, 11], ..after }.is_same_part(&before));
}
