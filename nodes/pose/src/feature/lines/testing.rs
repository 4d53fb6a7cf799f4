//! What several tests share: images of known edges, and noise.

use nalgebra::{Point2, Rotation2, Vector2};

use super::{LineConfig, LineDetector, LineSegment};
use crate::image::GrayImage;

/// Numbers of mean 0 and deviation 1, always the same (a linear congruential generator: 12 uniform numbers, less 6).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A picture that is drawn: a gray for each position.
pub(crate) struct Picture {
    pub(crate) width_px: usize,
    pub(crate) height_px: usize,
    levels: Vec<f64>,
}

impl Picture {
    pub(crate) fn flat(width_px: usize, height_px: usize, level: f64) -> Self {
        Self { width_px, height_px, levels: vec![level; width_px * height_px] }
    }

    /// Draws a shape, each pixel by the share of it that is inside: at 16 x 16 positions, unless its corners agree.
    pub(crate) fn with(mut self, level: f64, is_inside: impl Fn(Point2<f64>) -> bool) -> Self {
        const FINE: usize = 16;
        let share = |column: usize, row: usize, fine: usize| {
            let inside = (0..fine * fine).filter(|place| {
                let [x, y] = [(column, place % fine), (row, place / fine)]
                    .map(|(whole, place)| whole as f64 - 0.5 + (place as f64 + 0.5) / fine as f64);
                is_inside(Point2::new(x, y))
            });
            inside.count() as f64 / (fine * fine) as f64
        };
        // The corners of all pixels, at every half.
        let columns = self.width_px + 1;
        let corners: Vec<bool> = (0..columns * (self.height_px + 1))
            .map(|corner| {
                let [x, y] = [corner % columns, corner / columns].map(|place| place as f64 - 0.5);
                is_inside(Point2::new(x, y))
            })
            .collect();
        for (index, at) in self.levels.iter_mut().enumerate() {
            let (column, row) = (index % self.width_px, index / self.width_px);
            let corner = row * columns + column;
            let around = [corner, corner + 1, corner + columns, corner + columns + 1]
                .map(|corner| usize::from(corners[corner]));
            let share = match around.iter().sum() {
                0_usize => 0.0,
                4 => 1.0,
                _ => share(column, row, FINE),
            };
            *at += share * (level - *at);
        }
        self
    }

    pub(crate) fn with_rectangle(self, level: f64, rectangle: &Rectangle) -> Self {
        self.with(level, |position| rectangle.contains(position))
    }

    pub(crate) fn with_noise(mut self, std_dev: f64, seed: u64) -> Self {
        let mut random = Random::new(seed);
        for level in &mut self.levels {
            *level += std_dev * random.normal();
        }
        self
    }

    pub(crate) fn map(mut self, change: impl Fn(f64) -> f64) -> Self {
        for level in &mut self.levels {
            *level = change(*level);
        }
        self
    }

    pub(crate) fn image(&self) -> GrayImage {
        let pixels = self.levels.iter().map(|level| level.round().clamp(0.0, 255.0) as u8);
        GrayImage::new(self.width_px, self.height_px, pixels.collect()).unwrap()
    }
}

/// A rectangle that is turned about its middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rectangle {
    pub(crate) middle: Point2<f64>,
    pub(crate) half: Vector2<f64>,
    pub(crate) turn_rad: f64,
}

impl Rectangle {
    pub(crate) fn new(middle: [f64; 2], half: [f64; 2], turn_rad: f64) -> Self {
        Self { middle: middle.into(), half: half.into(), turn_rad }
    }

    pub(crate) fn contains(&self, position: Point2<f64>) -> bool {
        let off = Rotation2::new(-self.turn_rad) * (position - self.middle);
        off.x.abs() <= self.half.x && off.y.abs() <= self.half.y
    }

    /// Its sides, each so directed that the inside is on the left.
    pub(crate) fn sides(&self) -> [[Point2<f64>; 2]; 4] {
        let corner = |x: f64, y: f64| {
            let off = Vector2::new(x * self.half.x, y * self.half.y);
            self.middle + Rotation2::new(self.turn_rad) * off
        };
        let corners = [corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)];
        std::array::from_fn(|side| [corners[side], corners[(side + 1) % 4]])
    }
}

/// A picture of many edges in all directions, and some noise.
pub(crate) fn busy_picture(width_px: usize, height_px: usize, seed: u64) -> Picture {
    let mut numbers = Random::new(seed);
    let mut picture = Picture::flat(width_px, height_px, 120.0);
    for _ in 0..25 {
        let [x, y, a, b, turn, level] = std::array::from_fn(|_| numbers.uniform());
        let rectangle = Rectangle::new(
            [x * width_px as f64, y * height_px as f64],
            [10.0 + 40.0 * a, 8.0 + 25.0 * b],
            4.0 * turn,
        );
        picture = picture.with_rectangle(30.0 + 200.0 * level, &rectangle);
    }
    picture.with_noise(2.0, seed + 1)
}

pub(crate) fn detect(image: &GrayImage) -> Vec<LineSegment> {
    LineDetector::new(LineConfig::default()).unwrap().detect(image)
}

/// How far the farther end of a segment is from the line through two points.
pub(crate) fn off_line_px(segment: &LineSegment, [from, to]: [Point2<f64>; 2]) -> f64 {
    let direction = (to - from).normalize();
    let off = |end: [f32; 2]| direction.perp(&(Point2::from(end.map(f64::from)) - from)).abs();
    off(segment.start_px).max(off(segment.end_px))
}

/// How far each end of a segment is from the one that it should be at.
pub(crate) fn end_errors_px(segment: &LineSegment, [from, to]: [Point2<f64>; 2]) -> [f64; 2] {
    let distance = |end: [f32; 2], to: Point2<f64>| (Point2::from(end.map(f64::from)) - to).norm();
    [distance(segment.start_px, from), distance(segment.end_px, to)]
}

/// Whether two segments have the same ends, within this many pixels.
pub(crate) fn are_alike(one: &LineSegment, other: &LineSegment, within_px: f64) -> bool {
    let ends = [other.start_px, other.end_px].map(|end| Point2::from(end.map(f64::from)));
    end_errors_px(one, ends).into_iter().all(|error| error <= within_px)
}

/// Which share of the segments, by length, have their like among others.
pub(crate) fn share_found(
    segments: &[LineSegment],
    among: &[LineSegment],
    is_alike: impl Fn(&LineSegment, &LineSegment) -> bool,
) -> f32 {
    let length = |segments: &mut dyn Iterator<Item = &LineSegment>| -> f32 {
        segments.map(LineSegment::length_px).sum()
    };
    let is_found = |one: &&LineSegment| among.iter().any(|other| is_alike(one, other));
    length(&mut segments.iter().filter(is_found)) / length(&mut segments.iter())
}
