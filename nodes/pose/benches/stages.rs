//! How long each stage of a frame takes, from a driver's images to the pose, by one thread and by two:
//!
//! ```text
//! cargo bench -p pose --bench stages [-- TUM_FOLDER]
//! ```
//!
//! The folder is a sequence in TUM's form, of 640 x 480 pixels by the first Kinect. Without one a wall of rectangles and discs
//! goes past the camera, 2 m before it.
// A benchmark may stop where it stands, and prints.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::collections::BTreeMap;
use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use estimation::ScopedThreads;
use geometry::{CameraModel, DepthImage, DepthPixels, Distortion, Stamp};
use pose::feature::lines::LineDetector;
use pose::feature::points::PointExtractor;
use pose::frame::{FrameConfig, FrameExtractor};
use pose::image::{RawImage, Rectification, gray_from_raw};
use pose::tracking::{Hints, Tracker, TrackerConfig};

const WIDTH_PX: usize = 640;
const HEIGHT_PX: usize = 480;
/// Frames of the wall.
const FRAMES: usize = 200;
/// The speed at which the wall passes.
const SHIFT_PX: usize = 2;
/// Depths of TUM's images in a metre.
const TUM_DEPTH_SCALE: f32 = 5000.0;
/// Images of a pair are no farther apart.
const PAIR_GAP_S: f64 = 0.02;
/// The stages, in their order; the first ones make the total, and the last two are of one thread alone.
const STAGES: [&str; 7] = [
    "gray",
    "rectification",
    "points and lines with their depths",
    "pose and map",
    "all of it",
    "points alone",
    "lines alone",
];

/// A pair of images.
struct Pair {
    stamp: Stamp,
    rgb: Vec<u8>,
    depth_m: Vec<f32>,
}

fn main() {
    let folder = std::env::args().skip(1).find(|argument| !argument.starts_with("--"));
    let (pairs, camera) = match &folder {
        Some(folder) => (sequence(Path::new(folder)), freiburg1()),
        None => (wall(), CameraModel { distortion: Distortion::None, ..freiburg1() }),
    };
    let name = folder.as_deref().unwrap_or("a wall");
    println!(
        "{} pairs of {name}, times in ms: median, 99 in 100 are no longer, least",
        pairs.len()
    );
    for threads in [1, 2] {
        let mut times = times_of(&pairs, &camera, threads);
        println!("{threads} thread(s)");
        for stage in STAGES {
            let Some(times) = times.get_mut(stage) else { continue };
            times.sort_by(f64::total_cmp);
            let (median, p99) = (times[times.len() / 2], times[(times.len() - 1) * 99 / 100]);
            let least = times[0];
            let rate_hz = 1e3 / median;
            println!("  {stage:<18}{median:7.2}{p99:8.2}{least:8.2}   {rate_hz:5.0} a second");
        }
    }
}

fn times_of(
    pairs: &[Pair],
    camera: &CameraModel,
    threads: usize,
) -> BTreeMap<&'static str, Vec<f64>> {
    let frame = FrameConfig::default();
    let mut points = PointExtractor::new(frame.points.clone()).unwrap();
    let mut lines = LineDetector::new(frame.lines).unwrap();
    let most_lines = frame.max_lines;
    let mut extractor = FrameExtractor::new(frame.clone())
        .unwrap()
        .with_executor(Arc::new(ScopedThreads::new(NonZeroUsize::new(threads).unwrap())));
    let mut tracker = Tracker::new(TrackerConfig { frame, ..TrackerConfig::default() }).unwrap();
    let rectification = Rectification::new(camera).unwrap();
    let target = *rectification.target();
    let mut times = BTreeMap::<&'static str, Vec<f64>>::new();
    for pair in pairs {
        let raw = RawImage {
            width_px: WIDTH_PX,
            height_px: HEIGHT_PX,
            encoding: "rgb8".parse().unwrap(),
            is_big_endian: false,
            step_bytes: 3 * WIDTH_PX,
            data: &pair.rgb,
        };
        let pixels = DepthPixels::Metres(pair.depth_m.clone());
        let size = (WIDTH_PX, HEIGHT_PX);
        let depth = DepthImage::new(pair.stamp, "camera".to_owned(), size, pixels).unwrap();
        let mut marks = vec![("", Instant::now())];
        let gray = gray_from_raw(&raw).unwrap();
        marks.push(("gray", Instant::now()));
        let (gray, depth) = if camera.distortion.is_none() {
            (gray, depth)
        } else {
            (rectification.rectify(&gray).unwrap(), rectification.rectify_depth(&depth).unwrap())
        };
        marks.push(("rectification", Instant::now()));
        let frame = extractor.extract(&gray, &depth, &target).unwrap();
        marks.push(("points and lines with their depths", Instant::now()));
        tracker.step(&frame, &target, &Hints::default());
        marks.push(("pose and map", Instant::now()));
        let mut note = |stage, from: Instant, to: Instant| {
            times.entry(stage).or_default().push((to - from).as_secs_f64() * 1e3);
        };
        for step in marks.windows(2) {
            note(step[1].0, step[0].1, step[1].1);
        }
        note("all of it", marks[0].1, marks[marks.len() - 1].1);
        if threads == 1 {
            let start = Instant::now();
            points.extract(&gray);
            note("points alone", start, Instant::now());
            let start = Instant::now();
            let mut segments = lines.detect(&gray);
            segments.truncate(most_lines);
            let _described = lines.describe(&segments);
            note("lines alone", start, Instant::now());
        }
    }
    times
}

/// As the authors of the data set calibrated it.
fn freiburg1() -> CameraModel {
    CameraModel {
        width_px: WIDTH_PX,
        height_px: HEIGHT_PX,
        fx_px: 517.3,
        fy_px: 516.5,
        cx_px: 318.6,
        cy_px: 255.3,
        distortion: Distortion::PlumbBob([0.2624, -0.9531, -0.0054, 0.0026, 1.1633]),
    }
}

fn sequence(folder: &Path) -> Vec<Pair> {
    let list = |name: &str| -> Vec<(f64, String)> {
        let text = fs::read_to_string(folder.join(name)).unwrap();
        let entry = |line: &str| {
            let (stamp, path) = line.split_once(' ')?;
            Some((stamp.parse().ok()?, path.trim().to_owned()))
        };
        text.lines().filter_map(entry).collect()
    };
    let depths = list("depth.txt");
    let pair = |(stamp_s, path): (f64, String)| {
        let gap_s = |depth: &&(f64, String)| (depth.0 - stamp_s).abs();
        let nearest = depths.iter().min_by(|one, other| gap_s(one).total_cmp(&gap_s(other)))?;
        if gap_s(&nearest) > PAIR_GAP_S {
            return None;
        }
        let depth = image::open(folder.join(&nearest.1)).unwrap().into_luma16();
        let depth_m = depth.iter().map(|&units| match units {
            0 => f32::NAN,
            units => f32::from(units) / TUM_DEPTH_SCALE,
        });
        Some(Pair {
            stamp: Stamp::from_nanos((stamp_s * 1e9) as i64),
            rgb: image::open(folder.join(path)).unwrap().into_rgb8().into_raw(),
            depth_m: depth_m.collect(),
        })
    };
    list("rgb.txt").into_iter().filter_map(pair).collect()
}

/// Rectangles and discs that lie upon each other, under noise; each frame shows a part that is farther to the right.
fn wall() -> Vec<Pair> {
    let mut seed = 1_u64;
    let mut random = |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below
    };
    let width_px = WIDTH_PX + FRAMES * SHIFT_PX;
    let mut wall = vec![128_u8; width_px * HEIGHT_PX];
    for index in 0..3000 {
        let (x, y, gray) = (random(width_px), random(HEIGHT_PX), random(220) as u8);
        let (radius, is_disc) = (2 + 200 / (2 + random(60)), index % 2 == 0);
        for row in y.saturating_sub(radius)..(y + radius).min(HEIGHT_PX) {
            let off = row.abs_diff(y);
            let half = if is_disc { (radius.pow(2) - off.pow(2)).isqrt() } else { radius };
            let columns = x.saturating_sub(half)..(x + half).min(width_px);
            wall[row * width_px..][columns].fill(gray);
        }
    }
    (0..FRAMES)
        .map(|frame| {
            let rows = wall.chunks(width_px).map(|row| &row[frame * SHIFT_PX..][..WIDTH_PX]);
            let gray: Vec<u8> = rows.flatten().map(|gray| gray + random(5) as u8).collect();
            let depth_m = gray.iter().map(|_| 2.0 + 0.002 * (random(7) as f32 - 3.0)).collect();
            Pair {
                stamp: Stamp::from_nanos(frame as i64 * 33_333_333),
                rgb: gray.iter().flat_map(|&gray| [gray; 3]).collect(),
                depth_m,
            }
        })
        .collect()
}
