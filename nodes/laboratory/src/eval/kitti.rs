//! `stillmap eval kitti`: LiDAR odometry against ground-truth poses, by the rules of KITTI and by those of the road thesis, with
//! the thesis' variants for comparison.

mod published;
mod score;
mod stages;
mod table;
mod variant;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use clap::Args;
use estimation::{Executor, ScopedThreads};
use geometry::{LidarCloud, Stamp};
use msgs::convert::lidar_cloud_from_message;
use nalgebra::Isometry3;
use score::{Candidate, Figures};
use serde::Serialize;
use stages::{StageMs, StageTimes};

use robot::Progress;
use robot::console;
use robot::lidar::{LidarArgs, LidarSource, Sensed};
use robot::{Failure, Interrupt, Outcome, refuse_to_replace};
use variant::{Follow, Variant};

/// The source of the data set.
const HOW_TO_GET: &str = "sequence 07 of KITTI's odometry benchmark is at https://www.cvlibs.net/datasets/kitti/eval_odometry.php \
(free, after registering): data_odometry_velodyne.zip (80 GB), data_odometry_calib.zip and data_odometry_poses.zip, unpacked into one \
folder; then `stillmap eval kitti dataset/sequences/07`";

/// Arguments of `stillmap eval kitti`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap eval kitti dataset/sequences/07
  stillmap eval kitti dataset/sequences/07 --variants ours,gicp-intensity --first 300
  stillmap eval kitti dataset/sequences/07 --estimate other.txt
  stillmap simulate road -o road.mcap && stillmap eval kitti road.mcap

DIR holds velodyne/ with numbered .bin files, calib.txt and, in ../../poses, the true poses. A bag with a LiDAR and true poses on
/truth/pose does, too. Drift is by KITTI's rules over 100 .. 800 m; of a shorter way over its tenths.")]
pub struct KittiArgs {
    /// A sequence of KITTI, or a bag with a LiDAR and its ground truth
    #[arg(value_name = "DIR")]
    recording: PathBuf,
    /// Further trajectories to score: of the scanner, in KITTI's format (twelve numbers per line) or in TUM's
    #[arg(long, value_name = "FILE")]
    estimate: Vec<PathBuf>,
    /// The variants to run; `none` for the given trajectories alone
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "ours,ours-loops,icp,gicp-standing,gicp,gicp-intensity-1,gicp-intensity,gicp-intensity-1.5,gicp-rays-22,\
gicp-rays-18,gicp-rays-14,gicp-rays-10,gicp-rays-6,gicp-ground"
    )]
    variants: Vec<Variant>,
    /// Use only this many scans from the start
    #[arg(long, value_name = "N")]
    first: Option<usize>,
    /// Threads per scan; their number changes no pose
    #[arg(long, value_name = "N", default_value_t = NonZeroUsize::new(2).unwrap_or(NonZeroUsize::MIN))]
    threads: NonZeroUsize,
    #[command(flatten)]
    lidar: LidarArgs,
    /// The folder for the trajectories, one per variant, in KITTI's format
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace existing trajectories in that folder
    #[arg(long, requires = "out")]
    overwrite: bool,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

/// The result.
#[derive(Serialize, Debug)]
struct Evaluation {
    figures: Vec<Figures>,
    /// The stages of the thesis' table 4.2, without the transform.
    stages: StageMs,
    scans: usize,
    true_poses: usize,
    way_m: f64,
    losses: Vec<String>,
}

pub(crate) fn run(args: &KittiArgs) -> Result<Outcome, Failure> {
    let names = args.variants.iter().map(|variant| variant.name());
    let paths = args.out.iter().flat_map(|folder| names.clone().map(|name| file_of(folder, &name)));
    refuse_to_replace(paths, args.overwrite, "--out")?;
    let evaluation = evaluated(args)?;
    if args.json {
        let json = serde_json::to_string_pretty(&evaluation)
            .map_err(|error| Failure::new(format!("cannot print the figures: {error}")))?;
        console::print(json)?;
    } else {
        table::lines(&evaluation)?.iter().try_for_each(console::print)?;
    }
    for loss in &evaluation.losses {
        console::print_failure(&Failure::new(loss.as_str()));
    }
    let is_whole = evaluation.losses.is_empty();
    Ok(if is_whole { Outcome::Complete } else { Outcome::WithLosses })
}

fn evaluated(args: &KittiArgs) -> Result<Evaluation, Failure> {
    if !args.recording.exists() {
        return Err(
            Failure::new(format!("{} does not exist", args.recording.display())).fix(HOW_TO_GET)
        );
    }
    let source = LidarSource::open(&args.recording, &args.lidar)
        .map_err(|failure| failure.fix(HOW_TO_GET))?;
    // Before the variants take minutes.
    if !source.has_truth() {
        return Err(Failure::new("the recording has no ground-truth poses").fix(format!(
            "KITTI's are ../../poses/NN.txt beside the sequence, with its calib.txt; {HOW_TO_GET}"
        )));
    }
    let executor: Arc<dyn Executor> = Arc::new(ScopedThreads::new(args.threads));
    let mut follows: Vec<Follow> = args
        .variants
        .iter()
        .filter_map(|variant| Follow::new(*variant, &executor).transpose())
        .collect::<Result<_, _>>()?;
    let mut truth: Vec<(Stamp, Isometry3<f64>)> = Vec::new();
    let mut scans: Vec<Stamp> = Vec::new();
    let mut stages = StageTimes::below(&std::env::temp_dir())?;
    let mut way: Vec<Isometry3<f64>> = Vec::new();
    let progress = Progress::new("following", source.steps());
    let losses = source.each(&Interrupt::default(), |sensed| {
        match sensed {
            Sensed::Truth(stamp, pose) => truth.push((stamp, pose)),
            Sensed::Cloud(message) if args.first.is_none_or(|first| scans.len() < first) => {
                stages.has_read();
                let start = Instant::now();
                let cloud: LidarCloud = lidar_cloud_from_message(&message, None)
                    .map_err(|error| Failure::new(error.to_string()))?
                    .cloud;
                stages.has_made_cloud(start);
                scans.push(cloud.stamp);
                follows.iter_mut().for_each(|follow| follow.step(&cloud));
                way.extend(follows.first().and_then(Follow::last));
                stages.take(&cloud, &way)?;
                progress.advance();
                stages.done();
            }
            _ => {}
        }
        Ok(())
    })?;
    progress.finish();
    let mut figures = Vec::new();
    for candidate in follows.into_iter().map(Follow::finish) {
        figures.push(score::scored(&candidate, &truth)?);
        if let Some(folder) = &args.out {
            write_poses(folder, &candidate)?;
        }
    }
    // The given trajectories are files already.
    for path in &args.estimate {
        figures.push(score::scored(&score::given(path, &scans)?, &truth)?);
    }
    Ok(Evaluation {
        figures,
        stages: stages.ms(),
        scans: scans.len(),
        true_poses: truth.len(),
        way_m: way_m(&truth),
        losses,
    })
}

fn way_m(truth: &[(Stamp, Isometry3<f64>)]) -> f64 {
    let steps = truth.iter().zip(truth.iter().skip(1));
    steps.map(|(from, to)| (to.1.translation.vector - from.1.translation.vector).norm()).sum()
}

/// The file of a variant's trajectory.
fn file_of(folder: &Path, variant: &str) -> PathBuf {
    folder.join(format!("{variant}.txt"))
}

fn write_poses(folder: &Path, candidate: &Candidate) -> Result<(), Failure> {
    let line = |(_, pose): &(Stamp, Isometry3<f64>)| {
        let matrix = pose.to_homogeneous();
        let numbers = (0..12).map(|at| matrix[(at / 4, at % 4)].to_string());
        numbers.collect::<Vec<_>>().join(" ") + "\n"
    };
    let text: String = candidate.poses.iter().map(line).collect();
    let path = file_of(folder, &candidate.name);
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(&path, text))
        .map_err(|error| Failure::new(format!("cannot write {}: {error}", path.display())))
}

#[cfg(test)]
mod tests;
