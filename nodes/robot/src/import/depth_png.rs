//! 16-bit depth images in PNG files.

use std::path::{Path, PathBuf};

use geometry::{DepthImage, DepthPixels, Stamp};

use crate::failure::Failure;

/// The unit of stored depths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthUnit {
    per_metre: f64,
}

impl DepthUnit {
    /// Stored units per metre: 1000 for millimetres, 5000 for the TUM RGB-D data sets.
    pub(crate) fn new(per_metre: f64) -> Result<Self, Failure> {
        if per_metre.is_finite() && per_metre > 0.0 {
            Ok(Self { per_metre })
        } else {
            Err(Failure::new(format!("{per_metre} depth units in a metre are not valid"))
                .fix("most depth cameras store millimetres: 1000 units; the TUM sets 5000"))
        }
    }
}

/// Reads a 16-bit greyscale image as a depth image, rounded to the nearest millimetre.
pub(crate) fn read_depth(
    path: &Path,
    unit: DepthUnit,
    stamp: Stamp,
    frame_id: &str,
) -> Result<DepthImage, Failure> {
    let picture = open(path)?;
    let image::DynamicImage::ImageLuma16(picture) = picture else {
        return Err(Failure::new(format!("{} is not a 16-bit greyscale image", path.display()))
            .fix("depth images hold one 16-bit number per pixel, 0 for no measurement"));
    };
    let (width_px, height_px) = (picture.width() as usize, picture.height() as usize);
    let pixels = millimetres(picture.into_raw(), unit);
    DepthImage::new(stamp, frame_id.to_owned(), (width_px, height_px), pixels)
        .map_err(|error| Failure::new(format!("{}: {error}", path.display())))
}

/// Reads the mask of an object: 1 where the image is not black.
pub(crate) fn read_mask(path: &Path) -> Result<((usize, usize), Vec<u16>), Failure> {
    let picture = open(path)?.into_luma16();
    let size_px = (picture.width() as usize, picture.height() as usize);
    Ok((size_px, picture.into_raw().into_iter().map(|value| u16::from(value > 0)).collect()))
}

/// The PNG files of a folder, or of its `depth` folder, in the order of the numbers in their names.
pub(crate) fn numbered_pictures(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let inner = folder.join("depth");
    let folder = if inner.is_dir() { &inner } else { folder };
    let entries = std::fs::read_dir(folder)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", folder.display())))?;
    let mut pictures = Vec::new();
    for entry in entries {
        let path = entry
            .map_err(|error| Failure::new(format!("cannot read {}: {error}", folder.display())))?
            .path();
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let is_png =
            path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
        if let (true, Ok(number)) = (is_png, stem.parse::<f64>()) {
            pictures.push((number, path));
        }
    }
    pictures.sort_by(|(a, path_a), (b, path_b)| a.total_cmp(b).then_with(|| path_a.cmp(path_b)));
    if pictures.is_empty() {
        return Err(Failure::new(format!("{} holds no numbered PNG files", folder.display()))
            .fix("give the folder that holds 0001.png, 0002.png, ..."));
    }
    Ok(pictures.into_iter().map(|(_, path)| path).collect())
}

fn open(path: &Path) -> Result<image::DynamicImage, Failure> {
    image::open(path).map_err(|error| Failure::new(format!("{}: {error}", path.display())))
}

fn millimetres(stored: Vec<u16>, unit: DepthUnit) -> DepthPixels {
    let millimetres_per_unit = 1000.0 / unit.per_metre;
    DepthPixels::Millimetres(
        stored
            .into_iter()
            .map(|value| (f64::from(value) * millimetres_per_unit).round() as u16)
            .collect(),
    )
}
