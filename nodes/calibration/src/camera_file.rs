//! The calibration of a camera as ROS writes it to a file: the YAML of `camera_calibration` (`ost.yaml`) and of
//! `camera_info_manager`.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

use geometry::{CameraModel, CameraModelError, Distortion, DistortionError};
use serde::Deserialize;

/// A camera's calibration file.
#[derive(Clone, PartialEq, Debug)]
pub struct CameraFile {
    /// The camera's name, where the file has one.
    pub name: Option<String>,
    /// The camera that takes the raw image: matrix and distortion.
    pub camera: CameraModel,
    /// The camera of the image once the distortion is taken out (the projection matrix), where the file has it.
    pub rectified: Option<CameraModel>,
}

/// A text that is no calibration of a pinhole camera.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum CameraFileError {
    /// It is not YAML, or lacks a key; with line and column.
    #[error("{0}")]
    Unreadable(String),
    /// A matrix has another shape than it says, or than it must have.
    #[error("{key} has {rows} x {cols} = {} numbers stated and {count} given; it must have {accepted}", rows * cols)]
    Shape {
        /// The matrix.
        key: &'static str,
        /// The stated rows.
        rows: usize,
        /// The stated columns.
        cols: usize,
        /// The numbers given.
        count: usize,
        /// How many it must have.
        accepted: &'static str,
    },
    /// An element of the matrix is not that of a pinhole camera.
    #[error("{key}: element {index} is {value}, and {expected} is expected of a pinhole camera")]
    Element {
        /// The matrix.
        key: &'static str,
        /// Counted row by row from 0.
        index: usize,
        /// What it is.
        value: f64,
        /// What it must be.
        expected: f64,
    },
    /// The lens is not known.
    #[error("distortion_coefficients: {0}")]
    Distortion(#[from] DistortionError),
    /// The numbers describe no camera.
    #[error(transparent)]
    Camera(#[from] CameraModelError),
}

/// The file as it is written. Keys that are not known are let be: other programs write more.
#[derive(Deserialize)]
struct Written {
    image_width: usize,
    image_height: usize,
    #[serde(default)]
    camera_name: Option<String>,
    camera_matrix: WrittenMatrix,
    #[serde(default)]
    distortion_model: Option<String>,
    distortion_coefficients: WrittenMatrix,
    #[serde(default)]
    projection_matrix: Option<WrittenMatrix>,
}

#[derive(Deserialize)]
struct WrittenMatrix {
    rows: usize,
    cols: usize,
    data: Vec<f64>,
}

impl WrittenMatrix {
    /// The numbers, if there are as many as stated and as `accepted`.
    fn numbers<const N: usize>(
        &self,
        key: &'static str,
        accepted: &'static str,
    ) -> Result<[f64; N], CameraFileError> {
        let wrong = || self.shape_error(key, accepted);
        if !self.is_as_stated() {
            return Err(wrong());
        }
        self.data.as_slice().try_into().map_err(|_| wrong())
    }

    fn is_as_stated(&self) -> bool {
        self.rows.checked_mul(self.cols) == Some(self.data.len())
    }

    fn shape_error(&self, key: &'static str, accepted: &'static str) -> CameraFileError {
        let (rows, cols) = (self.rows.min(u16::MAX.into()), self.cols.min(u16::MAX.into()));
        CameraFileError::Shape { key, rows, cols, count: self.data.len(), accepted }
    }
}

/// Reads a camera's calibration from YAML.
///
/// `camera_matrix` and `distortion_coefficients` are those of the raw image, as [`geometry::RayTable`] takes them;
/// `rectification_matrix` and `projection_matrix` belong to the rectified one.
///
/// # Errors
/// When the text is not YAML, lacks a key, or describes none of the supported cameras.
pub fn camera_from_yaml(text: &str) -> Result<CameraFile, CameraFileError> {
    let written: Written = serde_saphyr::from_str(text)
        .map_err(|error| CameraFileError::Unreadable(error.without_snippet().to_string()))?;
    let matrix = written.camera_matrix.numbers::<9>("camera_matrix", "3 x 3")?;
    let [fx_px, _, cx_px, _, fy_px, cy_px, ..] = matrix;
    let zeros_and_one = [(1, 0.0), (3, 0.0), (6, 0.0), (7, 0.0), (8, 1.0)];
    check_elements("camera_matrix", &matrix, &zeros_and_one)?;
    let camera = CameraModel {
        width_px: written.image_width,
        height_px: written.image_height,
        fx_px,
        fy_px,
        cx_px,
        cy_px,
        distortion: distortion(&written)?,
    };
    camera.validate()?;
    let rectified = match &written.projection_matrix {
        None => None,
        Some(matrix) => Some(rectified(matrix, &camera)?),
    };
    Ok(CameraFile { name: written.camera_name, camera, rectified })
}

fn check_elements(
    key: &'static str,
    elements: &[f64],
    expected: &[(usize, f64)],
) -> Result<(), CameraFileError> {
    for &(index, expected) in expected {
        let value = elements.get(index).copied().unwrap_or(f64::NAN);
        if value != expected {
            return Err(CameraFileError::Element { key, index, value, expected });
        }
    }
    Ok(())
}

fn distortion(written: &Written) -> Result<Distortion, CameraFileError> {
    const KEY: &str = "distortion_coefficients";
    let matrix = &written.distortion_coefficients;
    if !matrix.is_as_stated() {
        return Err(matrix.shape_error(KEY, "4, 5, 8 or 12"));
    }
    // Files of 2009 name no model.
    let model = written.distortion_model.as_deref().unwrap_or("plumb_bob");
    Ok(Distortion::of_model(model, &matrix.data)?)
}

/// The camera of the rectified image.
fn rectified(matrix: &WrittenMatrix, raw: &CameraModel) -> Result<CameraModel, CameraFileError> {
    const KEY: &str = "projection_matrix";
    let elements = matrix.numbers::<12>(KEY, "3 x 4")?;
    let [fx_px, _, cx_px, _, _, fy_px, cy_px, ..] = elements;
    // The fourth column is the baseline of a stereo camera and not the lens' business.
    check_elements(KEY, &elements, &[(1, 0.0), (4, 0.0), (8, 0.0), (9, 0.0), (10, 1.0)])?;
    let camera = CameraModel { fx_px, fy_px, cx_px, cy_px, distortion: Distortion::None, ..*raw };
    camera.validate()?;
    Ok(camera)
}

#[cfg(test)]
mod tests;
