//! The corners and matches of a folder of frames; `benches/compare_points_with_opencv.py` runs it and judges them:
//!
//! `cargo run --release -p pose --example point_features -- FRAMES_DIR OUT_DIR THREADS EVEN_SHARE`
//!
//! Writes for each frame `NNN.corners` (x, y, level, angle, response as five little-endian f32, then 32 bytes of
//! descriptor, for each corner), and for each pair of frames 1 and 5 apart `NNN-MMM.matches` (pairs of u32). Prints
//! how many milliseconds an extraction and the matching of a pair took: the median, the least, and the mean of the
//! processor time of the calling thread (Linux; else 0).
// An example may stop where it stands, and prints.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "shared/measuring.rs"]
mod measuring;

use std::sync::Arc;
use std::{fs, path::Path, time::Instant};

use estimation::ScopedThreads;
use pose::{
    feature::points::{Corner, PointConfig, PointExtractor},
    image::GrayImage,
    matching::points::{MatchConfig, match_all},
};

use measuring::{processor_ms, read};

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, frames, out, threads, even_share] = &arguments[..] else {
        println!("usage: point_features FRAMES_DIR OUT_DIR THREADS EVEN_SHARE");
        return;
    };
    let out = Path::new(out);
    fs::create_dir_all(out).unwrap();
    let mut paths: Vec<_> =
        fs::read_dir(frames).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let images: Vec<GrayImage> = paths.iter().map(|path| read(path)).collect();
    let config = PointConfig { even_share: even_share.parse().unwrap(), ..PointConfig::default() };
    let mut extractor = PointExtractor::new(config)
        .unwrap()
        .with_executor(Arc::new(ScopedThreads::new(threads.parse().unwrap())));
    let mut extraction_ms = Vec::new();
    let mut corners = Vec::new();
    // The first image only warms up.
    for image in images.iter().take(1).chain(&images) {
        let corners_of = || corners.push(extractor.extract(image));
        extraction_ms.push(timed(corners_of));
    }
    corners.remove(0);
    for (index, corners) in corners.iter().enumerate() {
        let bytes: Vec<u8> = corners.iter().flat_map(bytes).collect();
        fs::write(out.join(format!("{index:03}.corners")), bytes).unwrap();
    }
    let mut matching_ms = Vec::new();
    for apart in [1, 5] {
        for (index, pair) in corners.windows(apart + 1).enumerate() {
            let mut matches = Vec::new();
            matching_ms.push(timed(|| {
                matches = match_all(&pair[0], &pair[apart], &MatchConfig::default());
            }));
            let indices = matches.iter().flat_map(|pair| [pair.sought as u32, pair.found as u32]);
            let bytes: Vec<u8> = indices.flat_map(u32::to_le_bytes).collect();
            fs::write(out.join(format!("{index:03}-{:03}.matches", index + apart)), bytes).unwrap();
        }
    }
    for mut times in [extraction_ms, matching_ms] {
        let mean = times.iter().map(|time| time.processor_ms).sum::<f64>() / times.len() as f64;
        times.sort_by(|a, b| a.passed_ms.total_cmp(&b.passed_ms));
        println!("{:.4} {:.4} {mean:.4}", times[times.len() / 2].passed_ms, times[0].passed_ms);
    }
}

struct Time {
    passed_ms: f64,
    processor_ms: f64,
}

fn timed(work: impl FnOnce()) -> Time {
    let (start, processor_start_ms) = (Instant::now(), processor_ms());
    work();
    Time {
        passed_ms: start.elapsed().as_secs_f64() * 1e3,
        processor_ms: processor_ms() - processor_start_ms,
    }
}

fn bytes(corner: &Corner) -> Vec<u8> {
    let Corner { pixel, level, angle_rad, response, descriptor } = corner;
    let numbers = [pixel.x, pixel.y, f32::from(*level), *angle_rad, *response];
    let numbers = numbers.into_iter().flat_map(f32::to_le_bytes);
    numbers.chain(descriptor.0.into_iter().flat_map(u64::to_le_bytes)).collect()
}
