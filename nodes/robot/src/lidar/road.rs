//! `stillmap run ... --pose lidar` of a recording without 2D scanner and camera: the road map of the LiDAR alone.

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use clap::Args;
use geometry::{LidarCloud, Stamp};
use lidar_odometry::road_map::{RoadMapConfig, RoadMapCounts};
use lidar_odometry::shell::LidarOdometryParameters;
use nalgebra::{Isometry3, Point2};
use serde::Serialize;

use super::drive_map::DriveMap;
use super::files::{
    RoadColour, RoadExtent, cannot_write, for_each, write_las, write_pcd, write_ply,
};
use super::findings::findings;
use super::follower::FollowedScan;
use super::odometry::{LidarSummary, failed, load, print};
use super::{LidarArgs, LidarFollower, LidarSource, Sensed, pictures, report};
use crate::console;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::visual::write_trajectory;

/// The files that a run writes to its folder.
pub(crate) const RESULTS: [&str; 14] = [
    "map.ply",
    "map.pcd",
    "map.las",
    "trajectory.txt",
    "summary.json",
    "report.html",
    "map_intensity.png",
    "map_height.png",
    "drive_from_above.png",
    "whole_drive.png",
    "panorama_intensity.png",
    "panorama_range.png",
    "panorama_intensity_pink.png",
    "panorama_range_hsv.png",
];

/// The options of a road map.
#[derive(Args, Clone, PartialEq, Debug)]
pub struct RoadArgs {
    /// With a LiDAR's road map: the edge of its voxels, in m
    #[arg(long, value_name = "M", default_value_t = RoadMapConfig::default().voxel_edge_m)]
    road_voxel: f64,
    /// With a LiDAR's road map: voxels in memory; the rest is kept in files, and none is lost
    #[arg(long, value_name = "N", default_value_t = RoadMapConfig::default().max_voxels)]
    road_memory: usize,
    /// With a LiDAR's road map: what it is coloured by
    #[arg(long, value_enum, default_value_t)]
    colour: RoadColour,
    /// With a LiDAR: close loops when a place is revisited, and correct the drift of the odometry
    #[arg(long)]
    loop_closing: bool,
}

impl Default for RoadArgs {
    fn default() -> Self {
        let RoadMapConfig { voxel_edge_m, max_voxels, .. } = RoadMapConfig::default();
        Self {
            road_voxel: voxel_edge_m,
            road_memory: max_voxels,
            colour: RoadColour::default(),
            loop_closing: false,
        }
    }
}

impl RoadArgs {
    /// The map, with the ranges of the odometry.
    fn map(&self, odometry: &LidarOdometryParameters) -> Result<RoadMapConfig, Failure> {
        let map = RoadMapConfig {
            voxel_edge_m: self.road_voxel,
            max_voxels: self.road_memory,
            ..odometry.road_map()
        };
        map.validate().map_err(|error| {
            Failure::unusable(format!("the road map: {error}"))
                .fix("see --road-voxel, --road-memory, and min_range_m and max_range_m of the parameters")
        })?;
        Ok(map)
    }
}

/// The content of `summary.json`.
#[derive(Serialize, Debug)]
pub(super) struct RoadSummary {
    pub(super) odometry: LidarSummary,
    pub(super) map: RoadMapCounts,
    pub(super) map_points: u64,
    pub(super) map_voxel_edge_m: f64,
    pub(super) losses: Vec<String>,
}

/// Runs the odometry over a recording and writes the map, the trajectory and a report to a folder.
pub fn run(
    path: &Path,
    out: &Path,
    (lidar, road): (&LidarArgs, &RoadArgs),
    files: &[PathBuf],
    json: bool,
    interrupt: &Interrupt,
) -> Result<Outcome, Failure> {
    let parameters = load(files, road.loop_closing)?;
    let map = road.map(&parameters)?;
    let source = LidarSource::open_while(path, lidar, interrupt)?;
    std::fs::create_dir_all(out).map_err(|error| cannot_write(out, &error))?;
    let mut drive = Drive::new(&parameters, map, out)?;
    let progress = Progress::new("mapping", source.steps());
    let mut losses = source.each(interrupt, |sensed| {
        let is_scan = matches!(sensed, Sensed::Cloud(_));
        drive.take(sensed)?;
        if is_scan {
            progress.advance();
        }
        Ok(())
    })?;
    losses.extend(drive.follower.lost_after_the_end());
    drive.map.finish()?;
    progress.finish();
    if interrupt.has_come() && drive.trajectory.is_empty() {
        console::note("interrupted before the first pose: nothing is written");
        return Ok(Outcome::Interrupted);
    }
    if drive.follower.closed_loops() > 0 {
        drive.rebuild_map(&source, map, out)?;
    }
    let summary = drive.write(out, road, losses, path)?;
    if json {
        let json = serde_json::to_string_pretty(&summary)
            .map_err(|error| Failure::new(format!("cannot print the summary: {error}")))?;
        console::print(json)?;
    } else {
        print_summary(&summary, out)?;
    }
    let findings = findings(&summary.odometry);
    let lost: Vec<Failure> =
        summary.losses.iter().map(|loss| Failure::new(loss.as_str())).collect();
    lost.iter().chain(&findings).for_each(console::print_failure);
    if interrupt.has_come() {
        console::note("interrupted: the map is of what was read until then");
        return Ok(Outcome::Interrupted);
    }
    if summary.odometry.poses == 0 {
        return Err(Failure::new(format!("no scan of {} has a pose", source.name()))
            .fix("`stillmap info` lists what a bag holds"));
    }
    let is_complete = summary.losses.is_empty() && findings.is_empty();
    Ok(if is_complete { Outcome::Complete } else { Outcome::WithLosses })
}

fn print_summary(summary: &RoadSummary, out: &Path) -> Result<(), Failure> {
    print(&summary.odometry)?;
    let path = out.display();
    console::print(format_args!(
        "{} points of the map, voxels of {} m ({} tiles kept in files)",
        summary.map_points, summary.map_voxel_edge_m, summary.map.spilled_tiles
    ))?;
    console::print(format_args!(
        "map: {path}/map.ply, map.pcd, map.las; trajectory: {path}/trajectory.txt; figures: {path}/summary.json"
    ))?;
    console::print(format_args!("report: {path}/report.html"))
}

/// The part of a drive that was read so far.
struct Drive {
    follower: LidarFollower,
    map: DriveMap,
    /// Each scan, and its pose where it has one.
    scans: Vec<Option<FollowedScan>>,
    trajectory: Vec<Isometry3<f64>>,
    truth: Vec<(Stamp, Isometry3<f64>)>,
    /// A scan of the drive, for the panoramas.
    shown: LidarCloud,
}

impl Drive {
    fn new(
        parameters: &LidarOdometryParameters,
        map: RoadMapConfig,
        out: &Path,
    ) -> Result<Self, Failure> {
        let follower = LidarFollower::alone(parameters).map_err(failed)?;
        let map = DriveMap::new(map, follower.base_from_lidar(), out)?;
        Ok(Self {
            follower,
            map,
            scans: Vec::new(),
            trajectory: Vec::new(),
            truth: Vec::new(),
            shown: LidarCloud::default(),
        })
    }

    fn take(&mut self, sensed: Sensed) -> Result<(), Failure> {
        if let Sensed::Truth(stamp, pose) = sensed {
            self.truth.push((stamp, pose));
            return Ok(());
        }
        let Sensed::Cloud(message) = &sensed else {
            return self.follower.take(sensed).map(drop).map_err(failed);
        };
        let cloud = self.follower.cloud(message);
        let followed = self.follower.take(sensed).map_err(failed)?;
        self.scans.push(followed);
        let (Some(cloud), Some(now)) = (cloud, followed) else { return Ok(()) };
        self.trajectory.push(now.odom_from_base);
        if self.trajectory.len().is_power_of_two() {
            self.shown.clone_from(&cloud);
        }
        self.map.take(&cloud, now, &now.odom_from_base)
    }

    /// After loop closures the poses differ from those of the first pass: reads the recording once more and builds the map anew.
    fn rebuild_map(
        &mut self,
        source: &LidarSource,
        map: RoadMapConfig,
        out: &Path,
    ) -> Result<(), Failure> {
        let base_from_lidar = self.follower.base_from_lidar();
        let mut map = DriveMap::new(map, base_from_lidar, out)?;
        let progress =
            Progress::new("rebuilding the map with closed loops", self.scans.len() as u64);
        let mut scans = self.scans.iter();
        self.trajectory.clear();
        // Losses were reported in the first pass.
        let end = Interrupt::default();
        let _ = source.each(&end, |sensed| {
            let Sensed::Cloud(message) = sensed else { return Ok(()) };
            progress.advance();
            let Some(now) = scans.next() else {
                // The first pass was interrupted here.
                end.trigger();
                return Ok(());
            };
            let Some(now) = *now else { return Ok(()) };
            let map_from_base = self.follower.map_from_base(now.stamp, &now.odom_from_base);
            self.trajectory.push(map_from_base);
            match self.follower.cloud(&message) {
                Some(cloud) => map.take(&cloud, now, &map_from_base),
                None => Ok(()),
            }
        })?;
        map.finish()?;
        progress.finish();
        self.map = map;
        Ok(())
    }

    fn write(
        &self,
        out: &Path,
        road: &RoadArgs,
        losses: Vec<String>,
        recording: &Path,
    ) -> Result<RoadSummary, Failure> {
        let map = self.map.map();
        let extent = RoadExtent::of(map)?;
        write_ply(&out.join("map.ply"), map, &extent, road.colour)?;
        write_pcd(&out.join("map.pcd"), map, &extent)?;
        write_las(&out.join("map.las"), map, &extent, road.colour)?;
        let poses = self.follower.final_poses().map_err(failed)?;
        write_trajectory(&out.join("trajectory.txt"), &poses, &Isometry3::identity())?;
        let summary = RoadSummary {
            odometry: LidarSummary::of(&self.follower),
            map: map.counts(),
            map_points: extent.points,
            map_voxel_edge_m: road.road_voxel,
            losses,
        };
        let json = serde_json::to_string_pretty(&summary)
            .map_err(|error| Failure::new(format!("cannot write summary.json: {error}")))?;
        write(&out.join("summary.json"), json.as_bytes())?;
        let mut shown = pictures::drawings(
            &self.trajectory,
            self.true_trajectory().as_deref(),
            &self.surroundings()?,
        )?;
        for (colour, name) in
            [(RoadColour::Intensity, "map_intensity.png"), (RoadColour::Height, "map_height.png")]
        {
            let how = (colour, road.road_voxel);
            shown.push(pictures::map_from_above(map, &extent, how, name)?);
        }
        shown.extend(pictures::panoramas(&self.shown)?);
        pictures::write(out, &shown)?;
        let page = report::page(&summary, shown, recording);
        write(&out.join("report.html"), page.as_bytes())?;
        Ok(summary)
    }

    /// The true trajectory from the first pose, if the recording has it.
    fn true_trajectory(&self) -> Option<Vec<Isometry3<f64>>> {
        let (first, begins) = (self.truth.first()?.1.inverse(), *self.trajectory.first()?);
        Some(self.truth.iter().map(|(_, pose)| begins * first * pose).collect())
    }

    /// The surroundings of the vehicle at the end: points of the map at its height.
    fn surroundings(&self) -> Result<Vec<Point2<f32>>, Failure> {
        /// Above the road and below bridges, from the scanner's height.
        const BELOW_M: f64 = 1.0;
        const ABOVE_M: f64 = 2.0;
        const REACH_M: f64 = 150.0;
        let Some(last) = self.trajectory.last() else { return Ok(Vec::new()) };
        let at_m = (last * self.follower.base_from_lidar()).translation.vector;
        let mut surroundings_m = Vec::new();
        for_each(self.map.map(), |point| {
            let off_m = point.position_m.coords - at_m;
            let is_beside = (-BELOW_M..ABOVE_M).contains(&off_m.z);
            if is_beside && off_m.xy().norm() < REACH_M {
                surroundings_m.push(point.position_m.xy().cast());
            }
            Ok(())
        })?;
        Ok(surroundings_m)
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    std::fs::write(path, bytes).map_err(|error| cannot_write(path, &error))
}
