//! How long line segments take in a folder of frames; `benches/compare_lines_with_opencv.py` runs it beside OpenCV:
//!
//! `cargo run --release -p pose --example line_features -- FRAMES_DIR THREADS`
//!
//! Prints how many milliseconds the segments of an image took: the median, the least, and the mean of the processor time of
//! the calling thread (Linux; else 0); then how many segments an image had, and how long they were in the mean.
// An example may stop where it stands, and prints.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "shared/measuring.rs"]
mod measuring;

use std::sync::Arc;
use std::{fs, time::Instant};

use estimation::ScopedThreads;
use pose::{
    feature::lines::{LineConfig, LineDetector},
    image::GrayImage,
};

use measuring::{processor_ms, read};

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, frames, threads] = &arguments[..] else {
        println!("usage: line_features FRAMES_DIR THREADS");
        return;
    };
    let mut paths: Vec<_> =
        fs::read_dir(frames).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let images: Vec<GrayImage> = paths.iter().map(|path| read(path)).collect();
    let config = LineConfig::default();
    let mut detector = LineDetector::new(config)
        .unwrap()
        .with_executor(Arc::new(ScopedThreads::new(threads.parse().unwrap())));
    // The first image only warms up.
    let (mut count, mut length_px) = (0, 0.0);
    detector.detect(&images[0]);
    let (mut passed_ms, mut on_processor_ms) = (Vec::new(), 0.0);
    for image in &images {
        let (start, processor_start_ms) = (Instant::now(), processor_ms());
        let segments = detector.detect(image);
        passed_ms.push(start.elapsed().as_secs_f64() * 1e3);
        on_processor_ms += processor_ms() - processor_start_ms;
        count += segments.len();
        length_px += segments.iter().map(|segment| f64::from(segment.length_px())).sum::<f64>();
    }
    passed_ms.sort_by(f64::total_cmp);
    let (median_ms, least_ms) = (passed_ms[passed_ms.len() / 2], passed_ms[0]);
    println!("{median_ms:.4} {least_ms:.4} {:.4}", on_processor_ms / images.len() as f64);
    println!("{:.1} {:.1}", count as f64 / images.len() as f64, length_px / count as f64);
}
