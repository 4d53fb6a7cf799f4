//! The fast kernels beside plain ones.

use super::super::{
    description::describe,
    detection::Candidate,
    orientation::{Direction, direction},
    pattern::PATTERN,
    segment_test::row_strengths,
    spread::{allot, choose},
};
use crate::{
    image::GrayImage,
    testing::{Random, dead_leaves},
};

/// Clockwise from the north.
const RING: [(isize, isize); 16] = [
    (0, -3),
    (1, -3),
    (2, -2),
    (3, -1),
    (3, 0),
    (3, 1),
    (2, 2),
    (1, 3),
    (0, 3),
    (-1, 3),
    (-2, 2),
    (-3, 1),
    (-3, 0),
    (-3, -1),
    (-2, -2),
    (-1, -3),
];

/// The segment test as its authors state it.
fn is_corner(image: &GrayImage, column: usize, row: usize, threshold: i32) -> bool {
    let at = |(x, y): (isize, isize)| {
        i32::from(image.pixel(column.wrapping_add_signed(x), row.wrapping_add_signed(y)).unwrap())
    };
    let centre = at((0, 0));
    (0..16).any(|start| {
        let arc = || (start..start + 9).map(|index| at(RING[index % 16]));
        arc().all(|value| value > centre + threshold)
            || arc().all(|value| value < centre - threshold)
    })
}

#[test]
fn the_strength_is_the_largest_threshold_below_which_a_pixel_is_a_corner() {
    let mut random = Random::new(2);
    let mut corners = 0;
    for width in [38, 64, 71] {
        let leaves = dead_leaves(128, 4000, &mut random);
        let rows = (0..40).flat_map(|row| leaves.row(row)[..width].to_vec());
        let noisy = rows.map(|gray| gray.saturating_add((random.bits() % 9) as u8));
        let image = GrayImage::new(width, 40, noisy.collect()).unwrap();
        for threshold in [1, 7, 20] {
            for row in 3..37 {
                let mut strengths = vec![99; width];
                let rows = std::array::from_fn(|offset| image.row(row + offset - 3));
                row_strengths(rows, threshold, &mut strengths);
                for (column, &strength) in strengths.iter().enumerate() {
                    if column < 3 || column >= width - 3 {
                        assert_eq!(strength, 0);
                        continue;
                    }
                    let is_one =
                        |threshold: u8| is_corner(&image, column, row, i32::from(threshold));
                    if strength == 0 {
                        assert!(!is_one(threshold));
                    } else {
                        assert!(strength > threshold && is_one(strength - 1) && !is_one(strength));
                        corners += 1;
                    }
                }
            }
        }
    }
    assert!(corners > 300, "{corners}");
}

fn textured() -> GrayImage {
    dead_leaves(96, 1500, &mut Random::new(7))
}

#[test]
fn the_direction_leads_to_the_centroid_of_the_disc() {
    let image = textured();
    for (column, row) in [(16, 16), (40, 50), (79, 79), (16, 79), (61, 33)] {
        let (mut x, mut y) = (0.0, 0.0);
        for dy in -15..=15_isize {
            for dx in -15..=15_isize {
                if dx * dx + dy * dy <= 15 * 15 + 15 {
                    let value = image.pixel(
                        usize::wrapping_add_signed(column, dx),
                        usize::wrapping_add_signed(row, dy),
                    );
                    x += dx as f64 * f64::from(value.unwrap());
                    y += dy as f64 * f64::from(value.unwrap());
                }
            }
        }
        let found = direction(&image, column, row).unwrap();
        let length = f64::hypot(x, y);
        assert!((f64::from(found.x) - x / length).abs() < 1e-6);
        assert!((f64::from(found.y) - y / length).abs() < 1e-6);
    }
    for (column, row) in [(14, 40), (81, 40), (40, 14), (40, 81), (usize::MAX, 3)] {
        assert_eq!(direction(&image, column, row), None);
    }
    let even = GrayImage::new(64, 64, vec![9; 64 * 64]).unwrap();
    assert_eq!(direction(&even, 30, 30), Some(Direction { x: 1.0, y: 0.0 }));
}

#[test]
fn a_descriptor_compares_the_turned_pairs() {
    let image = textured();
    for degree in 0..360 {
        let (sin, cos) = (degree as f32).to_radians().sin_cos();
        let (column, row) = (16 + degree as usize % 60, 70 - degree as usize % 50);
        let found = describe(&image, column, row, Direction { x: cos, y: sin }).unwrap();
        let at = |x: i8, y: i8| {
            let (x, y) = (f32::from(x), f32::from(y));
            // The middle of the patch is at 15: of two pixels equally near the one of even number counts.
            let place =
                |offset: f32| ((f64::from(offset) + 15.0).round_ties_even() - 15.0) as isize;
            let (right, down) = (place(x * cos - y * sin), place(x * sin + y * cos));
            image.pixel(column.wrapping_add_signed(right), row.wrapping_add_signed(down)).unwrap()
        };
        for (test, pair) in PATTERN.iter().enumerate() {
            let expected = at(pair[0], pair[1]) < at(pair[2], pair[3]);
            assert_eq!(found.0[test / 64] >> (test % 64) & 1 == 1, expected, "{degree} {test}");
        }
    }
    assert_eq!(describe(&image, 14, 40, Direction { x: 1.0, y: 0.0 }), None);
    assert_eq!(describe(&image, 81, 40, Direction { x: 1.0, y: 0.0 }), None);
}

#[test]
fn no_pair_leaves_the_patch() {
    for [a, b, c, d] in PATTERN {
        for (x, y) in [(a, b), (c, d)] {
            assert!(i32::from(x).pow(2) + i32::from(y).pow(2) <= 225);
        }
    }
}

fn candidate(column: u16, row: u16, strength: u8) -> Candidate {
    Candidate { column, row, strength, beside: [0; 2], above_below: [0; 2] }
}

#[test]
fn corners_are_spread_over_a_level_or_the_strongest_are_taken() {
    // A strong cluster in one corner, weak ones all over.
    let mut random = Random::new(4);
    let mut place = |from: f64, to: f64| (from + (to - from) * random.uniform()) as u16;
    let cluster: Vec<_> =
        (0..300).map(|_| candidate(place(20.0, 60.0), place(20.0, 60.0), 100)).collect();
    let weak: Vec<_> =
        (0..300).map(|_| candidate(place(20.0, 300.0), place(20.0, 220.0), 30)).collect();
    let all: Vec<_> = cluster.into_iter().chain(weak).collect();
    let cells = |even_share: f64| {
        let chosen = choose(all.clone(), (320, 240), 64, even_share);
        assert_eq!(chosen.len(), 64);
        assert!(
            chosen.is_sorted_by_key(|c| (c.row, c.column))
                && chosen.iter().all(|c| all.contains(c))
        );
        let mut cells: Vec<_> = chosen.iter().map(|c| (c.column / 40, c.row / 40)).collect();
        cells.sort_unstable();
        cells.dedup();
        (cells.len(), chosen.iter().filter(|c| c.strength == 100).count())
    };
    let ((none, strongest), (half, _), (full, fewest)) = (cells(0.0), cells(0.5), cells(1.0));
    assert!(none <= 4 && strongest == 64, "{none} {strongest}");
    assert!(half > 20 && full > 35 && fewest < 16, "{half} {full} {fewest}");
    assert_eq!(choose(all.clone(), (320, 240), 5000, 0.5).len(), 600);
}

#[test]
fn what_one_level_lacks_the_others_give() {
    assert_eq!(allot(100, &[60, 40], &[500, 500]), [60, 40]);
    assert_eq!(allot(100, &[60, 40], &[10, 500]), [10, 90]);
    assert_eq!(allot(100, &[60, 40], &[10, 20]), [10, 20]);
    assert_eq!(allot(1, &[60, 40, 30], &[9, 9, 9]).iter().sum::<usize>(), 1);
    assert_eq!(allot(7, &[], &[]), [0; 0]);
}
