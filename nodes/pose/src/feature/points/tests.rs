use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};
use std::sync::Arc;

use nalgebra::{Matrix3, Point2};

use super::*;
use crate::{
    image::GrayImage,
    testing::{Random, dead_leaves, mapped, similarity, threads, view},
};

mod kernels;

const VIEW_PX: (usize, usize) = (320, 240);
const PICTURE_PX: usize = 900;

fn config() -> PointConfig {
    PointConfig { max_corners: 400, ..PointConfig::default() }
}

fn corners(image: &GrayImage, config: PointConfig) -> Vec<Corner> {
    PointExtractor::new(config).unwrap().extract(image)
}

fn picture() -> GrayImage {
    dead_leaves(PICTURE_PX, 8000, &mut Random::new(5))
}

/// The corners of a view of a picture, and of a second one, and what takes a pixel of the first to the second.
fn two_views(second: &Matrix3<f64>) -> (Vec<Corner>, Vec<Corner>, Matrix3<f64>) {
    let first = similarity(0.0, 2.0, VIEW_PX, PICTURE_PX);
    let picture = picture();
    let of = |from_view: &Matrix3<f64>| corners(&view(&picture, from_view, VIEW_PX), config());
    (of(&first), of(second), second.try_inverse().unwrap() * first)
}

/// Of the corners of the first view that should be well inside the second: how far the nearest corner there of about
/// the same scale is, in pixels of its level, and in how many bits their descriptors differ.
fn found_again(
    first: &[Corner],
    second: &[Corner],
    second_from_first: &Matrix3<f64>,
) -> Vec<(f64, u32)> {
    let scale = second_from_first.fixed_view::<2, 2>(0, 0).determinant().abs().sqrt();
    let mut found = Vec::new();
    for corner in first {
        let there = mapped(second_from_first, corner.pixel.cast());
        let level = f64::from(corner.level) + scale.ln() / 1.2_f64.ln();
        let margin = 20.0 * 1.2_f64.powf(level);
        let is_inside =
            |position: f64, size: usize| position > margin && position < size as f64 - margin;
        if !is_inside(there.x, VIEW_PX.0)
            || !is_inside(there.y, VIEW_PX.1)
            || !(-0.5..7.5).contains(&level)
        {
            continue;
        }
        let distance = |other: &Corner| {
            let offset = other.pixel.cast::<f64>() - there;
            (
                offset.norm() / 1.2_f64.powi(i32::from(other.level)),
                corner.descriptor.distance(&other.descriptor),
            )
        };
        let near = second
            .iter()
            .filter(|other| (f64::from(other.level) - level).abs() < 1.5)
            .map(distance);
        found.extend(near.min_by(|a, b| a.0.total_cmp(&b.0)));
    }
    found
}

fn median<T: Copy + PartialOrd>(values: impl Iterator<Item = T>) -> T {
    let mut values: Vec<T> = values.collect();
    values.sort_by(|a, b| a.partial_cmp(b).unwrap());
    values[values.len() / 2]
}

#[test]
fn the_same_corners_are_found_and_look_alike_from_elsewhere() {
    let tilted = Matrix3::new(1.9, 0.1, 90.0, -0.15, 2.1, 130.0, -1e-4, 2e-4, 1.0);
    let cases = [
        ("shifted by parts of a pixel", similarity(0.0, 2.0, (323, 241), PICTURE_PX), 0.75),
        ("turned by 30 degrees", similarity(FRAC_PI_6, 2.0, VIEW_PX, PICTURE_PX), 0.6),
        ("turned by 90 degrees", similarity(FRAC_PI_2, 2.0, VIEW_PX, PICTURE_PX), 0.6),
        ("turned by 170 degrees", similarity(2.967, 2.0, VIEW_PX, PICTURE_PX), 0.6),
        ("nearer by a fifth", similarity(0.0, 1.6667, VIEW_PX, PICTURE_PX), 0.55),
        ("tilted", tilted, 0.5),
    ];
    for (name, second, share) in cases {
        let (first, second, second_from_first) = two_views(&second);
        let found = found_again(&first, &second, &second_from_first);
        let again: Vec<_> = found.iter().filter(|(offset, _)| *offset < 1.5).copied().collect();
        let repeated = again.len() as f64 / found.len() as f64;
        let offset = median(again.iter().map(|(offset, _)| *offset));
        let bits = median(again.iter().map(|(_, bits)| *bits));
        println!(
            "{name}: {repeated:.2} of {} found again, {offset:.2} px off, {bits} bits",
            found.len()
        );
        assert!(found.len() > 40 && repeated > share, "{name}");
        assert!(offset < 0.6 && bits < 64, "{name}");
    }
}

/// The corners of bright squares, drawn to parts of a pixel, each from all four sides.
#[test]
fn the_corners_of_squares_are_where_they_were_drawn() {
    let squares =
        [(60.3, 50.7), (150.8, 60.2), (240.5, 55.1), (70.1, 160.6), (160.4, 150.9), (245.7, 165.5)];
    let half = 14.0;
    let cover = |pixel: usize, middle: f64| {
        let pixel = pixel as f64;
        ((pixel + 0.5).min(middle + half) - (pixel - 0.5).max(middle - half)).clamp(0.0, 1.0)
    };
    let places = (0..240).flat_map(|row| (0..320).map(move |column| (column, row)));
    let pixels = places.map(|(column, row)| {
        let covered: f64 = squares.iter().map(|&(x, y)| cover(column, x) * cover(row, y)).sum();
        (60.0 + 120.0 * covered).round() as u8
    });
    let image = GrayImage::new(320, 240, pixels.collect()).unwrap();
    let found = corners(&image, config());
    for (x, y) in squares {
        for (dx, dy) in [(-half, -half), (half, -half), (-half, half), (half, half)] {
            let truth = Point2::new((x + dx) as f32, (y + dy) as f32);
            let near = found.iter().filter(|corner| (corner.pixel - truth).norm() < 4.0);
            let nearest = near.map(|corner| (corner.pixel - truth).norm()).fold(f32::MAX, f32::min);
            // FAST's corner lies a pixel or two inside of where the edges intersect.
            assert!(nearest < 2.0, "{truth}: {nearest}");
        }
    }
    let is_one = |corner: &&Corner| {
        squares.iter().any(|&(x, y)| {
            let reach = half as f32 + 4.0 * 1.2_f32.powi(i32::from(corner.level));
            (corner.pixel.x - x as f32).abs() < reach && (corner.pixel.y - y as f32).abs() < reach
        })
    };
    assert_eq!(found.iter().filter(is_one).count(), found.len());
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let image = view(&picture(), &similarity(0.2, 2.0, VIEW_PX, PICTURE_PX), VIEW_PX);
    let expected = corners(&image, config());
    for count in [2, 3, 7] {
        let extractor = PointExtractor::new(config()).unwrap();
        let found = extractor.with_executor(Arc::new(threads(count))).extract(&image);
        assert_eq!(found, expected);
    }
    // Nor do the images before.
    let mut extractor = PointExtractor::new(config()).unwrap();
    for size in [(100, 80), (320, 240), (64, 300)] {
        extractor.extract(&view(&picture(), &Matrix3::identity(), size));
    }
    assert_eq!(extractor.extract(&image), expected);
}

#[test]
fn as_many_corners_as_requested_wherever_there_are_enough() {
    let image = view(&picture(), &similarity(0.0, 2.0, VIEW_PX, PICTURE_PX), VIEW_PX);
    for max_corners in [1, 7, 50, 333] {
        let found = corners(&image, PointConfig { max_corners, ..config() });
        assert_eq!(found.len(), max_corners);
    }
    let found = corners(&image, PointConfig { levels: 1, ..config() });
    assert!(found.iter().all(|corner| corner.level == 0) && !found.is_empty());
}

#[test]
fn faint_corners_count_where_there_are_no_others() {
    // A checkerboard, strong on the left and faint on the right.
    let value = |column: usize, row: usize| {
        let bright = (column / 20 + row / 20) % 2 == 1;
        if column < 160 { 60 + u8::from(bright) * 100 } else { 60 + u8::from(bright) * 14 }
    };
    let places = (0..240).flat_map(|row| (0..320).map(move |column| (column, row)));
    // Crossings are no FAST corners, so that a dot is drawn into each square.
    let pixels = places.map(|(column, row)| {
        let is_dot = column % 20 / 4 == 2 && row % 20 / 4 == 2;
        value(column + if is_dot { 20 } else { 0 }, row)
    });
    let image = GrayImage::new(320, 240, pixels.collect()).unwrap();
    let right = |corners: &[Corner]| corners.iter().filter(|corner| corner.pixel.x > 200.0).count();
    assert!(right(&corners(&image, config())) > 20);
    assert_eq!(right(&corners(&image, PointConfig { low_threshold: 20, ..config() })), 0);
}

#[test]
fn images_without_corners_or_room_give_none() {
    let random: Vec<u8> = {
        let mut random = Random::new(9);
        (0..100 * 100).map(|_| random.bits() as u8).collect()
    };
    let mut extractor = PointExtractor::new(config()).unwrap();
    for width in [0, 1, 5, 32, 33, 34, 37, 38, 39, 64, 100] {
        for height in [0, 1, 5, 32, 33, 34, 40, 100] {
            let image = GrayImage::new(width, height, random[..width * height].to_vec()).unwrap();
            let found = extractor.extract(&image);
            assert!(found.is_empty() || width.min(height) > 32, "{width} {height}");
            for corner in found {
                let (x, y) = (corner.pixel.x, corner.pixel.y);
                assert!(
                    x > 15.0 && y > 15.0 && x < width as f32 - 16.0 && y < height as f32 - 16.0
                );
            }
        }
    }
    assert_eq!(extractor.extract(&GrayImage::new(300, 200, vec![77; 60_000]).unwrap()), []);
}
