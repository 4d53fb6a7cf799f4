//! `stillmap odometry --of lidar`: the trajectory of a recording's LiDAR.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use lidar_odometry::shell::LidarOdometryParameters;
use node_shell::parameters::{self, Assignment};
use report::DurationStatistics;
use serde::Serialize;

use super::findings::{findings, without_times};
use super::{LidarArgs, LidarFollower, LidarSource, NODE, Sensed};
use crate::console;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::pose_listener::path_m;
use crate::progress::Progress;
use crate::visual::write_trajectory;

/// The result of a recording.
#[derive(Clone, PartialEq, Serialize, Debug)]
pub(crate) struct LidarSummary {
    /// Scans.
    pub scans: usize,
    /// Those with a pose.
    pub poses: usize,
    /// Those of them whose pose is a prediction.
    pub predicted: usize,
    /// Those after a gap in the scans, in which the motion is not known.
    pub after_a_gap: usize,
    /// Those that see another sector than the scan before: parts of turns.
    pub other_sectors: usize,
    /// Those whose pose is not to be trusted as others are: predictions, and those after gaps, among them.
    pub doubtful: usize,
    /// Why, of the last of them.
    pub last_trouble: Option<String>,
    /// How the times of points were understood, of the last scan.
    pub point_times: Option<String>,
    /// The scans with a pose whose points have no times.
    pub without_times: usize,
    /// The length of the trajectory.
    pub path_m: f64,
    /// Loops that were closed.
    pub closed_loops: usize,
    /// Why scans have no pose.
    pub without_a_pose: BTreeMap<String, u64>,
    /// Points of a scan.
    pub points_median: u64,
    /// The time of a scan, median.
    pub milliseconds_median: f64,
    /// ... of the slowest hundredth.
    pub milliseconds_p99: f64,
    /// Its steps, medians.
    pub steps_ms: BTreeMap<String, f64>,
    /// ... of the slowest hundredth.
    pub steps_p99_ms: BTreeMap<String, f64>,
}

/// Runs the odometry over a recording and writes its poses.
pub fn run(
    path: &Path,
    output: &Path,
    (args, loop_closing): (&LidarArgs, bool),
    files: &[PathBuf],
    json: bool,
) -> Result<Outcome, Failure> {
    let parameters = load(files, loop_closing)?;
    let source = LidarSource::open(path, args)?;
    let mut follower = LidarFollower::alone(&parameters).map_err(failed)?;
    let progress = Progress::new("tracking", source.steps());
    let mut losses = source.each(&Interrupt::default(), |sensed| {
        let is_scan = matches!(sensed, Sensed::Cloud(_));
        follower.take(sensed).map_err(failed)?;
        if is_scan {
            progress.advance();
        }
        Ok(())
    })?;
    progress.finish();
    losses.extend(follower.lost_after_the_end());
    let poses = follower.final_poses().map_err(failed)?;
    if !poses.is_empty() {
        write_trajectory(output, &poses, &follower.base_from_lidar())?;
    }
    let summary = LidarSummary::of(&follower);
    print_summary(&summary, output, json)?;
    let findings = findings(&summary);
    let lost: Vec<Failure> = losses.iter().map(|loss| Failure::new(loss.as_str())).collect();
    lost.iter().chain(&findings).for_each(console::print_failure);
    if summary.poses == 0 {
        return Err(Failure::new(format!("no scan of {} has a pose", source.name()))
            .fix("the causes are above; `stillmap info` lists what a bag holds"));
    }
    let is_complete = losses.is_empty() && findings.is_empty();
    Ok(if is_complete { Outcome::Complete } else { Outcome::WithLosses })
}

/// The node's parameters from files; loops are closed if these or `loop_closing` say so.
pub(super) fn load(
    files: &[PathBuf],
    loop_closing: bool,
) -> Result<LidarOdometryParameters, Failure> {
    let mut parameters: LidarOdometryParameters =
        parameters::load(&format!("/{NODE}"), files, &[] as &[Assignment])
            .map_err(|error| Failure::of_parameters(&error))?;
    parameters.loop_closing |= loop_closing;
    // The same recording gives the same map.
    parameters.loop_closing_in_background = false;
    Ok(parameters)
}

pub(super) fn failed(error: node_shell::NodeFailure) -> Failure {
    Failure::new(error.to_string())
}

impl LidarSummary {
    pub(crate) fn of(follower: &LidarFollower) -> Self {
        let poses = follower.poses();
        let processed: Vec<_> =
            follower.reports().iter().filter(|report| report.processed).collect();
        let durations_s = processed.iter().map(|report| report.step_durations_s.iter().sum());
        let durations = DurationStatistics::of_seconds(durations_s.collect());
        let mut by_step: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for report in &processed {
            for (name, seconds) in report.step_names.iter().zip(&report.step_durations_s) {
                by_step.entry(name.clone()).or_default().push(*seconds);
            }
        }
        let of_steps = |what: fn(DurationStatistics) -> f64| {
            let named = by_step.iter().filter_map(|(name, each)| {
                Some((name.clone(), what(DurationStatistics::of_seconds(each.clone())?)))
            });
            named.collect()
        };
        let count = |name: &'static str| {
            processed.iter().filter_map(move |report| {
                let mut named = report.count_names.iter().zip(&report.counts);
                named.find(|(of, _)| *of == name).map(|(_, count)| *count)
            })
        };
        let mut points: Vec<u64> = count("measured_points").collect();
        points.sort_unstable();
        Self {
            scans: follower.reports().len(),
            poses: poses.len(),
            predicted: count("held").filter(|held| *held > 0).count(),
            after_a_gap: count("after_a_gap").filter(|gap| *gap > 0).count(),
            other_sectors: count("other_sector").filter(|other| *other > 0).count(),
            doubtful: count("doubtful").filter(|doubtful| *doubtful > 0).count(),
            last_trouble: follower.last_trouble().map(str::to_owned),
            point_times: follower.point_times(),
            without_times: count("without_times").filter(|without| *without > 0).count(),
            path_m: path_m(poses),
            closed_loops: follower.closed_loops(),
            without_a_pose: follower.drops(),
            points_median: points.get(points.len() / 2).copied().unwrap_or(0),
            milliseconds_median: durations.map_or(0.0, |durations| durations.median_ms),
            milliseconds_p99: durations.map_or(0.0, |durations| durations.p99_ms),
            steps_ms: of_steps(|durations| durations.median_ms),
            steps_p99_ms: of_steps(|durations| durations.p99_ms),
        }
    }
}

fn print_summary(summary: &LidarSummary, output: &Path, json: bool) -> Result<(), Failure> {
    if json {
        let json = serde_json::to_string_pretty(summary)
            .map_err(|error| Failure::new(format!("cannot print the summary: {error}")))?;
        return console::print(json);
    }
    print(summary)?;
    if summary.poses > 0 {
        console::print(format_args!("poses: {}", output.display()))?;
    }
    Ok(())
}

/// Prints the summary as text.
pub(super) fn print(summary: &LidarSummary) -> Result<(), Failure> {
    console::print(format_args!(
        "{} poses of {} scans ({} points, median), path {:.3} m",
        summary.poses, summary.scans, summary.points_median, summary.path_m
    ))?;
    if summary.predicted > 0 {
        console::print(format_args!(
            "{} poses are predictions: their scans could not be registered",
            summary.predicted
        ))?;
    }
    if summary.after_a_gap > 0 {
        console::print(format_args!(
            "gaps in the scans: {}; the motion in them is not known, and the poses after them are where the scans fit the map best",
            summary.after_a_gap
        ))?;
    }
    if let Some(trouble) = &summary.last_trouble {
        console::print(format_args!("doubtful poses: {}; the last: {trouble}", summary.doubtful))?;
    }
    if let Some(times) = &summary.point_times {
        console::print(format_args!("times of points: {times}"))?;
    }
    if summary.without_times > 0 {
        console::print(without_times(summary))?;
    }
    if summary.closed_loops > 0 {
        console::print(format_args!("loops closed: {}", summary.closed_loops))?;
    }
    for (cause, count) in &summary.without_a_pose {
        console::print(format_args!("{cause}: {count}"))?;
    }
    if summary.scans == 0 {
        return Ok(());
    }
    console::print(format_args!(
        "{:.1} ms a scan (median), {:.1} ms (99 of 100): {:.0} scans a second",
        summary.milliseconds_median,
        summary.milliseconds_p99,
        1e3 / summary.milliseconds_median.max(f64::MIN_POSITIVE)
    ))
}
