//! The image pairs of a sequence, and its ground-truth poses.

mod folder;
mod recording;

use std::path::Path;

use evaluation::trajectory::{RawPose, Trajectory};
use geometry::{CameraModel, DepthImage, Stamp};
use nalgebra::Isometry3;
use pose::image::RawImage;

pub(super) use folder::Folder;
pub(super) use recording::Recording;
use robot::Failure;

/// A folder with `rgb.txt`, `depth.txt` and `groundtruth.txt`, or a bag.
#[derive(Debug)]
pub(super) struct Sequence {
    /// The folder's name without `rgbd_dataset_`, or the bag's name without its extension.
    pub(super) name: String,
    source: Source,
    pub(super) truth: Trajectory,
}

#[derive(Debug)]
enum Source {
    Folder(Folder),
    Recording(Recording),
}

/// The rules for image pairs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pairing {
    /// The largest time difference of the images of a pair.
    pub(super) max_gap_s: f64,
    /// The maximum number of pairs, from the start.
    pub(super) first: Option<usize>,
}

/// The matched images, each by its location (file or stamp).
#[derive(Debug)]
struct Pairs<T> {
    pairs: Vec<Pair<T>>,
    /// Colour images without a depth image.
    alone: usize,
}

/// A colour image, and the depth image nearest in time.
#[derive(Clone, Debug)]
struct Pair<T> {
    /// The stamp of the colour image.
    stamp: Stamp,
    color: T,
    depth: T,
}

/// A pair of images.
pub(super) struct Images {
    /// The stamp of the colour image.
    pub(super) stamp: Stamp,
    pub(super) camera: CameraModel,
    pub(super) color: ColorImage,
    pub(super) depth: DepthImage,
}

/// A colour image.
pub(super) struct ColorImage {
    /// The encoding, as in `sensor_msgs/Image`.
    encoding: String,
    is_big_endian: bool,
    step_bytes: usize,
    size_px: (usize, usize),
    data: Vec<u8>,
}

impl Sequence {
    /// Reads the list of images, and the ground-truth poses; `truth` is the topic of these in a bag.
    pub(super) fn open(
        path: &Path,
        intrinsics: Option<[f64; 4]>,
        truth: Option<&str>,
        pairing: Pairing,
    ) -> Result<Self, Failure> {
        let name = Self::name_of(path);
        let (source, truth) = if Folder::is_at(path) {
            let (folder, truth) = Folder::open(path, intrinsics, pairing)?;
            (Source::Folder(folder), truth)
        } else {
            let (recording, truth) = Recording::open(path, truth, pairing)?;
            (Source::Recording(recording), truth)
        };
        let sequence = Self { name, source, truth };
        if sequence.pairs() == 0 {
            let max_gap_s = pairing.max_gap_s;
            return Err(Failure::new("no colour image has a depth image".to_owned())
                .within(path.display())
                .fix(format!("they must be within {max_gap_s} s: --max-pair-gap")));
        }
        Ok(sequence)
    }

    /// Whether a path is a sequence.
    pub(super) fn is_at(path: &Path) -> bool {
        Folder::is_at(path) || Recording::is_at(path)
    }

    /// The sequence's name, from that of its folder or file.
    pub(super) fn name_of(path: &Path) -> String {
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let name = if path.is_dir() { path.file_name() } else { path.file_stem() };
        let name = name.unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        name.strip_prefix("rgbd_dataset_").map_or(name.clone(), str::to_owned)
    }

    /// The number of image pairs.
    pub(super) fn pairs(&self) -> usize {
        match &self.source {
            Source::Folder(folder) => folder.pairs.pairs.len(),
            Source::Recording(recording) => recording.pairs.pairs.len(),
        }
    }

    /// Whether it is a bag.
    pub(super) fn is_bag(&self) -> bool {
        matches!(self.source, Source::Recording(_))
    }

    /// Colour images without a depth image.
    pub(super) fn alone(&self) -> usize {
        match &self.source {
            Source::Folder(folder) => folder.pairs.alone,
            Source::Recording(recording) => recording.pairs.alone,
        }
    }

    /// The image pairs in their order.
    pub(super) fn images(
        &self,
    ) -> Result<Box<dyn Iterator<Item = Result<Images, Failure>> + '_>, Failure> {
        Ok(match &self.source {
            Source::Folder(folder) => Box::new(folder.images()),
            Source::Recording(recording) => Box::new(recording.images()?),
        })
    }
}

impl ColorImage {
    /// The image in the form for the feature extraction.
    pub(super) fn raw(&self) -> Result<RawImage<'_>, Failure> {
        let (width_px, height_px) = self.size_px;
        let unknown = |error: pose::image::UnknownEncoding| Failure::new(error.to_string());
        Ok(RawImage {
            width_px,
            height_px,
            encoding: self.encoding.parse().map_err(unknown)?,
            is_big_endian: self.is_big_endian,
            step_bytes: self.step_bytes,
            data: &self.data,
        })
    }
}

/// The poses in the form for the score.
pub(super) fn raw(pose: &Isometry3<f64>) -> RawPose {
    let position_m = pose.translation.vector.into();
    RawPose { position_m, quaternion_xyzw: pose.rotation.coords.into() }
}

/// Each colour image with the depth image nearest in time, of two equally near ones the earlier. The benchmark's own tool
/// uses each depth image only once; where that makes a difference, which it does not in the ten sequences, there are more
/// pairs here.
fn paired<T: Clone>(
    mut colors: Vec<(Stamp, T)>,
    mut depths: Vec<(Stamp, T)>,
    pairing: Pairing,
) -> Pairs<T> {
    colors.sort_by_key(|(stamp, _)| *stamp);
    depths.sort_by_key(|(stamp, _)| *stamp);
    let count = colors.len();
    let pair = |(stamp, color): (Stamp, T)| {
        let after = depths.partition_point(|(of, _)| *of < stamp);
        let near = [after.checked_sub(1), Some(after)].into_iter().flatten();
        let gap_s = |of: &Stamp| stamp.seconds_since(*of).abs();
        let nearest = near
            .filter_map(|index| depths.get(index))
            .min_by(|(one, _), (other, _)| gap_s(one).total_cmp(&gap_s(other)))?;
        let (of, depth) = nearest;
        (gap_s(of) <= pairing.max_gap_s).then(|| Pair { stamp, color, depth: depth.clone() })
    };
    let mut pairs: Vec<Pair<T>> = colors.into_iter().filter_map(pair).collect();
    let alone = count - pairs.len();
    pairs.truncate(pairing.first.unwrap_or(usize::MAX));
    Pairs { pairs, alone }
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
        let pairing = Pairing { max_gap_s: 0.02, first: None };
        let pairs = paired(list(&[0.0, 1.0, 2.0, 3.0]), list(&[0.01, 1.97, 2.01, 2.9]), pairing);
        assert_eq!(pairs.alone, 2);
        let names: Vec<_> = pairs.pairs.iter().map(|pair| (&*pair.color, &*pair.depth)).collect();
        assert_eq!(names, [("0", "0.01"), ("2", "2.01")]);
    }
}
