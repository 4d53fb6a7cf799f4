//! The result of `stillmap odometry` of a camera.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use geometry::Stamp;
use msgs::convert::stamp_from_time;
use msgs::geometry_msgs::PoseStamped;
use msgs::stillmap_msgs::StageReport;
use pose::shell::Stage;
use report::DurationStatistics;
use serde::Serialize;

use crate::console;
use crate::failure::Failure;
use crate::pose_listener::path_m;
use crate::visual::{DropsOfCause, LostSpan, VisualOdometry};

/// The cause of pairs whose camera was followed, but not yet found in the loaded map.
const NOT_IN_THE_MAP: &str = "not found in the map";

/// The result of a run.
#[derive(Serialize, Debug)]
pub(super) struct OdometrySummary {
    /// Without the images that have no partner.
    image_pairs: usize,
    poses: usize,
    path_m: f64,
    without_a_pose: BTreeMap<String, u64>,
    /// Why, of the first of each cause.
    reasons: BTreeMap<String, String>,
    /// When the camera was lost for longer than a moment.
    lost: Vec<Lost>,
    /// With a map.
    #[serde(skip_serializing_if = "Option::is_none")]
    loops_closed: Option<u64>,
    inliers_median: u64,
    milliseconds_median: f64,
    milliseconds_p99: f64,
    /// The size and the path of the saved map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) map: Option<String>,
}

/// A part of the recording in which the camera was lost; times are since its first pose.
#[derive(Serialize, Debug)]
struct Lost {
    from_s: f64,
    /// `None` where it is not found again.
    to_s: Option<f64>,
    /// Where it is found again.
    found_at_m: Option<[f64; 3]>,
    reason: String,
}

impl Lost {
    fn of(span: &LostSpan, poses: &[PoseStamped]) -> Self {
        let at = |found: Stamp| {
            let after = poses.iter().find(|pose| stamp_from_time(pose.header.stamp) >= found)?;
            let msgs::geometry_msgs::Point { x, y, z } = after.pose.position;
            Some([x, y, z])
        };
        Self {
            from_s: span.from_s,
            to_s: span.to.map(|(to_s, _)| to_s),
            found_at_m: span.to.and_then(|(_, found)| at(found)),
            reason: span.reason.clone(),
        }
    }
}

impl fmt::Display for Lost {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { from_s, to_s, found_at_m, reason } = self;
        match to_s {
            Some(to_s) => write!(formatter, "lost from {from_s:.1} s to {to_s:.1} s: {reason}")?,
            None => write!(formatter, "lost from {from_s:.1} s to the end: {reason}")?,
        }
        match found_at_m {
            Some([x, y, z]) => {
                write!(formatter, "; found again at ({x:.2}, {y:.2}, {z:.2}) m")
            }
            None => Ok(()),
        }
    }
}

impl OdometrySummary {
    pub(super) fn of(odometry: &VisualOdometry, poses: &[PoseStamped]) -> Self {
        let processed: Vec<&StageReport> =
            odometry.reports().iter().filter(|report| report.processed).collect();
        let durations_s = processed.iter().map(|report| report.step_durations_s.iter().sum());
        let durations = DurationStatistics::of_seconds(durations_s.collect());
        let mut inliers: Vec<u64> = counted(&processed, "inliers").collect();
        inliers.sort_unstable();
        let without_pose = odometry.without_pose();
        let drops = without_pose.drops().iter();
        let mut without_a_pose: BTreeMap<String, u64> =
            drops.clone().map(|(cause, drops)| (cause.clone(), drops.count)).collect();
        let first_reason = |(cause, drops): (&String, &DropsOfCause)| {
            Some((cause.clone(), drops.first_reason.clone()?))
        };
        let not_in_the_map = processed.len().saturating_sub(odometry.poses().len()) as u64;
        if not_in_the_map > 0 {
            without_a_pose.insert(NOT_IN_THE_MAP.to_owned(), not_in_the_map);
        }
        Self {
            image_pairs: without_pose.pairs(),
            poses: poses.len(),
            path_m: path_m(poses),
            without_a_pose,
            reasons: drops.filter_map(first_reason).collect(),
            lost: without_pose.lost().map(|span| Lost::of(span, poses)).collect(),
            loops_closed: loops_closed(&processed),
            inliers_median: inliers.get(inliers.len() / 2).copied().unwrap_or(0),
            milliseconds_median: durations.map_or(0.0, |durations| durations.median_ms),
            milliseconds_p99: durations.map_or(0.0, |durations| durations.p99_ms),
            map: None,
        }
    }

    /// How many images have no pose, by cause.
    pub(super) fn causes(&self) -> impl Iterator<Item = String> {
        self.without_a_pose.iter().map(|(cause, count)| match self.reasons.get(cause) {
            Some(reason) => format!("{cause}: {count}; the first: {reason}"),
            None => format!("{cause}: {count}"),
        })
    }
}

/// `None` without a map.
fn loops_closed(reports: &[&StageReport]) -> Option<u64> {
    counted(reports, Stage::CLOSED_LOOPS).reduce(|one, more| one + more)
}

/// What the reports have counted by this name, each that has it.
fn counted(reports: &[&StageReport], name: &str) -> impl Iterator<Item = u64> {
    let named = reports.iter().flat_map(|report| report.count_names.iter().zip(&report.counts));
    named.filter(move |(of, _)| *of == name).map(|(_, count)| *count)
}

/// Prints the summary as JSON or as text.
pub(super) fn print_summary(
    summary: &OdometrySummary,
    output: &Path,
    json: bool,
) -> Result<(), Failure> {
    if json {
        let json = serde_json::to_string_pretty(summary)
            .map_err(|error| Failure::new(format!("cannot print the summary: {error}")))?;
        return console::print(json);
    }
    console::print(format_args!(
        "{} poses of {} pairs of images, path {:.3} m; {} inliers (median)",
        summary.poses, summary.image_pairs, summary.path_m, summary.inliers_median
    ))?;
    if let Some(loops) = summary.loops_closed {
        console::print(format_args!("{loops} loops closed"))?;
    }
    summary.causes().try_for_each(console::print)?;
    summary.lost.iter().try_for_each(console::print)?;
    console::print(format_args!(
        "{:.1} ms a pair (median), {:.1} ms (99 of 100)",
        summary.milliseconds_median, summary.milliseconds_p99
    ))?;
    summary.map.iter().try_for_each(console::print)?;
    if summary.poses > 0 {
        console::print(format_args!("poses: {}", output.display()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: whether a loop was closed was said nowhere.
    #[test]
    fn closed_loops_are_counted_where_there_is_a_map() {
        let report = |counts: &[(&str, u64)]| StageReport {
            count_names: counts.iter().map(|(name, _)| (*name).to_owned()).collect(),
            counts: counts.iter().map(|(_, count)| *count).collect(),
            ..StageReport::default()
        };
        let closed = |reports: &[StageReport]| loops_closed(&reports.iter().collect::<Vec<_>>());
        let in_map = |loops| report(&[("inliers", 50), (Stage::CLOSED_LOOPS, loops)]);
        assert_eq!(closed(&[in_map(0), in_map(1), in_map(0), in_map(1)]), Some(2));
        assert_eq!(closed(&[in_map(0)]), Some(0));
        assert_eq!(closed(&[report(&[("inliers", 50)])]), None);
    }
}
