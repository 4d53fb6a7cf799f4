//! A sequence in the benchmark's format: image files, named in lists.

use std::path::{Path, PathBuf};

use evaluation::trajectory::Trajectory;
use geometry::{DepthImage, DepthPixels};

use super::{ColorImage, Images, Pair, Pairing, Pairs, paired, raw};
use robot::Failure;
use robot::import::tum::{Calibration, UNITS_PER_METRE, pose_of, read_list};

/// The contents of a sequence's folder.
const LISTS: [&str; 3] = ["rgb.txt", "depth.txt", "groundtruth.txt"];

/// A folder with `rgb.txt`, `depth.txt` and `groundtruth.txt`.
#[derive(Debug)]
pub(in super::super) struct Folder {
    folder: PathBuf,
    calibration: Calibration,
    /// The images, by file.
    pub(super) pairs: Pairs<String>,
}

impl Folder {
    /// Whether a folder is a sequence.
    pub(super) fn is_at(folder: &Path) -> bool {
        LISTS.iter().all(|name| folder.join(name).is_file())
    }

    /// Reads the lists.
    pub(super) fn open(
        folder: &Path,
        intrinsics: Option<[f64; 4]>,
        pairing: Pairing,
    ) -> Result<(Self, Trajectory), Failure> {
        let [colors, depths, truth] = LISTS.map(|name| read_list(&folder.join(name)));
        let truth = truth?.into_iter().map(|(stamp, rest)| {
            let pose = pose_of(&rest).ok_or_else(|| {
                Failure::new(format!("groundtruth.txt: cannot read '{rest}'"))
                    .within(folder.display())
            })?;
            Ok((stamp, raw(&pose)))
        });
        let truth = Trajectory::stamped(truth.collect::<Result<Vec<_>, Failure>>()?);
        let pairs = paired(colors?, depths?, pairing);
        let calibration = Calibration::of(folder, intrinsics)?;
        Ok((Self { folder: folder.to_owned(), calibration, pairs }, truth))
    }

    /// The images of each pair.
    pub(super) fn images(&self) -> impl Iterator<Item = Result<Images, Failure>> + '_ {
        self.pairs.pairs.iter().map(|pair| self.of(pair))
    }

    fn of(&self, pair: &Pair<String>) -> Result<Images, Failure> {
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
        let color = ColorImage {
            encoding: "rgb8".to_owned(),
            is_big_endian: false,
            step_bytes: 3 * size_px.0,
            size_px,
            data: rgb.into_raw(),
        };
        Ok(Images { stamp: pair.stamp, camera: self.calibration.camera(size_px)?, color, depth })
    }
}
