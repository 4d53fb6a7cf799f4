//! `stillmap import kitti`: the laser scans of KITTI and KITTI-360, with the ground-truth poses where these are published.

mod calibration;
mod layout;

use std::path::{Path, PathBuf};

use clap::Args;
use geometry::{Revolution, Stamp, StampedPose};
use lidar_odometry::recorded::revolution_from_kitti;
use msgs::convert::message_from_revolution;
use nalgebra::Isometry3;

use super::print_summary;
use crate::console;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::sensor_bag::MAP_FRAME;
use layout::{Scan, scans};

/// The scan rate of the data sets, for sequences without times.
const SCAN_RATE_HZ: f64 = 10.0;
/// The stamp of the start, for times relative to the start: a constant and not the present time, so that the same files
/// always give the same bag.
const START: Stamp = Stamp::from_secs_nanos(1_000_000_000, 0);
/// The frame of the clouds.
const FRAME: &str = "velodyne";

/// Arguments of `stillmap import kitti`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap import kitti dataset/sequences/07 -o kitti_07.mcap
  stillmap import kitti 2013_05_28_drive_0000_sync/velodyne_points -o kitti360.mcap

The folder holds velodyne/ or data/ with numbered .bin files; times.txt or timestamps.txt, calib.txt (its Tr) and the
poses of ../../poses are taken where they are there. True poses are those of the scanner, from the first scan.")]
pub struct KittiArgs {
    /// The folder of a sequence
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The poses of the left camera, twelve numbers per line
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// The calibration with the line Tr: the pose of the scanner in the camera frame
    #[arg(long, value_name = "FILE")]
    calib: Option<PathBuf>,
    #[command(flatten)]
    pub(super) output: BagOutput,
}

pub(crate) fn import(args: &KittiArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let sequence = Sequence::open(&args.folder, args.poses.as_deref(), args.calib.as_deref())?;
    if sequence.poses.is_none() {
        console::note("no poses: the bag has no truth (--poses FILE --calib FILE)");
    }
    let mut bag = args.output.create()?;
    let progress = Progress::new("importing", sequence.len() as u64);
    let mut without_pose = 0_usize;
    for index in 0..sequence.len() {
        if interrupt.has_come() {
            break;
        }
        let revolution = sequence.revolution(index)?;
        let stamp = revolution.stamp;
        match sequence.true_pose(index) {
            Some(map_from_velodyne) => bag.true_pose(&StampedPose {
                stamp,
                frame_id: MAP_FRAME.to_owned(),
                map_from_rig: map_from_velodyne,
            })?,
            None => without_pose += usize::from(sequence.poses.is_some()),
        }
        bag.velodyne(stamp, &message_from_revolution(&revolution))?;
        progress.advance();
    }
    let summary = bag.finish()?;
    progress.finish();
    let mut outcome = Outcome::Complete;
    if without_pose > 0 {
        console::print_failure(&Failure::new(format!("{without_pose} scans have no pose")));
        outcome = Outcome::WithLosses;
    }
    print_summary(&args.output, &summary, interrupt, outcome)
}

/// The scans of a folder, with their published times and poses.
pub struct Sequence {
    scans: Vec<Scan>,
    times: Vec<Stamp>,
    /// The pose of the scanner at each frame relative to the first, if it is known.
    poses: Option<Vec<Isometry3<f64>>>,
}

impl Sequence {
    /// Finds the scans of a folder; `poses` and `calib` replace the files of the data set.
    pub fn open(
        folder: &Path,
        poses: Option<&Path>,
        calib: Option<&Path>,
    ) -> Result<Self, Failure> {
        let scans = scans(folder)?;
        let times = times_of(&scans, folder)?;
        let poses = true_poses(folder, poses, calib)?;
        Ok(Self { scans, times, poses })
    }

    /// Whether a folder holds scans.
    pub fn is_one(folder: &Path) -> bool {
        folder.is_dir() && scans(folder).is_ok()
    }

    /// The number of scans.
    pub(crate) fn len(&self) -> usize {
        self.scans.len()
    }

    /// A scan of the data set, which is already deskewed.
    pub fn revolution(&self, index: usize) -> Result<Revolution, Failure> {
        let Some(Scan { number, path }) = self.scans.get(index) else {
            return Err(Failure::new(format!("there is no scan {index}")));
        };
        let stamp = stamp_of(&self.times, *number);
        let bytes = std::fs::read(path)
            .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))?;
        revolution_from_kitti(&bytes, stamp, FRAME)
            .map_err(|error| Failure::new(error.to_string()).within(path.display()))
    }

    /// The ground-truth pose of the scanner at a scan, relative to the first frame of the sequence.
    pub fn true_pose(&self, index: usize) -> Option<Isometry3<f64>> {
        self.poses.as_ref()?.get(self.scans.get(index)?.number).copied()
    }
}

/// The times of the sequence's frames, where all scans have one.
fn times_of(scans: &[Scan], folder: &Path) -> Result<Vec<Stamp>, Failure> {
    let times = layout::times(folder)?.unwrap_or_default();
    let last = scans.last().map_or(0, |scan| scan.number);
    if times.len() > last {
        return Ok(times);
    }
    console::note(format_args!(
        "{} times, but scans up to number {last}: stamps are {SCAN_RATE_HZ} a second",
        times.len()
    ));
    Ok(Vec::new())
}

fn stamp_of(times: &[Stamp], number: usize) -> Stamp {
    let evenly = || START.plus_seconds(number as f64 / SCAN_RATE_HZ);
    times.get(number).copied().unwrap_or_else(evenly)
}

/// The pose of the scanner at each scan of the sequence, relative to the first.
fn true_poses(
    folder: &Path,
    given: Option<&Path>,
    calib: Option<&Path>,
) -> Result<Option<Vec<Isometry3<f64>>>, Failure> {
    let Some(path) = given.map(Path::to_owned).or_else(|| layout::published_poses(folder)) else {
        return Ok(None);
    };
    let calib = calib.map_or_else(|| folder.join("calib.txt"), Path::to_owned);
    if given.is_none() && !calib.is_file() {
        console::note(format_args!(
            "the poses of {} are left out: {} does not exist (--calib FILE)",
            path.display(),
            calib.display()
        ));
        return Ok(None);
    }
    let camera_from_velodyne = calibration::camera_from_velodyne(&calib)?;
    let velodyne_from_camera = camera_from_velodyne.inverse();
    let poses = calibration::read_poses(&path)?;
    let from_first = |map_from_camera: &Isometry3<f64>| {
        velodyne_from_camera * map_from_camera * camera_from_velodyne
    };
    Ok(Some(poses.iter().map(from_first).collect()))
}
