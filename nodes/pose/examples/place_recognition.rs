//! How well places are known again on recorded images.
//!
//! ```text
//! cargo run --release -p pose --example place_recognition -- TUM_FOLDER [STRANGERS_FOLDER]
//! ```
//!
//! `TUM_FOLDER` is a sequence of the TUM RGB-D data set (`rgb.txt`, `groundtruth.txt`); `STRANGERS_FOLDER` holds JPEG images
//! of other places. Every fifth image is a keyframe; all others are compared with all keyframes that are not their
//! neighbours in time. A pair is of the same view when the cameras look in the same direction to 15 degrees and are within half a
//! metre, and of another one beyond 45 degrees, or when the image is a stranger's; pairs in between are not counted.
//!
//! **Recall** is the share of pairs of the same view with at least this many votes; **precision** the share of pairs of the
//! same view among all that have them. **First** is the share of images whose best keyframe is of the same view, of those
//! that have one.

#![allow(clippy::print_stdout)]

use std::error::Error;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use pose::feature::lines::{LineConfig, LineDescriptor, LineDetector, LineFeature};
use pose::feature::points::{Corner, Descriptor, PointConfig, PointExtractor};
use pose::frame::Frame;
use pose::image::GrayImage;
use pose::map::{KeyframeId, Map, MapConfig, NewKeyframe};
use pose::place_recognition::{PlaceConfig, PlaceDatabase, Score};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// One image in this many is a keyframe.
const KEYFRAME_STEP: usize = 5;
/// Images this near in time are not compared.
const APART_S: f64 = 0.5;
/// The same view.
const SAME_RAD: f64 = 15.0 * std::f64::consts::PI / 180.0;
const SAME_M: f64 = 0.5;
/// Another view.
const OTHER_RAD: f64 = 45.0 * std::f64::consts::PI / 180.0;
/// Segments of an image that are described.
const MAX_LINES: usize = 200;
/// The printed figures.
const VOTES: [u32; 7] = [20, 30, 40, 50, 70, 100, 150];

type Outcome<T> = Result<T, Box<dyn Error>>;

struct View {
    /// `None` for a stranger's.
    taken: Option<(f64, Isometry3<f64>)>,
    frame: Arc<Frame>,
    corners: Vec<Descriptor>,
    segments: Vec<LineDescriptor>,
}

#[derive(Clone, Copy, PartialEq)]
enum Truth {
    Same,
    Other,
    Between,
}

fn main() -> Outcome<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("no folder of a TUM sequence")?);
    let mut views = sequence(&folder)?;
    let own = views.len();
    if let Some(strangers) = arguments.next() {
        views.extend(strangers_of(Path::new(&strangers))?);
    }
    println!("{own} images of the sequence, {} of strangers", views.len() - own);
    let ids = ids(own.div_ceil(KEYFRAME_STEP))?;
    let mut corners = PlaceDatabase::new(PlaceConfig::default());
    let mut segments = PlaceDatabase::new(PlaceConfig::default());
    for (id, view) in ids.iter().zip(views.iter().take(own).step_by(KEYFRAME_STEP)) {
        corners.insert(*id, &view.frame);
        segments.insert_lines(*id, &view.frame);
    }
    report("corners", &views, &ids, |view| corners.query(&view.corners));
    report("segments", &views, &ids, |view| segments.query_lines(&view.segments));
    report("both", &views, &ids, |view| {
        sum(corners.query(&view.corners), &segments.query_lines(&view.segments))
    });
    Ok(())
}

/// The votes of both, for the keyframes that have some of the first.
fn sum(mut scores: Vec<Score>, others: &[Score]) -> Vec<Score> {
    for score in &mut scores {
        if let Some(other) = others.iter().find(|other| other.keyframe == score.keyframe) {
            score.votes += other.votes;
            score.score += other.score;
        }
    }
    scores.sort_by(|one, other| other.score.total_cmp(&one.score));
    scores
}

fn report(name: &str, views: &[View], ids: &[KeyframeId], query: impl Fn(&View) -> Vec<Score>) {
    let (mut same, mut hits, mut false_hits) = (0, [0; VOTES.len()], [0; VOTES.len()]);
    let (mut asked, mut first) = (0, 0);
    let (mut strangers, mut strangers_most) = (0, 0);
    let mut times_ms = Vec::new();
    for (index, view) in views.iter().enumerate() {
        if view.taken.is_some() && index % KEYFRAME_STEP == 0 {
            continue;
        }
        let start = Instant::now();
        let scores = query(view);
        times_ms.push(start.elapsed().as_secs_f64() * 1e3);
        let mut is_asked = false;
        let mut best: Option<(f64, Truth)> = None;
        for (number, id) in ids.iter().enumerate() {
            let keyframe = &views[number * KEYFRAME_STEP];
            let Some(truth) = truth(view, keyframe) else { continue };
            let score = scores.iter().find(|score| score.keyframe == *id);
            let votes = score.map_or(0, |score| score.votes);
            is_asked |= truth == Truth::Same;
            same += usize::from(truth == Truth::Same);
            for (place, least) in VOTES.iter().enumerate() {
                hits[place] += usize::from(truth == Truth::Same && votes >= *least);
                false_hits[place] += usize::from(truth == Truth::Other && votes >= *least);
            }
            if view.taken.is_none() {
                strangers_most = strangers_most.max(votes);
            }
            let score = score.map_or(0.0, |score| score.score);
            if best.is_none_or(|(most, _)| score > most) {
                best = Some((score, truth));
            }
        }
        strangers += usize::from(view.taken.is_none());
        asked += usize::from(is_asked);
        first += usize::from(is_asked && best.is_some_and(|(_, truth)| truth == Truth::Same));
    }
    times_ms.sort_by(f64::total_cmp);
    println!(
        "\n{name}: {same} pairs of the same view; first {first} of {asked}; a query takes {:.2} ms",
        times_ms[times_ms.len() / 2]
    );
    println!("{strangers} strangers have at most {strangers_most} votes");
    println!("| votes | recall | precision |\n|---|---|---|");
    for (place, least) in VOTES.iter().enumerate() {
        let (hits, false_hits) = (hits[place] as f64, false_hits[place] as f64);
        println!("| {least} | {:.3} | {:.3} |", hits / same as f64, hits / (hits + false_hits));
    }
}

/// `None` for pairs that are not compared.
fn truth(view: &View, keyframe: &View) -> Option<Truth> {
    let (at_s, pose) = keyframe.taken?;
    let Some((when_s, where_)) = view.taken else { return Some(Truth::Other) };
    if (when_s - at_s).abs() < APART_S {
        return None;
    }
    let angle = (pose.rotation * Vector3::z()).angle(&(where_.rotation * Vector3::z()));
    let apart_m = (pose.translation.vector - where_.translation.vector).norm();
    Some(if angle < SAME_RAD && apart_m < SAME_M {
        Truth::Same
    } else if angle > OTHER_RAD {
        Truth::Other
    } else {
        Truth::Between
    })
}

/// Numbers of keyframes, which only a map gives.
fn ids(count: usize) -> Outcome<Vec<KeyframeId>> {
    let mut map = Map::new(MapConfig::default());
    let frame = frame_of(Vec::new(), Vec::new());
    let camera = geometry::CameraModel {
        width_px: 640,
        height_px: 480,
        fx_px: 525.0,
        fy_px: 525.0,
        cx_px: 319.5,
        cy_px: 239.5,
        distortion: geometry::Distortion::None,
    };
    let mut ids = Vec::new();
    for _ in 0..count {
        ids.push(map.insert_keyframe(NewKeyframe {
            camera,
            camera_from_map: Isometry3::identity(),
            frame: Arc::clone(&frame),
            points: &[],
            lines: &[],
            by_odometry: None,
        })?);
    }
    Ok(ids)
}

fn sequence(folder: &Path) -> Outcome<Vec<View>> {
    let mut truth = Vec::new();
    for row in rows(&folder.join("groundtruth.txt"))? {
        let numbers: Vec<f64> =
            row.iter().map(|number| number.parse()).collect::<Result<_, _>>()?;
        let [at_s, x, y, z, i, j, k, w] = numbers[..] else { continue };
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        truth.push((at_s, Isometry3::from_parts(Translation3::new(x, y, z), turn)));
    }
    let (mut points, mut lines) = extractors()?;
    let mut views = Vec::new();
    for row in rows(&folder.join("rgb.txt"))? {
        let path = folder.join(&row[1]);
        if !path.exists() {
            continue;
        }
        let at_s: f64 = row[0].parse()?;
        let near = truth
            .iter()
            .min_by(|one, other| (one.0 - at_s).abs().total_cmp(&(other.0 - at_s).abs()));
        let pose = near.ok_or("no ground truth")?.1;
        let image = image::open(&path)?.into_luma8();
        let (width, height) = (image.width() as usize, image.height() as usize);
        let image = GrayImage::new(width, height, image.into_raw())?;
        views.push(view(&image, Some((at_s, pose)), &mut points, &mut lines));
    }
    Ok(views)
}

fn strangers_of(folder: &Path) -> Outcome<Vec<View>> {
    let mut names: Vec<PathBuf> = std::fs::read_dir(folder)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()?;
    names.retain(|path| path.extension().is_some_and(|extension| extension == "jpg"));
    names.sort();
    let (mut points, mut lines) = extractors()?;
    let mut views = Vec::new();
    for name in names {
        let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::Luma);
        let mut decoder =
            JpegDecoder::new_with_options(Cursor::new(std::fs::read(&name)?), options);
        let pixels = decoder.decode()?;
        let (width, height) = decoder.dimensions().ok_or("an image without a size")?;
        let image = GrayImage::new(width, height, pixels)?;
        views.push(view(&image, None, &mut points, &mut lines));
    }
    Ok(views)
}

fn extractors() -> Outcome<(PointExtractor, LineDetector)> {
    Ok((PointExtractor::new(PointConfig::default())?, LineDetector::new(LineConfig::default())?))
}

fn view(
    image: &GrayImage,
    taken: Option<(f64, Isometry3<f64>)>,
    points: &mut PointExtractor,
    lines: &mut LineDetector,
) -> View {
    let mut segments = lines.detect(image);
    segments.truncate(MAX_LINES);
    let frame = frame_of(points.extract(image), lines.describe(&segments));
    let corners = frame.corners.iter().map(|corner| corner.descriptor).collect();
    let segments = frame.lines.iter().map(|line| line.descriptor).collect();
    View { taken, frame, corners, segments }
}

/// A frame without depths.
fn frame_of(corners: Vec<Corner>, lines: Vec<LineFeature>) -> Arc<Frame> {
    let (corner_depths, lines_in_space) = (vec![None; corners.len()], vec![None; lines.len()]);
    let stamp = geometry::Stamp::from_nanos(0);
    Arc::new(Frame { stamp, corners, corner_depths, lines, lines_in_space })
}

fn rows(path: &Path) -> Outcome<Vec<Vec<String>>> {
    let text = std::fs::read_to_string(path)?;
    let rows = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    Ok(rows.map(|row| row.split_whitespace().map(str::to_owned).collect()).collect())
}
