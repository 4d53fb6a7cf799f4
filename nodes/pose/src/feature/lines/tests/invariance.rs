//! Changes of the image that must not matter.

use std::sync::Arc;

use crate::testing::threads;
use nalgebra::Point2;

use crate::feature::lines::testing::{are_alike, busy_picture, detect, off_line_px, share_found};
use crate::feature::lines::{LineConfig, LineDetector, LineSegment};
use crate::image::GrayImage;

/// Segments that begin and end as others do.
const SAME_PX: f64 = 1.0;

fn turned_by_a_quarter(image: &GrayImage) -> GrayImage {
    let (width_px, height_px) = (image.width_px(), image.height_px());
    // The pixel (column, row) goes to (height - 1 - row, column).
    let pixels = (0..width_px)
        .flat_map(|row| (0..height_px).map(move |column| (row, height_px - 1 - column)))
        .map(|(column, row)| image.row(row)[column]);
    GrayImage::new(height_px, width_px, pixels.collect()).unwrap()
}

#[test]
fn an_image_turned_by_a_quarter_has_the_segments_turned() {
    let image = busy_picture(240, 180, 5).image();
    let turn = |[x, y]: [f32; 2]| [179.0 - y, x];
    let turned: Vec<LineSegment> = detect(&image)
        .into_iter()
        .map(|one| LineSegment { start_px: turn(one.start_px), end_px: turn(one.end_px), ..one })
        .collect();
    let found = detect(&turned_by_a_quarter(&image));
    assert!(turned.len() > 40, "{}", turned.len());
    let is_alike = |one: &LineSegment, other: &LineSegment| are_alike(one, other, SAME_PX);
    let share = share_found(&turned, &found, is_alike);
    assert!(share > 0.9, "{share}");
    // Reversed they are others.
    let is_reversed = |one: &LineSegment, other: &LineSegment| is_alike(one, &other.reversed());
    assert!(share_found(&turned, &found, is_reversed) < 0.05);
}

#[test]
fn the_negative_has_the_same_segments_reversed() {
    let picture = busy_picture(240, 180, 6);
    let segments = detect(&picture.image());
    let negative = detect(&picture.map(|level| 255.0 - level).image());
    // Grown from the other end, a segment may pass a corner by what it takes for outliers.
    let is_reversed = |one: &LineSegment, other: &LineSegment| {
        let ends = [one.start_px, one.end_px].map(|end| Point2::from(end.map(f64::from)));
        off_line_px(other, ends) < 1.0 && are_alike(one, &other.reversed(), 6.0)
    };
    let share = share_found(&segments, &negative, is_reversed);
    assert!(share > 0.9, "{share}");
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let image = busy_picture(240, 180, 7).image();
    let with = |count| {
        let detector = LineDetector::new(LineConfig::default()).unwrap();
        detector.with_executor(Arc::new(threads(count))).detect(&image)
    };
    let one = with(1);
    assert!(one.len() > 40, "{}", one.len());
    for count in [2, 3, 7, 200] {
        assert_eq!(with(count), one, "{count}");
    }
}

#[test]
fn what_was_seen_before_does_not_matter() {
    let images = [8, 9].map(|seed| busy_picture(160, 120, seed).image());
    let mut detector = LineDetector::new(LineConfig::default()).unwrap();
    detector.detect(&busy_picture(240, 180, 10).image());
    for image in images {
        assert_eq!(detector.detect(&image), detect(&image));
    }
}
