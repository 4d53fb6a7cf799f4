//! A sequence's pairs of images, and where its camera was.

use std::path::{Path, PathBuf};

use evaluation::trajectory::{RawPose, Trajectory};
use geometry::{CameraModel, DepthImage, DepthPixels, Stamp};
use nalgebra::Isometry3;

use crate::failure::Failure;
use crate::import::tum::{Calibration, UNITS_PER_METRE, pose_of, read_list};

/// A folder with `rgb.txt`, `depth.txt` and `groundtruth.txt`.
#[derive(Debug)]
pub(super) struct Sequence {
    /// The folder's name, without `rgbd_dataset_`.
    pub(super) name: String,
    folder: PathBuf,
    calibration: Calibration,
    /// A colour image, and the depth image that was taken next to it.
    pub(super) pairs: Vec<Pair>,
    /// Colour images without a depth image.
    pub(super) alone: usize,
    pub(super) truth: Trajectory,
}

/// Files of images that belong together.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    /// The colour image's.
    pub(super) stamp: Stamp,
    color: String,
    depth: String,
}

/// A pair of images as they were taken.
pub(super) struct Images {
    pub(super) camera: CameraModel,
    /// Red, green and blue, row by row.
    pub(super) rgb: Vec<u8>,
    pub(super) depth: DepthImage,
}

impl Sequence {
    /// Whether a folder is one.
    pub(super) fn is_at(folder: &Path) -> bool {
        ["rgb.txt", "depth.txt", "groundtruth.txt"].iter().all(|name| folder.join(name).is_file())
    }

    /// The sequence's name, by its folder's.
    pub(super) fn name_of(folder: &Path) -> String {
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let name = folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy().into_owned();
        name.strip_prefix("rgbd_dataset_").map_or(name.clone(), str::to_owned)
    }

    /// Reads the lists.
    pub(super) fn open(
        folder: &Path,
        intrinsics: Option<[f64; 4]>,
        max_pair_gap_s: f64,
        first: Option<usize>,
    ) -> Result<Self, Failure> {
        let colors = read_list(&folder.join("rgb.txt"))?;
        let mut depths = read_list(&folder.join("depth.txt"))?;
        depths.sort_by_key(|(stamp, _)| *stamp);
        let truth = read_list(&folder.join("groundtruth.txt"))?;
        let truth = truth.into_iter().map(|(stamp, rest)| {
            let pose = pose_of(&rest).ok_or_else(|| {
                Failure::new(format!("groundtruth.txt: cannot read '{rest}'"))
                    .within(folder.display())
            })?;
            Ok((stamp, raw(&pose)))
        });
        let truth = Trajectory::stamped(truth.collect::<Result<Vec<_>, Failure>>()?);
        let count = colors.len();
        let mut pairs = paired(colors, &depths, max_pair_gap_s);
        let alone = count - pairs.len();
        if pairs.is_empty() {
            return Err(Failure::new("no colour image has a depth image".to_owned())
                .within(folder.display())
                .mend(format!("they must be within {max_pair_gap_s} s: --max-pair-gap")));
        }
        pairs.truncate(first.unwrap_or(usize::MAX));
        let calibration = Calibration::of(folder, intrinsics)?;
        let name = Self::name_of(folder);
        Ok(Self { name, folder: folder.to_owned(), calibration, pairs, alone, truth })
    }

    /// The images of a pair.
    pub(super) fn images(&self, pair: &Pair) -> Result<Images, Failure> {
        let open = |name: &str| {
            let path = self.folder.join(name);
            image::open(&path)
                .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))
        };
        let rgb = open(&pair.color)?.into_rgb8();
        let size_px = (rgb.width() as usize, rgb.height() as usize);
        let image::DynamicImage::ImageLuma16(depth) = open(&pair.depth)? else {
            return Err(Failure::new(format!("{} has no 16-bit depths", pair.depth)));
        };
        let depth_size_px = (depth.width() as usize, depth.height() as usize);
        let metres = depth.iter().map(|units| match *units {
            0 => f32::NAN,
            units => (f64::from(units) / UNITS_PER_METRE) as f32,
        });
        let pixels = DepthPixels::Metres(metres.collect());
        let depth = DepthImage::new(pair.stamp, "camera".to_owned(), depth_size_px, pixels)
            .map_err(|error| Failure::new(error.to_string()).within(&pair.depth))?;
        Ok(Images { camera: self.calibration.camera(size_px), rgb: rgb.into_raw(), depth })
    }
}

/// As scores take poses.
pub(super) fn raw(pose: &Isometry3<f64>) -> RawPose {
    let position_m = pose.translation.vector.into();
    RawPose { position_m, quaternion_xyzw: pose.rotation.coords.into() }
}

/// Each colour image with the depth image nearest in time, of two equally near ones the earlier. The benchmark's own tool
/// gives each depth image away once only; where it matters, which it does not in the ten sequences, a colour image more is
/// followed here.
fn paired(
    mut colors: Vec<(Stamp, String)>,
    depths: &[(Stamp, String)],
    max_gap_s: f64,
) -> Vec<Pair> {
    colors.sort_by_key(|(stamp, _)| *stamp);
    let pair = |(stamp, color): (Stamp, String)| {
        let after = depths.partition_point(|(of, _)| *of < stamp);
        let near = [after.checked_sub(1), Some(after)].into_iter().flatten();
        let gap_s = |of: &Stamp| stamp.seconds_since(*of).abs();
        let nearest = near
            .filter_map(|index| depths.get(index))
            .min_by(|(one, _), (other, _)| gap_s(one).total_cmp(&gap_s(other)))?;
        let (of, depth) = nearest;
        (gap_s(of) <= max_gap_s).then(|| Pair { stamp, color, depth: depth.clone() })
    };
    colors.into_iter().filter_map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_goes_with_the_depths_nearest_to_it_if_they_are_near() {
        let list = |stamps_s: &[f64]| -> Vec<(Stamp, String)> {
            let at = |second: &f64| Stamp::from_nanos(0).plus_seconds(*second);
            stamps_s.iter().map(|second| (at(second), second.to_string())).collect()
        };
        let pairs = paired(list(&[0.0, 1.0, 2.0, 3.0]), &list(&[0.01, 1.97, 2.01, 2.9]), 0.02);
        let names: Vec<_> = pairs.iter().map(|pair| (&*pair.color, &*pair.depth)).collect();
        assert_eq!(names, [("0", "0.01"), ("2", "2.01")]);
    }
}
