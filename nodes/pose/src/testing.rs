//! What several tests need.

pub(crate) use estimation::Random;
use nalgebra::{Matrix3, Point2};

use crate::image::GrayImage;

/// An executor with this many threads.
pub(crate) fn threads(count: usize) -> estimation::ScopedThreads {
    estimation::ScopedThreads::new(std::num::NonZeroUsize::new(count).unwrap())
}

/// Radii from the smallest to the largest, with a density that falls with the third power.
const RADII_PX: [f64; 2] = [2.0, 80.0];

/// A square picture of discs of all sizes that lie upon each other.
pub(crate) fn dead_leaves(side_px: usize, leaves: usize, random: &mut Random) -> GrayImage {
    let mut pixels = vec![0; side_px * side_px];
    let [least, most] = RADII_PX.map(|radius: f64| 1.0 / (radius * radius));
    for _ in 0..leaves {
        let radius = 1.0 / (most + (least - most) * random.uniform()).sqrt();
        let [x, y] = [random.uniform(), random.uniform()].map(|part| part * side_px as f64);
        let gray = (random.uniform() * 256.0) as u8;
        let rows = (y - radius).max(0.0) as usize..((y + radius) as usize + 1).min(side_px);
        for row in rows {
            let half = (radius * radius - (row as f64 - y).powi(2)).max(0.0).sqrt();
            let columns = (x - half).max(0.0) as usize..((x + half) as usize).min(side_px);
            if columns.start < columns.end {
                pixels[row * side_px..][columns].fill(gray);
            }
        }
    }
    GrayImage::new(side_px, side_px, pixels).unwrap()
}

/// What a camera sees of a picture: `picture_from_view` takes a pixel of the view to the picture. Each pixel is the
/// mean of 4 x 4 positions within.
pub(crate) fn view(
    picture: &GrayImage,
    picture_from_view: &Matrix3<f64>,
    (width_px, height_px): (usize, usize),
) -> GrayImage {
    let at = |x: f64, y: f64| {
        let seen = mapped(picture_from_view, Point2::new(x, y));
        let (x, y) = (seen.x.max(0.0), seen.y.max(0.0));
        let (column, row) = (x as usize, y as usize);
        let value = |column: usize, row: usize| {
            let column = column.min(picture.width_px() - 1);
            f64::from(picture.pixel(column, row.min(picture.height_px() - 1)).unwrap())
        };
        let (right, down) = (x.fract(), y.fract());
        let upper = value(column, row) * (1.0 - right) + value(column + 1, row) * right;
        let lower = value(column, row + 1) * (1.0 - right) + value(column + 1, row + 1) * right;
        upper * (1.0 - down) + lower * down
    };
    let offsets = [-0.375, -0.125, 0.125, 0.375];
    let pixels = (0..height_px).flat_map(|row| (0..width_px).map(move |column| (column, row)));
    let pixels = pixels.map(|(column, row)| {
        let (x, y) = (column as f64, row as f64);
        let sum: f64 = offsets.iter().flat_map(|dy| offsets.map(|dx| at(x + dx, y + dy))).sum();
        (sum / 16.0).round() as u8
    });
    GrayImage::new(width_px, height_px, pixels.collect()).unwrap()
}

/// Where a homography takes a position.
pub(crate) fn mapped(homography: &Matrix3<f64>, position: Point2<f64>) -> Point2<f64> {
    let mapped = homography * position.to_homogeneous();
    Point2::new(mapped.x / mapped.z, mapped.y / mapped.z)
}

/// A turn about the middle of a view, a scale, and a shift, that takes a view to a picture.
pub(crate) fn similarity(
    turn_rad: f64,
    scale: f64,
    view_px: (usize, usize),
    picture_px: usize,
) -> Matrix3<f64> {
    let (sin, cos) = (scale * turn_rad.sin(), scale * turn_rad.cos());
    let (x, y) = (view_px.0 as f64 / 2.0, view_px.1 as f64 / 2.0);
    let middle = picture_px as f64 / 2.0;
    Matrix3::new(
        cos,
        -sin,
        middle - cos * x + sin * y,
        sin,
        cos,
        middle - sin * x - cos * y,
        0.0,
        0.0,
        1.0,
    )
}
