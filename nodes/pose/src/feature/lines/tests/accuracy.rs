//! Edges of known place.

use nalgebra::Point2;

use crate::feature::lines::testing::{Picture, Rectangle, detect, end_errors_px, off_line_px};
use crate::feature::lines::{LineConfig, LineDetector, LineSegment};

/// A line fitted to points that are each good to a twentieth of a pixel.
const ACROSS_PX: f64 = 0.05;
/// An edge is rounded off where it turns, over the width of the smoothing and of the Sobel operator.
const CORNER_PX: f64 = 5.0;

fn the_one_along(segments: &[LineSegment], side: [Point2<f64>; 2]) -> LineSegment {
    let along: Vec<_> =
        segments.iter().filter(|segment| off_line_px(segment, side) < 1.5).collect();
    assert_eq!(along.len(), 1, "{side:?}: {along:?}");
    *along[0]
}

#[test]
fn a_rectangle_has_four_sides_with_the_bright_side_on_their_left() {
    for (case, turn_deg) in [0.0, 7.0, 22.5, 38.0, 45.0, 60.0, 83.0, 90.0].into_iter().enumerate() {
        for level in [200.0_f64, 40.0] {
            let off = 0.13 * case as f64;
            let rectangle =
                Rectangle::new([80.2 + off, 79.6 - off], [45.3, 31.7], f64::to_radians(turn_deg));
            let picture = Picture::flat(160, 160, 120.0).with_rectangle(level, &rectangle);
            let segments = detect(&picture.image());
            assert_eq!(segments.len(), 4, "{turn_deg}: {segments:?}");
            for [from, to] in rectangle.sides() {
                let segment = the_one_along(&segments, [from, to]);
                // The inside is on the left of a side; where it is dark the segment is reversed.
                let side = if level > 120.0 { [from, to] } else { [to, from] };
                let across_px = off_line_px(&segment, side);
                println!("ACR {turn_deg} {across_px:.3}");
                assert!(across_px < ACROSS_PX, "{turn_deg}, {level}: {across_px} px off {side:?}");
                let errors_px = end_errors_px(&segment, side);
                assert!(
                    errors_px.iter().all(|&error| error < CORNER_PX),
                    "{turn_deg}: {errors_px:?}"
                );
            }
        }
    }
}

#[test]
fn noise_moves_a_line_by_hundredths_of_a_pixel() {
    let rectangle = Rectangle::new([80.2, 79.6], [45.3, 31.7], 0.6);
    let picture = || Picture::flat(160, 160, 120.0).with_rectangle(200.0, &rectangle);
    let mut squares = Vec::new();
    for seed in 0..5 {
        let segments = detect(&picture().with_noise(4.0, seed).image());
        for side in rectangle.sides() {
            let across_px = off_line_px(&the_one_along(&segments, side), side);
            squares.push(across_px * across_px);
        }
    }
    let rms_px = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!(rms_px < 0.15, "{rms_px}");
}

#[test]
fn a_thin_bright_line_has_two_edges_that_run_against_each_other() {
    let line = Rectangle::new([60.0, 60.3], [45.0, 2.0], 0.3);
    let segments = detect(&Picture::flat(120, 120, 80.0).with_rectangle(160.0, &line).image());
    let long: Vec<_> = segments.iter().filter(|segment| segment.length_px() > 80.0).collect();
    assert_eq!(long.len(), 2, "{segments:?}");
    let [one, other] = [long[0].along_px(), long[1].along_px()];
    let cosine =
        (one[0] * other[0] + one[1] * other[1]) / (long[0].length_px() * long[1].length_px());
    assert!(cosine < -0.999, "{cosine}");
}

#[test]
fn an_edge_that_something_crosses_is_one_segment() {
    let half = |position: Point2<f64>| position.y < 60.4 + 0.2 * position.x;
    let pole = |position: Point2<f64>| (position.x - 80.0).abs() < 3.0;
    let picture = Picture::flat(160, 160, 60.0).with(150.0, half).with(220.0, pole);
    let segments = detect(&picture.image());
    let edge = [Point2::new(0.0, 60.4), Point2::new(160.0, 92.4)];
    let along: Vec<_> = segments.iter().filter(|one| off_line_px(one, edge) < 1.0).collect();
    assert_eq!(along.len(), 1, "{along:?}");
    assert!(along[0].length_px() > 145.0, "{along:?}");
}

#[test]
fn what_is_far_from_its_continuation_stays_two() {
    let half = |position: Point2<f64>| position.y < 60.4;
    let pole = |position: Point2<f64>| (position.x - 80.0).abs() < 15.0;
    let picture = Picture::flat(160, 160, 60.0).with(150.0, half).with(220.0, pole);
    let edge = [Point2::new(0.0, 60.4), Point2::new(160.0, 60.4)];
    let segments = detect(&picture.image());
    assert_eq!(segments.iter().filter(|one| off_line_px(one, edge) < 1.0).count(), 2);
}

#[test]
fn dashes_stay_dashes() {
    // Three dashes of 18 px, 32 px apart: most of the whole would be gap.
    let mut picture = Picture::flat(200, 80, 60.0);
    for dash in 0..3 {
        let middle = [50.0 + 50.0 * f64::from(dash), 40.3];
        picture = picture.with_rectangle(180.0, &Rectangle::new(middle, [9.0, 20.0], 0.0));
    }
    let config = LineConfig { max_gap_px: 60.0, ..LineConfig::default() };
    let segments = LineDetector::new(config).unwrap().detect(&picture.image());
    let along = segments.iter().filter(|one| one.along_px()[0].abs() > 10.0);
    let lengths_px: Vec<f32> = along.map(LineSegment::length_px).collect();
    assert_eq!(lengths_px.len(), 6, "{segments:?}");
    assert!(lengths_px.iter().all(|&length_px| length_px < 22.0), "{lengths_px:?}");
}

#[test]
fn a_circle_is_no_line() {
    let disc = |position: Point2<f64>| (position - Point2::new(80.0, 80.0)).norm() < 40.0;
    let segments = detect(&Picture::flat(160, 160, 60.0).with(150.0, disc).image());
    // A chord of which the middle is a pixel off, two deviations of the most that is accepted.
    let longest_px = 2.0 * (2.0_f32 * 40.0 * 2.0).sqrt();
    assert!(segments.iter().all(|one| one.length_px() < longest_px), "{segments:?}");
}

#[test]
fn a_weak_edge_is_found_where_its_length_makes_up_for_it() {
    let half = |position: Point2<f64>| position.y < 60.4 + 0.2 * position.x;
    let picture = Picture::flat(160, 160, 120.0).with(130.0, half).with_noise(2.0, 3);
    let edge = [Point2::new(0.0, 60.4), Point2::new(160.0, 92.4)];
    let segments = detect(&picture.image());
    let along = segments.iter().filter(|one| off_line_px(one, edge) < 1.0);
    assert!(along.map(LineSegment::length_px).sum::<f32>() > 130.0, "{segments:?}");
}
