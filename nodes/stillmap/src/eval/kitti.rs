//! `stillmap eval kitti`: LiDAR odometry against true poses, by the rules of KITTI and by those of the road thesis, with the
//! thesis' own variants beside ours.

mod published;
mod variant;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::Args;
use evaluation::trajectory::{
    Alignment, Plane, RawPose, Trajectory, TrajectoryScoreConfig, parse_trajectory, road_score,
    score_trajectory,
};
use geometry::{LidarCloud, Stamp};
use msgs::convert::lidar_cloud_from_message;
use nalgebra::Isometry3;
use serde::Serialize;

use crate::console;
use crate::failure::{Failure, Outcome};
use crate::lidar::{LidarArgs, LidarSource, Sensed};
use crate::progress::Progress;
use variant::{Follow, Variant};

/// Where the data set is had.
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
pub(crate) struct KittiArgs {
    /// A sequence of KITTI, or a bag with a LiDAR and its truth
    #[arg(value_name = "DIR")]
    recording: PathBuf,
    /// Trajectories to be scored beside ours: KITTI's twelve numbers a line, of the scanner; or TUM's form
    #[arg(long, value_name = "FILE")]
    estimate: Vec<PathBuf>,
    /// Which are run; `none` for the given trajectories alone
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "ours,ours-loops,gicp-standing,gicp,gicp-intensity,gicp-rays,gicp-ground"
    )]
    variants: Vec<Variant>,
    /// Only so many of the first scans
    #[arg(long, value_name = "N")]
    first: Option<usize>,
    /// Threads that work on a scan; their number changes no pose
    #[arg(long, value_name = "N", default_value_t = NonZeroUsize::new(2).unwrap_or(NonZeroUsize::MIN))]
    threads: NonZeroUsize,
    #[command(flatten)]
    lidar: LidarArgs,
    /// Where the trajectories go, one a variant, in KITTI's form
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

/// The figures of one trajectory.
#[derive(Clone, Serialize, Debug)]
struct Figures {
    name: String,
    poses: usize,
    /// Scans without a measured pose.
    troubles: usize,
    milliseconds_median: Option<f64>,
    milliseconds_mean: Option<f64>,
    translation_percent: Option<f64>,
    rotation_deg_per_100m: Option<f64>,
    ate_rmse_m: f64,
    rms_2d_m: Option<f64>,
    rms_3d_m: Option<f64>,
    end_error_percent: Option<f64>,
    precision_percent: Option<f64>,
}

/// What is scored.
struct Candidate {
    name: String,
    poses: Vec<(Stamp, Isometry3<f64>)>,
    troubles: usize,
    times_ms: Vec<f64>,
}

pub(crate) fn run(args: &KittiArgs) -> Result<Outcome, Failure> {
    if !args.recording.exists() {
        return Err(
            Failure::new(format!("{} is not there", args.recording.display())).mend(HOW_TO_GET)
        );
    }
    let source = LidarSource::open(&args.recording, &args.lidar)
        .map_err(|failure| failure.mend(HOW_TO_GET))?;
    let mut follows: Vec<Follow> = args
        .variants
        .iter()
        .filter_map(|variant| Follow::new(*variant, args.threads).transpose())
        .collect::<Result<_, _>>()?;
    let mut truth: Vec<(Stamp, Isometry3<f64>)> = Vec::new();
    let mut scans: Vec<Stamp> = Vec::new();
    let progress = Progress::new("following", source.steps());
    let losses = source.each(|sensed| {
        match sensed {
            Sensed::Truth(stamp, pose) => truth.push((stamp, pose)),
            Sensed::Cloud(message) if args.first.is_none_or(|first| scans.len() < first) => {
                let cloud: LidarCloud = lidar_cloud_from_message(&message, None)
                    .map_err(|error| Failure::new(error.to_string()))?
                    .cloud;
                scans.push(cloud.stamp);
                follows.iter_mut().for_each(|follow| follow.step(&cloud));
                progress.advance();
            }
            _ => {}
        }
        Ok(())
    })?;
    progress.finish();
    if truth.is_empty() {
        return Err(Failure::new("the recording has no true poses".to_owned()).mend(format!(
            "KITTI's are ../../poses/NN.txt beside the sequence, with its calib.txt; {HOW_TO_GET}"
        )));
    }
    let mut candidates: Vec<Candidate> = follows.into_iter().map(Follow::finish).collect();
    for path in &args.estimate {
        candidates.push(given(path, &scans)?);
    }
    let mut figures = Vec::new();
    for candidate in &candidates {
        figures.push(scored(candidate, &truth)?);
        if let Some(folder) = &args.out {
            write_poses(folder, candidate)?;
        }
    }
    tell(&figures, &truth, scans.len(), args.json)?;
    for loss in &losses {
        console::complain(&Failure::new(loss.as_str()));
    }
    Ok(if losses.is_empty() { Outcome::Complete } else { Outcome::WithLosses })
}

/// A trajectory of somebody else; one without stamps has a pose for each scan.
fn given(path: &Path, scans: &[Stamp]) -> Result<Candidate, Failure> {
    let within = |error: String| Failure::new(error).within(path.display());
    let bytes = std::fs::read(path)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))?;
    let trajectory =
        parse_trajectory(&bytes).map_err(|error| within(error.to_string()))?.trajectory;
    let poses = match trajectory.times() {
        evaluation::trajectory::Times::Stamps(stamps) => {
            stamps.iter().copied().zip(trajectory.poses().iter().copied()).collect()
        }
        _ if trajectory.len() == scans.len() => {
            scans.iter().copied().zip(trajectory.poses().iter().copied()).collect()
        }
        _ => {
            return Err(within(format!("{} poses, but {} scans", trajectory.len(), scans.len()))
                .mend("a file without stamps needs a pose for each scan"));
        }
    };
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    Ok(Candidate { name, poses, troubles: 0, times_ms: Vec::new() })
}

/// The truth at a moment: between the poses about it.
fn at(truth: &[(Stamp, Isometry3<f64>)], stamp: Stamp) -> Option<Isometry3<f64>> {
    let after = truth.partition_point(|(of, _)| *of < stamp);
    let (to_stamp, to) = truth.get(after)?;
    if *to_stamp == stamp {
        return Some(*to);
    }
    let (from_stamp, from) = truth.get(after.checked_sub(1)?)?;
    let share = stamp.seconds_since(*from_stamp) / to_stamp.seconds_since(*from_stamp);
    from.try_lerp_slerp(to, share, f64::EPSILON)
}

fn scored(candidate: &Candidate, truth: &[(Stamp, Isometry3<f64>)]) -> Result<Figures, Failure> {
    let pairs: Vec<(Stamp, Isometry3<f64>, Isometry3<f64>)> = candidate
        .poses
        .iter()
        .filter_map(|(stamp, pose)| Some((*stamp, *pose, at(truth, *stamp)?)))
        .collect();
    let failed = |error: String| Failure::new(error).within(&candidate.name);
    let stamped = |poses: &mut dyn Iterator<Item = (Stamp, Isometry3<f64>)>| {
        let raw = |(stamp, pose): (Stamp, Isometry3<f64>)| {
            let position_m = pose.translation.vector.into();
            (stamp, RawPose { position_m, quaternion_xyzw: pose.rotation.coords.into() })
        };
        Trajectory::stamped(poses.map(raw).collect::<Vec<_>>())
    };
    let estimate = stamped(&mut pairs.iter().map(|(stamp, pose, _)| (*stamp, *pose)));
    let reference = stamped(&mut pairs.iter().map(|(stamp, _, truth)| (*stamp, *truth)));
    let mut config = TrajectoryScoreConfig { alignment: Alignment::Origin, ..Default::default() };
    // A way too short for KITTI's rules.
    const SHORTEST_SEGMENT_M: f64 = 100.0;
    if reference.path_m() <= SHORTEST_SEGMENT_M {
        config.segments.lengths = evaluation::trajectory::SegmentLengths::Scaled;
    }
    let by_kitti = score_trajectory(&estimate, &reference, &config)
        .map_err(|error| failed(error.to_string()))?;
    let aligned = TrajectoryScoreConfig { alignment: Alignment::Se3, ..config };
    let ate = score_trajectory(&estimate, &reference, &aligned)
        .map_err(|error| failed(error.to_string()))?;
    // The scanner's frame has z up.
    let road = road_score(&by_kitti.pairs, Plane::Xy);
    let segments = &by_kitti.score.segments;
    let mut times_ms = candidate.times_ms.clone();
    times_ms.sort_by(f64::total_cmp);
    let mean = times_ms.iter().sum::<f64>() / times_ms.len().max(1) as f64;
    Ok(Figures {
        name: candidate.name.clone(),
        poses: pairs.len(),
        troubles: candidate.troubles,
        milliseconds_median: times_ms.get(times_ms.len() / 2).copied(),
        milliseconds_mean: (!times_ms.is_empty()).then_some(mean),
        translation_percent: segments.translation_percent,
        rotation_deg_per_100m: segments.rotation_deg_per_m.map(|per_m| 100.0 * per_m),
        ate_rmse_m: ate.score.absolute.translation_m.rmse,
        rms_2d_m: road.map(|road| road.rms_2d_m),
        rms_3d_m: road.map(|road| road.rms_3d_m),
        end_error_percent: road.map(|road| road.end_error_percent),
        precision_percent: road.map(|road| road.precision_percent),
    })
}

fn write_poses(folder: &Path, candidate: &Candidate) -> Result<(), Failure> {
    let line = |(_, pose): &(Stamp, Isometry3<f64>)| {
        let matrix = pose.to_homogeneous();
        let numbers = (0..12).map(|at| matrix[(at / 4, at % 4)].to_string());
        numbers.collect::<Vec<_>>().join(" ") + "\n"
    };
    let text: String = candidate.poses.iter().map(line).collect();
    let path = folder.join(format!("{}.txt", candidate.name));
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(&path, text))
        .map_err(|error| Failure::new(format!("cannot write {}: {error}", path.display())))
}

fn tell(
    figures: &[Figures],
    truth: &[(Stamp, Isometry3<f64>)],
    scans: usize,
    json: bool,
) -> Result<(), Failure> {
    if json {
        let json = serde_json::to_string_pretty(figures)
            .map_err(|error| Failure::new(format!("cannot print the figures: {error}")))?;
        return console::print(json);
    }
    let way_m: f64 = truth
        .iter()
        .zip(truth.iter().skip(1))
        .map(|((_, from), (_, to))| (to.translation.vector - from.translation.vector).norm())
        .sum();
    console::print(format_args!("{scans} scans, {} true poses over {way_m:.1} m", truth.len()))?;
    let head = [
        "",
        "poses",
        "no fit",
        "ms",
        "drift %",
        "deg/100m",
        "ATE m",
        "RMS 2D m",
        "RMS 3D m",
        "end %",
        "precision %",
    ];
    let mut rows = vec![head.map(str::to_owned)];
    for one in figures {
        rows.push([
            one.name.clone(),
            one.poses.to_string(),
            one.troubles.to_string(),
            number(one.milliseconds_median, 1),
            number(one.translation_percent, 3),
            number(one.rotation_deg_per_100m, 3),
            number(Some(one.ate_rmse_m), 3),
            number(one.rms_2d_m, 3),
            number(one.rms_3d_m, 3),
            number(one.end_error_percent, 2),
            number(one.precision_percent, 2),
        ]);
    }
    for row in &rows {
        let [name, cells @ ..] = row;
        let cells: String = cells.iter().map(|cell| format!("{cell:>12}")).collect();
        console::print(format_args!("{name:<16}{cells}"))?;
    }
    console::print("")?;
    for line in published::beside(figures) {
        console::print(line)?;
    }
    Ok(())
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

#[cfg(test)]
mod tests;
