//! `stillmap import tum`: a sequence of the TUM RGB-D benchmark (Sturm et al., IROS 2012).

mod sequence;

use std::path::{Path, PathBuf};

use bag_player::BagSummary;
use clap::Args;
use geometry::{Stamp, StampedPose};
use msgs::convert::time_from_stamp;
use msgs::sensor_msgs::CompressedImage;
use msgs::std_msgs::Header;
use nalgebra::Isometry3;

pub use super::depth::parse_intrinsics;
use super::depth_png::{DepthUnit, read_depth};
use super::print_summary;
use super::scan_cut::{ScanCut, ScanCutArgs};
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::rig::rig_from_camera;
use crate::ros_words::quoted;
use crate::sensor_bag::{DEPTH_FRAME, MAP_FRAME, SensorBag};
pub use sequence::{Calibration, UNITS_PER_METRE, pose_of, read_list};

const COLOUR_LIST: &str = "rgb.txt";
const DEPTH_LIST: &str = "depth.txt";
const TRUTH: &str = "groundtruth.txt";

/// Arguments of `stillmap import tum`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap import tum rgbd_dataset_freiburg1_rpy --scan-from-depth -o fr1_rpy.mcap")]
pub struct TumArgs {
    /// The folder that holds rgb.txt, depth.txt and groundtruth.txt
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Focal lengths and principal point in pixels, if the folder's name does not contain the camera's
    #[arg(long, value_name = "FX,FY,CX,CY", value_parser = parse_intrinsics)]
    intrinsics: Option<[f64; 4]>,
    /// Stored depth units per metre: 5000 in the benchmark, 1000 of most cameras
    #[arg(long, value_name = "UNITS", default_value_t = UNITS_PER_METRE)]
    units_per_metre: f64,
    #[command(flatten)]
    scan: ScanCutArgs,
    #[command(flatten)]
    pub(super) output: BagOutput,
}

pub(crate) fn import(args: &TumArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let calibration = Calibration::of(&args.folder, args.intrinsics)?;
    let cut = ScanCut::new(&args.scan);
    let camera = (calibration, DepthUnit::new(args.units_per_metre)?);
    let summary = write(&args.folder, camera, cut, || args.output.create(), interrupt)?;
    print_summary(&args.output, &summary, interrupt, Outcome::Complete)
}

/// Whether a folder is a sequence.
pub(crate) fn is_sequence(folder: &Path) -> bool {
    let has = |list: &str| folder.join(list).is_file();
    has(DEPTH_LIST) && (has(COLOUR_LIST) || has(TRUTH))
}

/// Makes a bag of a sequence whose camera is known, with scans that are cut out of its depth images.
pub(crate) fn import_to(bag: &Path, folder: &Path, interrupt: &Interrupt) -> Result<(), Failure> {
    let calibration = Calibration::of(folder, None).map_err(|failure| {
        failure.fix(format!(
            "`stillmap import tum {} --intrinsics FX,FY,CX,CY --scan-from-depth -o BAG` makes a bag of it, or keep the folder's name as published (freiburg1, 2 \
             or 3 in it)",
            quoted(&folder.display().to_string())
        ))
    })?;
    let create = || BagOutput::new(bag.to_owned()).create();
    let camera = (calibration, DepthUnit::new(UNITS_PER_METRE)?);
    write(folder, camera, ScanCut::usual(), create, interrupt).map(drop)
}

fn write(
    folder: &Path,
    (calibration, unit): (Calibration, DepthUnit),
    mut cut: ScanCut,
    create: impl FnOnce() -> Result<SensorBag, Failure>,
    interrupt: &Interrupt,
) -> Result<BagSummary, Failure> {
    let mut items = Vec::new();
    for (stamp, rest) in read_list(&folder.join(DEPTH_LIST))? {
        items.push((stamp, Item::Depth(folder.join(rest))));
    }
    let rgb_list = folder.join(COLOUR_LIST);
    if rgb_list.is_file() {
        for (stamp, rest) in read_list(&rgb_list)? {
            items.push((stamp, Item::Colour(folder.join(rest))));
        }
    }
    let truth = folder.join(TRUTH);
    if truth.is_file() {
        for (stamp, rest) in read_list(&truth)? {
            let map_from_camera = pose_of(&rest).ok_or_else(|| {
                Failure::new(format!("{}: cannot read '{rest}'", truth.display()))
            })?;
            items.push((stamp, Item::Pose(map_from_camera)));
        }
    }
    items.sort_by_key(|(stamp, _)| *stamp);

    let mut bag = create()?;
    let progress = Progress::new("importing", items.len() as u64);
    for (stamp, item) in items {
        if interrupt.has_come() {
            break;
        }
        match item {
            Item::Depth(path) => {
                let image = read_depth(&path, unit, stamp, DEPTH_FRAME)?;
                let camera = calibration.camera((image.width_px(), image.height_px()))?;
                bag.camera(&camera, stamp)?;
                if let Some(scan) = cut.scan(&image, &camera)? {
                    bag.scan(&scan)?;
                }
                bag.depth(&image)?;
            }
            Item::Colour(path) => bag.colour(stamp, &compressed_picture(&path, stamp)?)?,
            Item::Pose(map_from_camera) => bag.pose(&StampedPose {
                stamp,
                frame_id: MAP_FRAME.to_owned(),
                // The benchmark's poses are of the optical frame.
                map_from_rig: map_from_camera * rig_from_camera().inverse(),
            })?,
        }
        progress.advance();
    }
    let summary = bag.finish()?;
    progress.finish();
    Ok(summary)
}

enum Item {
    Depth(PathBuf),
    Colour(PathBuf),
    Pose(Isometry3<f64>),
}

/// The unchanged PNG file as a message of image_transport's `compressed` topics.
fn compressed_picture(path: &Path, stamp: Stamp) -> Result<CompressedImage, Failure> {
    let data = std::fs::read(path)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))?;
    Ok(CompressedImage {
        header: Header { stamp: time_from_stamp(stamp), frame_id: DEPTH_FRAME.to_owned() },
        format: "rgb8; png compressed bgr8".to_owned(),
        data,
    })
}

#[cfg(test)]
mod tests;
