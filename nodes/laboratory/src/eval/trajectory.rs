//! `stillmap eval trajectory`: an estimated trajectory against a reference.

mod bag_poses;
mod choice;
mod source;
mod tell;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use clap::Args;
use evaluation::trajectory::{
    Plane, ScoredTrajectory, Trajectory, TrajectoryPageFacts, TrajectoryScore,
    TrajectoryScoreError, score_trajectory, trajectory_page,
};
use report::page_html;
use serde::Serialize;

use self::choice::ScoreArgs;
use self::source::{Read, Source};
use robot::console;
use robot::{Failure, Outcome, refuse_to_replace};

/// The ground-truth poses on a topic of a bag, or on the only one with poses; `option` is the argument for the topic.
pub(super) fn true_poses_of_bag(
    path: &Path,
    topic: Option<&str>,
    option: &str,
) -> Result<Trajectory, Failure> {
    Ok(bag_poses::read(path, topic, option)?.trajectory)
}

/// Arguments of `stillmap eval trajectory`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap eval trajectory CameraTrajectory.txt --ref groundtruth.txt --out score
  stillmap eval trajectory 07_estimate.txt --ref poses/07.txt --rpe 100frames --rpe-pairs all
  stillmap eval trajectory run.mcap --est-topic /odom --ref groundtruth.csv --align yaw
  stillmap eval trajectory run.mcap --est-topic /tf:odom:base_link --ref run.mcap --ref-topic /truth/pose

Files are TUM (seconds x y z qx qy qz qw), KITTI (twelve numbers a line), EuRoC (CSV), or bags; what they are is told
by their content. Poses that are lost (nan) and stamps that come twice are left out and counted. Errors say nothing
of the parts of the reference that the estimate does not cover: look at the coverage first.")]
pub struct TrajectoryArgs {
    /// The estimate: a TUM, KITTI or EuRoC file, or a bag
    estimate: PathBuf,
    /// The reference, in any of these formats
    #[arg(long = "ref", value_name = "FILE")]
    reference: PathBuf,
    /// The topic of the estimate in a bag: PoseStamped, PoseWithCovarianceStamped, Odometry, or
    /// /tf:PARENT:CHILD
    #[arg(long, value_name = "TOPIC")]
    est_topic: Option<String>,
    /// The topic of the reference in a bag
    #[arg(long, value_name = "TOPIC")]
    ref_topic: Option<String>,
    /// The stamps of the frames of KITTI files, one per line, in seconds
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
    #[command(flatten)]
    score: ScoreArgs,
    /// Write score.html and score.json into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace existing ones
    #[arg(long, requires = "out")]
    overwrite: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// The result as JSON.
#[derive(Serialize)]
struct Printed<'a> {
    estimate_file: String,
    reference_file: String,
    estimate_format: &'a str,
    reference_format: &'a str,
    #[serde(flatten)]
    score: &'a TrajectoryScore,
}

pub(crate) fn run(args: &TrajectoryArgs) -> Result<Outcome, Failure> {
    let config = args.score.config();
    config.validate().map_err(|error| Failure::new(error.to_string()))?;
    let results = |folder: &PathBuf| ["score.html", "score.json"].map(|name| folder.join(name));
    refuse_to_replace(args.out.iter().flat_map(results), args.overwrite, "--out")?;
    let times = args.times.as_deref();
    let estimate = Source { path: &args.estimate, topic: args.est_topic.as_deref(), times }
        .read("--est-topic")?;
    let reference = Source { path: &args.reference, topic: args.ref_topic.as_deref(), times }
        .read("--ref-topic")?;
    if times.is_some() && !estimate.takes_times && !reference.takes_times {
        return Err(Failure::unusable("--times has no effect: both trajectories have stamps")
            .fix("leave it out, or give files of KITTI, which have none"));
    }
    let scored = score_trajectory(&estimate.trajectory, &reference.trajectory, &config)
        .map_err(|error| refused(&error))?;
    let printed = Printed {
        estimate_file: args.estimate.display().to_string(),
        reference_file: args.reference.display().to_string(),
        estimate_format: estimate.format,
        reference_format: reference.format,
        score: &scored.score,
    };
    let mut json = serde_json::to_string_pretty(&printed)
        .map_err(|error| Failure::new(format!("cannot print the score: {error}")))?;
    if let Some(folder) = &args.out {
        write_page(args, &scored, folder)?;
        json.push('\n');
        write(folder, "score.json", &json)?;
    }
    if args.json {
        console::print(json.trim_end())?;
    } else {
        tell::print(&scored.score, [&estimate, &reference].map(|read: &Read| read.format))?;
        if let Some(folder) = &args.out {
            console::print(format_args!("page: {}", folder.join("score.html").display()))?;
        }
    }
    let is_whole = estimate.losses + reference.losses == 0;
    Ok(if is_whole { Outcome::Complete } else { Outcome::WithLosses })
}

fn refused(error: &TrajectoryScoreError) -> Failure {
    let failure = Failure::new(error.to_string());
    match error {
        TrajectoryScoreError::TooFewPairs { .. } => failure.fix(
            "give --max-difference where stamps are farther apart, --offset where one clock is ahead of the other",
        ),
        TrajectoryScoreError::TimesDiffer { .. } => {
            failure.fix("give the stamps of a KITTI file's frames with --times")
        }
        TrajectoryScoreError::Alignment(_) => failure.fix("give --align se3, or none"),
        _ => failure,
    }
}

fn write_page(
    args: &TrajectoryArgs,
    scored: &ScoredTrajectory,
    folder: &Path,
) -> Result<(), Failure> {
    let places_m: Vec<_> = scored.reference.iter().map(|pose| pose.translation.vector).collect();
    let plane = args.score.plane().unwrap_or_else(|| Plane::of_largest_extent(&places_m));
    let name =
        |path: &Path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let facts = TrajectoryPageFacts {
        estimate_name: name(&args.estimate),
        reference_name: name(&args.reference),
        plane,
    };
    std::fs::create_dir_all(folder).map_err(|error| cannot_write(folder, &error))?;
    write(folder, "score.html", &page_html(&trajectory_page(scored, &facts)))
}

fn write(folder: &Path, name: &str, text: &str) -> Result<(), Failure> {
    let path = folder.join(name);
    std::fs::write(&path, text).map_err(|error| cannot_write(&path, &error))
}

fn cannot_write(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(format!("cannot write {}: {error}", path.display()))
        .fix("give a folder that can be written with --out")
}
