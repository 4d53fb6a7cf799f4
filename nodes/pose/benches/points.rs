//! How long the steps from a driver's image to matched corners take, at 640 x 480 pixels:
//! `cargo bench -p pose --bench points`.
// A benchmark may stop where it stands, and exports nothing.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::num::NonZeroUsize;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use estimation::ScopedThreads;
use geometry::{CameraModel, Distortion};
use pose::{
    feature::points::{PointConfig, PointExtractor},
    image::{GrayImage, RawImage, Rectification, blurred, gray_from_raw},
    matching::points::{
        CornerGrid, GuidedConfig, MatchConfig, PredictedCorner, match_all, match_guided,
    },
};

const WIDTH_PX: usize = 640;
const HEIGHT_PX: usize = 480;
const DISCS: usize = 3000;

/// Discs of all sizes that lie upon each other, shifted to the right, under noise.
fn scene(shift_px: usize) -> Vec<u8> {
    let mut seed = 1_u64;
    let mut random = |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below
    };
    let mut pixels = vec![128_u8; WIDTH_PX * HEIGHT_PX];
    for _ in 0..DISCS {
        let (x, y) = (random(WIDTH_PX) + shift_px, random(HEIGHT_PX));
        let (gray, radius) = (random(220) as u8, 2 + 200 / (2 + random(60)));
        for row in y.saturating_sub(radius)..(y + radius).min(HEIGHT_PX) {
            let half = (radius.pow(2) - row.abs_diff(y).pow(2)).isqrt();
            let columns = x.saturating_sub(half).min(WIDTH_PX)..(x + half).min(WIDTH_PX);
            pixels[row * WIDTH_PX..][columns].fill(gray);
        }
    }
    for pixel in &mut pixels {
        *pixel += random(5) as u8;
    }
    pixels
}

fn steps(criterion: &mut Criterion) {
    let image = GrayImage::new(WIDTH_PX, HEIGHT_PX, scene(0)).unwrap();
    let shifted = GrayImage::new(WIDTH_PX, HEIGHT_PX, scene(5)).unwrap();
    for (encoding, channels) in [("rgb8", 3), ("bayer_rggb8", 1), ("yuv422", 2)] {
        let data: Vec<u8> =
            image.pixels().iter().flat_map(|&gray| std::iter::repeat_n(gray, channels)).collect();
        let raw = RawImage {
            width_px: WIDTH_PX,
            height_px: HEIGHT_PX,
            encoding: encoding.parse().unwrap(),
            is_big_endian: false,
            step_bytes: channels * WIDTH_PX,
            data: &data,
        };
        criterion.bench_function(&format!("gray from {encoding}"), |bencher| {
            bencher.iter(|| gray_from_raw(black_box(&raw)).unwrap());
        });
    }
    let camera = CameraModel {
        width_px: WIDTH_PX,
        height_px: HEIGHT_PX,
        fx_px: 517.3,
        fy_px: 516.5,
        cx_px: 318.6,
        cy_px: 255.3,
        distortion: Distortion::PlumbBob([0.2624, -0.9531, -0.0054, 0.0026, 1.1633]),
    };
    let rectification = Rectification::new(&camera).unwrap();
    criterion.bench_function("rectify", |bencher| {
        bencher.iter(|| rectification.rectify(black_box(&image)).unwrap());
    });
    criterion.bench_function("blur", |bencher| bencher.iter(|| blurred(black_box(&image))));
    for (name, levels, threads) in
        [("1 level", 1, 1), ("8 levels", 8, 1), ("8 levels, 2 threads", 8, 2)]
    {
        let config = PointConfig { levels, ..PointConfig::default() };
        let threads = ScopedThreads::new(NonZeroUsize::new(threads).unwrap());
        let mut extractor = PointExtractor::new(config).unwrap().with_executor(Arc::new(threads));
        criterion.bench_function(&format!("extract 1000 corners, {name}"), |bencher| {
            bencher.iter(|| extractor.extract(black_box(&image)));
        });
    }
    let mut extractor = PointExtractor::new(PointConfig::default()).unwrap();
    let (first, second) = (extractor.extract(&image), extractor.extract(&shifted));
    criterion.bench_function("match 1000 with 1000, blind", |bencher| {
        bencher.iter(|| match_all(black_box(&first), &second, &MatchConfig::default()));
    });
    let predictions: Vec<PredictedCorner> = first
        .iter()
        .map(|corner| PredictedCorner {
            pixel: corner.pixel,
            level: corner.level,
            angle_rad: Some(corner.angle_rad),
            descriptor: corner.descriptor,
        })
        .collect();
    criterion.bench_function("match 1000 with 1000, guided", |bencher| {
        bencher.iter(|| {
            let grid = CornerGrid::new(black_box(&second));
            match_guided(&predictions, &grid, &GuidedConfig::default())
        });
    });
}

criterion_group!(benches, steps);
criterion_main!(benches);
