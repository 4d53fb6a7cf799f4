//! `stillmap import depth`: numbered depth images of a static camera.

use std::path::{Path, PathBuf};

use clap::Args;
use geometry::{CameraModel, Distortion, LabelImage, Stamp, StampedPose};
use nalgebra::Isometry3;

use super::depth_png::{DepthUnit, numbered_pictures, read_depth, read_mask};
use super::print_summary;
use super::scan_cut::{ScanCut, ScanCutArgs};
use crate::doctor::wrong_calibration;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::sensor_bag::{DEPTH_FRAME, MAP_FRAME};

/// The stamp of the first image, since the files have none: a constant and not the present time,
/// so that the same files always give the same bag.
const FIRST_STAMP: Stamp = Stamp::from_secs_nanos(1_000_000_000, 0);

/// Arguments of `stillmap import depth`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap import depth kitchen/depth --intrinsics 365,365,256,212 --rate 10 \\
      --scan-from-depth --masks kitchen/masks -o kitchen.mcap")]
pub struct DepthArgs {
    /// The folder of the images 0001.png, 0002.png, ...
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Focal lengths and principal point in pixels
    #[arg(long, value_name = "FX,FY,CX,CY", value_parser = parse_intrinsics)]
    intrinsics: [f64; 4],
    /// Pictures per second of the recording
    #[arg(long, value_name = "HZ", default_value_t = 30.0)]
    rate: f64,
    /// Stored depth units per metre
    #[arg(long, value_name = "UNITS", default_value_t = 1000.0)]
    units_per_metre: f64,
    /// A folder of masks, one per image, not black where the moving object is
    #[arg(long, value_name = "DIR")]
    masks: Option<PathBuf>,
    #[command(flatten)]
    scan: ScanCutArgs,
    #[command(flatten)]
    pub(super) output: BagOutput,
}

pub(crate) fn import(args: &DepthArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    if !(args.rate.is_finite() && args.rate > 0.0) {
        return Err(Failure::unusable(format!("--rate {} is not a positive number", args.rate))
            .fix("give the images per second of the recording, for example --rate 30"));
    }
    let unit = DepthUnit::new(args.units_per_metre)?;
    let pictures = numbered_pictures(&args.folder)?;
    let masks = args.masks.as_deref().map(numbered_pictures).transpose()?;
    if let Some(masks) = &masks
        && masks.len() != pictures.len()
    {
        return Err(Failure::new(format!("{} images but {} masks", pictures.len(), masks.len()))
            .fix("there must be one mask for each picture, numbered alike"));
    }

    let mut bag = args.output.create()?;
    let mut cut = ScanCut::new(&args.scan);
    let progress = Progress::new("importing", pictures.len() as u64);
    for (index, picture) in pictures.iter().enumerate() {
        if interrupt.has_come() {
            break;
        }
        let stamp = FIRST_STAMP.plus_seconds(index as f64 / args.rate);
        let image = read_depth(picture, unit, stamp, DEPTH_FRAME)?;
        let size_px = (image.width_px(), image.height_px());
        let camera = camera_of(args.intrinsics, Distortion::None, size_px)?;
        bag.camera(&camera, stamp)?;
        bag.pose(&StampedPose {
            stamp,
            frame_id: MAP_FRAME.to_owned(),
            map_from_rig: Isometry3::identity(),
        })?;
        if let Some(scan) = cut.scan(&image, &camera)? {
            bag.scan(&scan)?;
        }
        bag.depth(&image)?;
        if let Some(mask) = masks.as_ref().and_then(|masks| masks.get(index)) {
            bag.labels(&labels_of(mask, stamp)?)?;
        }
        progress.advance();
    }
    let summary = bag.finish()?;
    progress.finish();
    print_summary(&args.output, &summary, interrupt, Outcome::Complete)
}

/// The camera of intrinsics for images of a size; a failure where they are not those of such images.
pub(super) fn camera_of(
    [fx_px, fy_px, cx_px, cy_px]: [f64; 4],
    distortion: Distortion,
    (width_px, height_px): (usize, usize),
) -> Result<CameraModel, Failure> {
    let k = [fx_px, 0.0, cx_px, 0.0, fy_px, cy_px, 0.0, 0.0, 1.0];
    let size_px = (width_px as u32, height_px as u32);
    if let Some(wrong) = wrong_calibration(&k, size_px) {
        return Err(Failure::new(format!(
            "the images have {width_px} x {height_px} pixels: {wrong}"
        ))
        .fix("give the --intrinsics of images of this size"));
    }
    Ok(CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion })
}

fn labels_of(mask: &Path, stamp: Stamp) -> Result<LabelImage, Failure> {
    let (size_px, ids) = read_mask(mask)?;
    LabelImage::new(stamp, DEPTH_FRAME.to_owned(), size_px, ids)
        .map_err(|error| Failure::new(format!("{}: {error}", mask.display())))
}

/// Four numbers between commas.
pub fn parse_intrinsics(text: &str) -> Result<[f64; 4], String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|number| number.trim().parse::<f64>().map_err(|error| format!("{number}: {error}")))
        .collect::<Result<_, _>>()?;
    let count = numbers.len();
    let numbers: [f64; 4] =
        numbers.try_into().map_err(|_| format!("four numbers fx,fy,cx,cy, not {count}"))?;
    let [fx_px, fy_px, ..] = numbers;
    if numbers.iter().all(|number| number.is_finite()) && fx_px > 0.0 && fy_px > 0.0 {
        Ok(numbers)
    } else {
        Err("the focal lengths must be positive and all four finite".to_owned())
    }
}
