//! `stillmap import tum`: a sequence of the TUM RGB-D benchmark (Sturm et al., IROS 2012).

mod sequence;

use std::path::{Path, PathBuf};

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
use crate::sensor_bag::{DEPTH_FRAME, MAP_FRAME};
pub use sequence::{Calibration, UNITS_PER_METRE, pose_of, read_list};

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
    #[command(flatten)]
    scan: ScanCutArgs,
    #[command(flatten)]
    pub(super) output: BagOutput,
}

pub(crate) fn import(args: &TumArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let calibration = Calibration::of(&args.folder, args.intrinsics)?;
    let unit = DepthUnit::new(UNITS_PER_METRE)?;
    let mut items = Vec::new();
    for (stamp, rest) in read_list(&args.folder.join("depth.txt"))? {
        items.push((stamp, Item::Depth(args.folder.join(rest))));
    }
    let rgb_list = args.folder.join("rgb.txt");
    if rgb_list.is_file() {
        for (stamp, rest) in read_list(&rgb_list)? {
            items.push((stamp, Item::Colour(args.folder.join(rest))));
        }
    }
    let truth = args.folder.join("groundtruth.txt");
    if truth.is_file() {
        for (stamp, rest) in read_list(&truth)? {
            let map_from_camera = pose_of(&rest).ok_or_else(|| {
                Failure::new(format!("{}: cannot read '{rest}'", truth.display()))
            })?;
            items.push((stamp, Item::Pose(map_from_camera)));
        }
    }
    items.sort_by_key(|(stamp, _)| *stamp);

    let mut bag = args.output.create()?;
    let mut cut = ScanCut::new(&args.scan);
    let progress = Progress::new("importing", items.len() as u64);
    for (stamp, item) in items {
        if interrupt.has_come() {
            break;
        }
        match item {
            Item::Depth(path) => {
                let image = read_depth(&path, unit, stamp, DEPTH_FRAME)?;
                let camera = calibration.camera((image.width_px(), image.height_px()));
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
    print_summary(&args.output, &summary, interrupt, Outcome::Complete)
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
