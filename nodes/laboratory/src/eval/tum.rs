//! `stillmap eval tum`: repeated runs on sequences of the TUM RGB-D benchmark, compared with the PL-SLAM thesis' Tables 4 to
//! 16.

mod follow;
mod published;
mod sequence;
mod tables;

use std::num::NonZeroU64;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::{Serialize, Serializer};

use follow::{Mode, Run};
use published::{PUBLISHED, Published, PublishedSequence};
use robot::Progress;
use robot::console;
use robot::import::tum::parse_intrinsics;
use robot::{Failure, Outcome};
use sequence::{Pairing, Sequence};

/// The source of the data set.
const HOW_TO_GET: &str = "the sequences are at https://cvg.cit.tum.de/data/datasets/rgbd-dataset/download, an archive each; tar -xzf unpacks it";

/// Arguments of `stillmap eval tum`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap eval tum tum/rgbd_dataset_*
  stillmap eval tum tum --runs 3 --modes inline
  stillmap eval tum rgbd_dataset_freiburg1_rpy --first 100 --json
  stillmap simulate walking-xyz -o walking-xyz.mcap
  stillmap eval tum walking-xyz.mcap --runs 3

A sequence is a folder with rgb.txt, depth.txt and groundtruth.txt, or a bag with colour images, registered depth images, their
calibration and the true pose of the camera. A colour image belongs to the depth image nearest in time
(--max-pair-gap), a pose to the true one nearest in time (--max-difference); both are 0.02 s as in the benchmark's tools. Errors are
those of all images that have a pose (ATE after the best rigid alignment); the thesis' are those of keyframes. Tracking time is from
the raw images to the pose. Odometry and inline, the run's number is the seed of what is drawn at random; in the background, images
come as fast as they were taken, and what the map has done by then differs from run to run. accelerometer.txt is not used.")]
pub struct TumArgs {
    /// Sequences or bags, or folders of sequences
    #[arg(value_name = "SEQUENCE", required = true)]
    folders: Vec<PathBuf>,
    /// The number of runs on each sequence, in each mode
    #[arg(long, value_name = "N", default_value = "10")]
    runs: NonZeroU64,
    /// The modes
    #[arg(long, value_enum, value_delimiter = ',', default_value = "odometry,inline,background")]
    modes: Vec<Mode>,
    /// Use only this many pairs of images from the start
    #[arg(long, value_name = "N")]
    first: Option<usize>,
    /// The largest time difference of the images of a pair
    #[arg(long, value_name = "SECONDS", default_value_t = 0.02)]
    max_pair_gap: f64,
    /// The largest time difference of a pose and the matched ground-truth pose
    #[arg(long, value_name = "SECONDS", default_value_t = 0.02)]
    max_difference: f64,
    /// Focal lengths and principal point in pixels, where a folder's name does not contain the camera's
    #[arg(long, value_name = "FX,FY,CX,CY", value_parser = parse_intrinsics)]
    intrinsics: Option<[f64; 4]>,
    /// The topic of the ground-truth pose in a bag [default: /truth/pose, or the only one with poses]
    #[arg(long, value_name = "TOPIC")]
    truth: Option<String>,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

/// The results on a sequence.
#[derive(Serialize, Debug)]
struct Followed {
    name: String,
    pairs: usize,
    /// Colour images without a depth image.
    alone: usize,
    scores: Vec<Score>,
    #[serde(skip)]
    published: Option<&'static PublishedSequence>,
    #[serde(skip)]
    is_bag: bool,
}

/// The runs in one mode.
#[derive(Serialize, Debug)]
struct Score {
    mode: Mode,
    runs: Vec<Run>,
    /// The figures of all runs, in the order of [`NUMBERS`].
    #[serde(serialize_with = "by_name")]
    mean: [f64; 8],
}

/// The columns of the tables: errors in metres, times in seconds.
const NUMBERS: [&str; 8] = [
    "rmse_m",
    "mean_m",
    "median_m",
    "std_m",
    "min_m",
    "max_m",
    "median_tracking_s",
    "mean_tracking_s",
];

fn by_name<S: Serializer>(numbers: &[f64; 8], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(NUMBERS.iter().zip(numbers))
}

/// The result as JSON.
#[derive(Serialize)]
struct Printed<'a> {
    max_pair_gap_s: f64,
    max_difference_s: f64,
    sequences: &'a [Followed],
    /// The missing sequences of the thesis' ten, with their addresses.
    absent: Vec<(&'a str, String)>,
    /// Folders that could not be read, and why.
    failures: &'a [String],
}

pub(crate) fn run(args: &TumArgs) -> Result<Outcome, Failure> {
    let tables = PUBLISHED.get()?;
    let (folders, mut failures) = found(&args.folders, tables);
    let mut all = Vec::new();
    for folder in &folders {
        match followed(folder, args, tables) {
            Ok(one) => {
                if !args.json {
                    tables::of_sequence(&one).iter().try_for_each(console::print)?;
                    console::print("")?;
                }
                all.push(one);
            }
            Err(failure) => failures.push(failure),
        }
    }
    let is_absent =
        |published: &&PublishedSequence| !all.iter().any(|one| one.name == published.name);
    // With bags alone the data set is not needed.
    let has_bags_alone = !all.is_empty() && all.iter().all(|one| one.is_bag);
    let absent = tables.sequences.iter().filter(|one| !has_bags_alone && is_absent(one));
    let told: Vec<String> = failures.iter().map(ToString::to_string).collect();
    if args.json {
        let absent =
            absent.map(|published| (published.name.as_str(), published.address())).collect();
        let printed = Printed {
            max_pair_gap_s: args.max_pair_gap,
            max_difference_s: args.max_difference,
            sequences: &all,
            absent,
            failures: &told,
        };
        let json = serde_json::to_string_pretty(&printed)
            .map_err(|error| Failure::new(format!("cannot print the figures: {error}")))?;
        console::print(json)?;
    } else {
        if all.iter().any(|one| one.published.is_some()) {
            tables::of_all(&all, tables).iter().try_for_each(console::print)?;
        }
        if all.iter().any(|one| published::is_counterpart(&one.name)) {
            tables::of_counterparts(&all).iter().try_for_each(console::print)?;
        }
        for published in absent {
            console::note(format_args!(
                "{} of the thesis' ten is missing: {}",
                published.name,
                published.address()
            ));
        }
    }
    if all.is_empty() {
        let first = failures.into_iter().next();
        return Err(first.unwrap_or_else(|| Failure::new("no sequence").fix(HOW_TO_GET)));
    }
    failures.iter().for_each(console::print_failure);
    Ok(if failures.is_empty() { Outcome::Complete } else { Outcome::WithLosses })
}

/// The sequences among these folders and in them, and the folders without one.
fn found(folders: &[PathBuf], tables: &Published) -> (Vec<PathBuf>, Vec<Failure>) {
    let (mut found, mut failures) = (Vec::new(), Vec::new());
    for folder in folders {
        let inner = inner_sequences(folder);
        if Sequence::is_at(folder) {
            found.push(folder.clone());
        } else if inner.is_empty() {
            let missing = if folder.exists() { "is not a sequence" } else { "does not exist" };
            let failure = Failure::new(format!("{} {missing}", folder.display()));
            failures.push(failure.fix(how_to_get(folder, tables)));
        } else {
            found.extend(inner);
        }
    }
    (found, failures)
}

fn how_to_get(folder: &Path, tables: &Published) -> String {
    match tables.of(&Sequence::name_of(folder)) {
        Some(published) => format!("it is at {}; tar -xzf unpacks it", published.address()),
        None => format!("it needs rgb.txt, depth.txt and groundtruth.txt; {HOW_TO_GET}"),
    }
}

fn inner_sequences(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut inner: Vec<PathBuf> =
        entries.map(|entry| entry.path()).filter(|path| Sequence::is_at(path)).collect();
    inner.sort();
    inner
}

fn followed(
    folder: &Path,
    args: &TumArgs,
    tables: &'static Published,
) -> Result<Followed, Failure> {
    let pairing = Pairing { max_gap_s: args.max_pair_gap, first: args.first };
    let sequence = Sequence::open(folder, args.intrinsics, args.truth.as_deref(), pairing)?;
    let steps = sequence.pairs() as u64 * args.runs.get() * args.modes.len() as u64;
    let progress = Progress::new(&sequence.name, steps);
    let mut scores = Vec::new();
    for mode in &args.modes {
        let run =
            |run| follow::follow(&sequence, *mode, run, args.max_difference, || progress.advance());
        let runs: Vec<Run> = (1..=args.runs.get()).map(run).collect::<Result<_, _>>()?;
        let mut mean = [0.0; 8];
        for run in &runs {
            for (mean, number) in mean.iter_mut().zip(tables::numbers(run)) {
                *mean += number / runs.len() as f64;
            }
        }
        scores.push(Score { mode: *mode, runs, mean });
    }
    progress.finish();
    Ok(Followed {
        published: tables.of(&sequence.name),
        is_bag: sequence.is_bag(),
        pairs: sequence.pairs(),
        alone: sequence.alone(),
        name: sequence.name,
        scores,
    })
}

#[cfg(test)]
mod tests;
