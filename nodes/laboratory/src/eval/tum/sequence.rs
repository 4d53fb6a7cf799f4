//! A sequence's pairs of images, and where its camera was.

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
    /// The folder's name, without `rgbd_dataset_`; the bag's, without its ending.
    pub(super) name: String,
    source: Source,
    pub(super) truth: Trajectory,
}

#[derive(Debug)]
enum Source {
    Folder(Folder),
    Recording(Recording),
}

/// How images are put together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pairing {
    /// Images of a pair are no farther apart.
    pub(super) max_gap_s: f64,
    /// Only so many of the first pairs.
    pub(super) first: Option<usize>,
}

/// The images that belong together, by what tells where each is.
#[derive(Debug)]
struct Pairs<T> {
    pairs: Vec<Pair<T>>,
    /// Colour images without a depth image.
    alone: usize,
}

/// A colour image, and the depth image that was taken next to it.
#[derive(Clone, Debug)]
struct Pair<T> {
    /// The colour image's.
    stamp: Stamp,
    color: T,
    depth: T,
}

/// A pair of images as they were taken.
pub(super) struct Images {
    /// The colour image's.
    pub(super) stamp: Stamp,
    pub(super) camera: CameraModel,
    pub(super) color: ColorImage,
    pub(super) depth: DepthImage,
}

/// A colour image as it was taken.
pub(super) struct ColorImage {
    /// As `sensor_msgs/Image` names it.
    encoding: String,
    is_big_endian: bool,
    step_bytes: usize,
    size_px: (usize, usize),
    data: Vec<u8>,
}

impl Sequence {
    /// Reads which images there are, and the true poses; `truth` is the topic of these in a bag.
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

    /// Whether there is one.
    pub(super) fn is_at(path: &Path) -> bool {
        Folder::is_at(path) || Recording::is_at(path)
    }

    /// The sequence's name, by its folder's or file's.
    pub(super) fn name_of(path: &Path) -> String {
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let name = if path.is_dir() { path.file_name() } else { path.file_stem() };
        let name = name.unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        name.strip_prefix("rgbd_dataset_").map_or(name.clone(), str::to_owned)
    }

    /// How many pairs of images there are.
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

    /// The pairs of images, one after the other.
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
    /// As the extraction of features takes it.
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

/// As scores take poses.
pub(super) fn raw(pose: &Isometry3<f64>) -> RawPose {
    let position_m = pose.translation.vector.into();
    RawPose { position_m, quaternion_xyzw: pose.rotation.coords.into() }
}

/// Each colour image with the depth image nearest in time, of two equally near ones the earlier. The benchmark's own tool
/// gives each depth image away once only; where it matters, which it does not in the ten sequences, a colour image more is
/// followed here.
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
