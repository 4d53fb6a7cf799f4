//! What is wrong with a drive that was followed nevertheless.

use lidar_odometry::shell::Stage;

use super::odometry::LidarSummary;
use crate::failure::Failure;
use crate::run::are_many;

/// What to do where the points of a scanner that turns have no times.
pub(crate) const POINT_TIMES_FIX: &str = "let the driver publish the time of each point (velodyne_driver: XYZIRT; ouster: t; hesai, \
                                          robosense: timestamp), or record its packets";

/// What is to be said where scans have no times of points.
pub(super) fn without_times(summary: &LidarSummary) -> String {
    format!(
        "{} of {} scans have no times of points: the motion within them is not corrected, unless it was before (as in KITTI's benchmark): the \
         faster the vehicle, the shorter and the more bent is the path -> {POINT_TIMES_FIX}",
        summary.without_times, summary.poses
    )
}

/// What the user should know of a drive, each with its fix; empty if there is nothing.
pub(super) fn findings(summary: &LidarSummary) -> Vec<Failure> {
    let mut findings = Vec::new();
    // Those after the end of a recording are a loss of their own.
    let causes = summary.without_a_pose.iter().filter(|(cause, _)| **cause != Stage::AFTER_THE_END);
    let dropped: u64 = causes.map(|(_, count)| count).sum();
    if are_many(dropped, summary.poses) {
        findings.push(
            Failure::new(format!("{dropped} scans were dropped, {} have a pose", summary.poses)).fix(
                "the causes are above; where stamps are doubtful: the clock of the scanner or of its driver jumps",
            ),
        );
    }
    findings
}
