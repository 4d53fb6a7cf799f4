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
    let LidarSummary { poses, predicted, other_sectors, .. } = *summary;
    let mut findings = Vec::new();
    if are_many(other_sectors as u64, poses.saturating_sub(other_sectors)) {
        findings.push(
            Failure::new(format!(
                "{other_sectors} of {poses} clouds see another sector than the one before: they are parts of turns, and the odometry needs whole \
                 ones"
            ))
            .fix("set the driver to publish a cloud for each turn, or record its packets (Velodyne)"),
        );
    }
    if are_many(predicted as u64, poses.saturating_sub(predicted)) {
        findings.push(
            Failure::new(format!(
                "{predicted} of {poses} poses are predictions: neither the trajectory nor the map is to be trusted"
            ))
            .fix("why is above; in a tunnel or an open field: `use_wheels`, `use_imu` (docs/road.md has what to set)"),
        );
    }
    // Those after the end of a recording are a loss of their own.
    let causes = summary.without_a_pose.iter().filter(|(cause, _)| **cause != Stage::AFTER_THE_END);
    let dropped: u64 = causes.map(|(_, count)| count).sum();
    if are_many(dropped, poses) {
        findings.push(
            Failure::new(format!("{dropped} scans were dropped, {poses} have a pose")).fix(
                "the causes are above; where stamps are doubtful: the clock of the scanner or of its driver jumps",
            ),
        );
    }
    findings
}
