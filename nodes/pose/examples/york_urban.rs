//! How well line segments are found in the images of York Urban (Denis, Elder and Estrada 2008), or in any folder of
//! JPEG images with labelled lines, and how long each step takes.
//!
//! ```text
//! cargo run --release -p pose --example york_urban -- FOLDER [--segments NAME=FOLDER]... [--out FOLDER]
//! ```
//!
//! `FOLDER` holds `NAME.jpg` and `NAME.lines.txt`, a labelled line `x1 y1 x2 y2 ...` in each row. `--segments` names a
//! folder of another detector's `NAME.segments.txt` (`x1 y1 x2 y2` in each row) for the same images, judged alike.
//! `--out` writes ours in this form.
//!
//! OpenCV's segments come of a few lines of Python with `opencv-contrib-python-headless`: on the gray image,
//! `cv2.ximgproc.createEdgeDrawing()` (`detectEdges`, `detectLines`), `cv2.createLineSegmentDetector()` and
//! `cv2.ximgproc.createFastLineDetector()` (`detect`), all with their defaults and `cv2.setNumThreads(1)`.
//!
//! # The measure
//!
//! A labelled line is sampled in the middle of each of its pixels of length. A sample counts when some segment covers
//! it: their directions differ by at most 5 degrees (in either order of the ends), the sample is at most 2 pixels off the segment's
//! line, and its foot is between the segment's ends. **Recall** is the share of all samples that count, weighted by
//! length: long lines count for more. **With slack** the foot may lie up to 2 pixels beyond an end. **Half covered** is
//! the share of lines of which more than half the samples count. Only lines along the three main directions are
//! labelled, so that nothing is said of segments that cover no line but their number.
//!
//! The time of an image is that of the processor, on one thread, and the least of several rounds: what other processes
//! do is no part of it.

#![allow(clippy::print_stdout)]

use std::error::Error;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::time::Duration;

use pose::feature::lines::{LineConfig, LineDetector, LineStep};
use pose::image::GrayImage;
use rustix::time::{ClockId, clock_gettime};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// A sample is covered within this much.
const NEAR_PX: f64 = 2.0;
/// Directions are the same within 5 degrees.
const SAME_DIRECTION_RAD: f64 = 0.087_266;
/// With slack a segment reaches this far beyond its ends.
const SLACK_PX: f64 = 2.0;
/// Rounds of which the quickest counts.
const ROUNDS: usize = 10;

type Ends = [[f64; 2]; 2];
type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let arguments = Arguments::parse()?;
    let mut names: Vec<PathBuf> = std::fs::read_dir(&arguments.folder)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()?;
    names.retain(|path| path.extension().is_some_and(|extension| extension == "jpg"));
    names.sort();

    let mut rows = vec![Row::new("this crate")];
    rows.extend(arguments.others.iter().map(|(name, _)| Row::new(name)));
    let mut timing = Timing::default();
    let mut detector = LineDetector::new(LineConfig::default())?;
    for name in &names {
        let image = gray(name)?;
        let labelled = lines_of(&name.with_extension("lines.txt"))?;
        let segments = timing.detect(&mut detector, &image);
        if let Some(out) = &arguments.out {
            write_segments(&beside(out, name)?, &segments)?;
        }
        rows[0].count(&labelled, &segments);
        for (row, (_, folder)) in rows[1..].iter_mut().zip(&arguments.others) {
            row.count(&labelled, &lines_of(&beside(folder, name)?)?);
        }
    }
    println!("{} images", names.len());
    println!("| detector | recall | with slack | half covered | segments an image | mean length |");
    println!("|---|---|---|---|---|---|");
    for row in &rows {
        row.print(names.len());
    }
    timing.print();
    Ok(())
}

struct Arguments {
    folder: PathBuf,
    others: Vec<(String, PathBuf)>,
    out: Option<PathBuf>,
}

impl Arguments {
    fn parse() -> Outcome<Self> {
        let (mut folder, mut others, mut out) = (None, Vec::new(), None);
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--segments" => {
                    let value = arguments.next().unwrap_or_default();
                    let (name, path) = value.split_once('=').ok_or("--segments NAME=FOLDER")?;
                    others.push((name.to_owned(), path.into()));
                }
                "--out" => out = Some(PathBuf::from(arguments.next().ok_or("--out FOLDER")?)),
                _ => folder = Some(argument.into()),
            }
        }
        let folder = folder.ok_or("which folder holds the images and their lines?")?;
        Ok(Self { folder, others, out })
    }
}

fn beside(folder: &Path, image: &Path) -> Outcome<PathBuf> {
    let name = image.with_extension("segments.txt");
    Ok(folder.join(name.file_name().ok_or("an image without a name")?))
}

fn gray(path: &Path) -> Outcome<GrayImage> {
    let bytes = std::fs::read(path)?;
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::Luma);
    let mut decoder = JpegDecoder::new_with_options(Cursor::new(bytes), options);
    let pixels = decoder.decode()?;
    let (width_px, height_px) = decoder.dimensions().ok_or("a JPEG without a size")?;
    Ok(GrayImage::new(width_px, height_px, pixels)?)
}

fn lines_of(path: &Path) -> Outcome<Vec<Ends>> {
    let text = std::fs::read_to_string(path)?;
    let numbers = |row: &str| -> Outcome<Ends> {
        let numbers: Vec<f64> = row.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        let [x1, y1, x2, y2, ..] = numbers[..] else {
            return Err("a row of too few numbers".into());
        };
        Ok([[x1, y1], [x2, y2]])
    };
    text.lines().filter(|row| !row.starts_with('#')).map(numbers).collect()
}

fn write_segments(path: &Path, segments: &[Ends]) -> Outcome<()> {
    let row = |[[x1, y1], [x2, y2]]: &Ends| format!("{x1:.3} {y1:.3} {x2:.3} {y2:.3}\n");
    Ok(std::fs::write(path, segments.iter().map(row).collect::<String>())?)
}

/// The counts of a detector.
struct Row {
    name: String,
    covered_px: f64,
    covered_with_slack_px: f64,
    labelled_px: f64,
    half_covered: usize,
    labelled: usize,
    segments: usize,
    length_px: f64,
}

impl Row {
    fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            covered_px: 0.0,
            covered_with_slack_px: 0.0,
            labelled_px: 0.0,
            half_covered: 0,
            labelled: 0,
            segments: 0,
            length_px: 0.0,
        }
    }

    fn count(&mut self, labelled: &[Ends], segments: &[Ends]) {
        for line in labelled {
            let line_px = length_px(line);
            let share = covered_share(line, segments, 0.0);
            self.covered_px += share * line_px;
            self.covered_with_slack_px += covered_share(line, segments, SLACK_PX) * line_px;
            self.labelled_px += line_px;
            self.half_covered += usize::from(share > 0.5);
        }
        self.labelled += labelled.len();
        self.segments += segments.len();
        self.length_px += segments.iter().map(length_px).sum::<f64>();
    }

    fn print(&self, images: usize) {
        println!(
            "| {} | {:.4} | {:.4} | {:.4} | {:.1} | {:.1} px |",
            self.name,
            self.covered_px / self.labelled_px,
            self.covered_with_slack_px / self.labelled_px,
            self.half_covered as f64 / self.labelled as f64,
            self.segments as f64 / images as f64,
            self.length_px / self.segments as f64,
        );
    }
}

fn length_px([[x1, y1], [x2, y2]]: &Ends) -> f64 {
    (x2 - x1).hypot(y2 - y1)
}

/// Which share of a line's samples some segment covers.
fn covered_share(line: &Ends, segments: &[Ends], slack_px: f64) -> f64 {
    let line_px = length_px(line);
    let samples = (line_px.ceil() as usize).max(1);
    let [along_x, along_y] = [0, 1].map(|axis| (line[1][axis] - line[0][axis]) / line_px);
    let mut is_covered = vec![false; samples];
    for segment in segments {
        let segment_px = length_px(segment);
        let [dx, dy] = [0, 1].map(|axis| (segment[1][axis] - segment[0][axis]) / segment_px);
        let cosine = (dx * along_x + dy * along_y).abs();
        // A segment without length has no direction, and its cosine is not a number.
        if cosine.is_nan() || cosine < SAME_DIRECTION_RAD.cos() {
            continue;
        }
        for (sample, is_covered) in is_covered.iter_mut().enumerate() {
            let at_px = (sample as f64 + 0.5) * line_px / samples as f64;
            let x = line[0][0] + at_px * along_x - segment[0][0];
            let y = line[0][1] + at_px * along_y - segment[0][1];
            let (foot_px, off_px) = (x * dx + y * dy, (x * dy - y * dx).abs());
            let is_beside = (-slack_px..=segment_px + slack_px).contains(&foot_px);
            *is_covered |= is_beside && off_px <= NEAR_PX;
        }
    }
    is_covered.iter().filter(|&&covered| covered).count() as f64 / samples as f64
}

/// The times of all images, step by step.
#[derive(Default)]
struct Timing {
    steps: Vec<(LineStep, Vec<Duration>)>,
    whole: Vec<Duration>,
    describe: Vec<Duration>,
}

impl Timing {
    /// Detects, several times over.
    fn detect(&mut self, detector: &mut LineDetector, image: &GrayImage) -> Vec<Ends> {
        let mut segments = Vec::new();
        let mut whole = Duration::MAX;
        let mut describe = Duration::MAX;
        let mut steps: Vec<(LineStep, Duration)> = Vec::new();
        for _ in 0..ROUNDS {
            let start = processor_time();
            let (mut since, mut step) = (start, 0);
            segments = detector.detect_in_steps(image, |done| {
                let took = processor_time() - since;
                match steps.get_mut(step) {
                    Some((_, least)) => *least = took.min(*least),
                    None => steps.push((done, took)),
                }
                (since, step) = (processor_time(), step + 1);
            });
            whole = whole.min(processor_time() - start);
            let start = processor_time();
            std::hint::black_box(detector.describe(&segments));
            describe = describe.min(processor_time() - start);
        }
        for (place, (step, took)) in steps.into_iter().enumerate() {
            match self.steps.get_mut(place) {
                Some((_, all)) => all.push(took),
                None => self.steps.push((step, vec![took])),
            }
        }
        self.whole.push(whole);
        self.describe.push(describe);
        let ends = |px: [f32; 2]| px.map(f64::from);
        segments.iter().map(|one| [ends(one.start_px), ends(one.end_px)]).collect()
    }

    fn print(&mut self) {
        println!("\n| step | median time |\n|---|---|");
        for (step, times) in &mut self.steps {
            println!("| {step:?} | {:.2} ms |", median_ms(times));
        }
        println!("| all of them | {:.2} ms |", median_ms(&mut self.whole));
        println!("| descriptors | {:.2} ms |", median_ms(&mut self.describe));
    }
}

/// How long this thread has been running.
fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

fn median_ms(times: &mut [Duration]) -> f64 {
    times.sort_unstable();
    times.get(times.len() / 2).map_or(f64::NAN, |time| 1e3 * time.as_secs_f64())
}
