//! `stillmap import tum`: a sequence of the TUM RGB-D benchmark (Sturm et al., IROS 2012).

use std::path::{Path, PathBuf};

use clap::Args;
use geometry::{CameraModel, Distortion, Stamp, StampedPose};
use msgs::convert::time_from_stamp;
use msgs::sensor_msgs::CompressedImage;
use msgs::std_msgs::Header;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::depth::parse_intrinsics;
use super::depth_png::{DepthUnit, read_depth};
use super::scan_cut::{ScanCut, ScanCutArgs};
use crate::console;
use crate::failure::{Failure, Outcome};
use crate::progress::Progress;
use crate::rig::rig_from_camera;
use crate::sensor_bag::{DEPTH_FRAME, MAP_FRAME, SensorBag};

/// Depth pictures of the benchmark store 5000 units a metre (its file format page).
const UNITS_PER_METRE: f64 = 5000.0;

/// Intrinsics of the three colour cameras, to which the depth is registered: fx, fy, cx, cy and the
/// five plumb_bob coefficients (the benchmark's calibration page).
const FREIBURG: [(&str, [f64; 4], [f64; 5]); 3] = [
    ("freiburg1", [517.3, 516.5, 318.6, 255.3], [0.2624, -0.9531, -0.0054, 0.0026, 1.1633]),
    ("freiburg2", [520.9, 521.0, 325.1, 249.7], [0.2312, -0.7849, -0.0033, -0.0001, 0.9172]),
    ("freiburg3", [535.4, 539.2, 320.1, 247.6], [0.0; 5]),
];

/// Arguments of `stillmap import tum`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap import tum rgbd_dataset_freiburg1_rpy --scan-from-depth -o fr1_rpy.mcap")]
pub(crate) struct TumArgs {
    /// The folder that holds rgb.txt, depth.txt and groundtruth.txt
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Focal lengths and principal point in pixels, where the folder's name does not tell the camera
    #[arg(long, value_name = "FX,FY,CX,CY", value_parser = parse_intrinsics)]
    intrinsics: Option<[f64; 4]>,
    #[command(flatten)]
    scan: ScanCutArgs,
    /// The bag to write
    #[arg(short, long, value_name = "BAG")]
    output: PathBuf,
}

pub(crate) fn import(args: &TumArgs) -> Result<Outcome, Failure> {
    let calibration = calibration(args)?;
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

    let mut bag = SensorBag::create(&args.output)?;
    let mut cut = ScanCut::new(&args.scan);
    let progress = Progress::new("importing", items.len() as u64);
    for (stamp, item) in items {
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
                // The benchmark's poses are those of the optical frame.
                map_from_rig: map_from_camera * rig_from_camera().inverse(),
            })?,
        }
        progress.advance();
    }
    let summary = bag.finish()?;
    progress.finish();
    console::print(format_args!("{}: {} messages", args.output.display(), summary.message_count))?;
    Ok(Outcome::Complete)
}

enum Item {
    Depth(PathBuf),
    Colour(PathBuf),
    Pose(Isometry3<f64>),
}

struct Calibration {
    intrinsics_px: [f64; 4],
    distortion: Distortion,
}

impl Calibration {
    fn camera(&self, (width_px, height_px): (usize, usize)) -> CameraModel {
        let [fx_px, fy_px, cx_px, cy_px] = self.intrinsics_px;
        let distortion = self.distortion;
        CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion }
    }
}

fn calibration(args: &TumArgs) -> Result<Calibration, Failure> {
    if let Some(intrinsics_px) = args.intrinsics {
        return Ok(Calibration { intrinsics_px, distortion: Distortion::None });
    }
    let folder = args.folder.canonicalize().unwrap_or_else(|_| args.folder.clone());
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let known = FREIBURG.iter().find(|(camera, ..)| name.contains(camera));
    match known {
        Some((_, intrinsics_px, coefficients)) => Ok(Calibration {
            intrinsics_px: *intrinsics_px,
            distortion: if coefficients.iter().all(|value| *value == 0.0) {
                Distortion::None
            } else {
                Distortion::PlumbBob(*coefficients)
            },
        }),
        None => Err(Failure::new(format!("the name '{name}' does not tell which camera it was"))
            .mend("give --intrinsics fx,fy,cx,cy, or keep the folder's name as published (freiburg1, 2 or 3 in it)")),
    }
}

/// Lines of `seconds rest`, `#` before comments.
fn read_list(path: &Path) -> Result<Vec<(Stamp, String)>, Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        Failure::new(format!("cannot read {}: {error}", path.display()))
            .mend("a TUM sequence holds depth.txt, rgb.txt and groundtruth.txt")
    })?;
    let mut list = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let parsed = line
            .split_once(char::is_whitespace)
            .and_then(|(seconds, rest)| Some((parse_stamp(seconds)?, rest.trim().to_owned())));
        list.push(parsed.ok_or_else(|| {
            Failure::new(format!("{} line {}: cannot read '{line}'", path.display(), index + 1))
        })?);
    }
    Ok(list)
}

/// Decimal seconds, read digit by digit: a float would lose the nanoseconds.
fn parse_stamp(text: &str) -> Option<Stamp> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    if fraction.len() > 9 {
        return None;
    }
    let nanos = format!("{fraction:0<9}").parse::<u32>().ok()?;
    Some(Stamp::from_secs_nanos(whole.parse().ok()?, nanos))
}

/// `tx ty tz qx qy qz qw`.
fn pose_of(text: &str) -> Option<Isometry3<f64>> {
    let numbers: Vec<f64> =
        text.split_whitespace().map(|number| number.parse().ok()).collect::<Option<_>>()?;
    let [x, y, z, qx, qy, qz, qw] = numbers.try_into().ok()?;
    let rotation = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 1e-6)?;
    Some(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

/// The PNG file as it is, as image_transport's `compressed` topics carry it.
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
mod tests {
    use super::*;

    #[test]
    fn a_stamp_keeps_its_microseconds() {
        let stamp = parse_stamp("1305031229.528748").unwrap();
        assert_eq!(stamp.secs_nanos(), (1_305_031_229, 528_748_000));
        assert_eq!(parse_stamp("12").unwrap().secs_nanos(), (12, 0));
        assert_eq!(parse_stamp("12.1234567891"), None);
        assert_eq!(parse_stamp("x.1"), None);
    }

    #[test]
    fn a_pose_needs_seven_numbers_and_a_rotation() {
        let pose = pose_of("1 2 3 0 0 0 1").unwrap();
        assert_eq!(pose, Isometry3::translation(1.0, 2.0, 3.0));
        assert_eq!(pose_of("1 2 3 0 0 0"), None);
        assert_eq!(pose_of("1 2 3 0 0 0 0"), None);
    }
}
