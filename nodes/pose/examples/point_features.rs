//! The corners and matches of a folder of frames, for `benches/compare_with_opencv.py`:
//!
//! `cargo run --release -p pose --example point_features -- FRAMES_DIR OUT_DIR [STEP] [key=value ...]`
//!
//! Writes for each frame `NNN.corners` (x, y, level, angle, response as five little-endian f32, then 32 bytes of
//! descriptor, for each corner), and for each pair of frames 1 and 5 apart `NNN-MMM.matches` (pairs of u32). Prints
//! how long an extraction took, for 1 and 2 threads.
// An example may stop where it stands, and prints.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::{fs, path::Path, time::Instant};

use pose::{
    feature::points::{Corner, PointConfig, PointExtractor},
    image::GrayImage,
    matching::points::{MatchConfig, match_all},
};

fn read(path: &Path) -> GrayImage {
    let picture = image::open(path).unwrap().to_rgb8();
    let gray = picture.pixels().map(|pixel| {
        let [r, g, b] = pixel.0.map(u32::from);
        ((r * 77 + g * 150 + b * 29 + 128) >> 8) as u8
    });
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    GrayImage::new(width, height, gray.collect()).unwrap()
}

fn bytes(corner: &Corner) -> Vec<u8> {
    let numbers = [
        corner.pixel.x,
        corner.pixel.y,
        f32::from(corner.level),
        corner.angle_rad,
        corner.response,
    ];
    let numbers = numbers.into_iter().flat_map(f32::to_le_bytes);
    numbers.chain(corner.descriptor.0.into_iter().flat_map(u64::to_le_bytes)).collect()
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let (frames, out) = (Path::new(&arguments[1]), Path::new(&arguments[2]));
    let mut paths: Vec<_> =
        fs::read_dir(frames).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    fs::create_dir_all(out).unwrap();
    let images: Vec<GrayImage> = paths.iter().map(|path| read(path)).collect();
    for threads in [2, 1] {
        if std::env::var("Q").is_ok() {
            break;
        }
        let config = PointConfig { threads, ..PointConfig::default() };
        let mut extractor = PointExtractor::new(config).unwrap();
        let mut times_ms: Vec<f64> = Vec::new();
        for image in images.iter().chain(&images) {
            let start = Instant::now();
            extractor.extract(image);
            times_ms.push(start.elapsed().as_secs_f64() * 1e3);
        }
        times_ms.sort_by(f64::total_cmp);
        let (least, median) = (times_ms[0], times_ms[times_ms.len() / 2]);
        println!("{threads} threads: {median:.3} ms a frame (median), {least:.3} (least)");
    }
    let low: u8 = std::env::var("LOW").map_or(7, |v| v.parse().unwrap());
    let hi: u8 = std::env::var("HI").map_or(20, |v| v.parse().unwrap());
    let cell: usize = std::env::var("CELL").map_or(32, |v| v.parse().unwrap());
    let mut extractor = PointExtractor::new(PointConfig {
        low_threshold: low,
        threshold: hi,
        cell_px: cell,
        even_share: std::env::var("EVEN").map_or(0.5, |v| v.parse().unwrap()),
        ..PointConfig::default()
    })
    .unwrap();
    let corners: Vec<Vec<Corner>> = images.iter().map(|image| extractor.extract(image)).collect();
    for (index, corners) in corners.iter().enumerate() {
        let bytes: Vec<u8> = corners.iter().flat_map(bytes).collect();
        fs::write(out.join(format!("{index:03}.corners")), bytes).unwrap();
    }
    let mut times_ms: Vec<f64> = Vec::new();
    for apart in [1, 5] {
        for (index, pair) in corners.windows(apart + 1).enumerate() {
            let start = Instant::now();
            let matches = match_all(&pair[0], &pair[apart], &MatchConfig::default());
            times_ms.push(start.elapsed().as_secs_f64() * 1e3);
            let indices = matches.iter().flat_map(|pair| [pair.sought as u32, pair.found as u32]);
            let bytes: Vec<u8> = indices.flat_map(u32::to_le_bytes).collect();
            fs::write(out.join(format!("{index:03}-{:03}.matches", index + apart)), bytes).unwrap();
        }
    }
    times_ms.sort_by(f64::total_cmp);
    println!("matching: {:.3} ms a pair (median)", times_ms[times_ms.len() / 2]);
}
