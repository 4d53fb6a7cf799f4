//! Calibrations.

#[cfg(test)]
mod tests;

use std::borrow::Cow;

use geometry::{CameraModel, Distortion, Stamp};

use super::pose::header_of;
use super::{COMPRESSED_DEPTH_TOPIC, COMPRESSED_IMAGE_TOPIC, ConvertError};
use crate::sensor_msgs::{CameraInfo, RegionOfInterest};

/// Names of the distortion models (`sensor_msgs/distortion_models.hpp`).
const PLUMB_BOB: &str = "plumb_bob";
const RATIONAL: &str = "rational_polynomial";
const EQUIDISTANT: &str = "equidistant";

/// The camera that took the raw image: `k` and `d`, with the sensor's region of interest and binning
/// taken into account as image_geometry does.
///
/// `r` and `p` are not used: they belong to the image that a rectifier makes of the raw one, see
/// [`calibration_of_image`].
///
/// The lens is [`Distortion::of_model`].
///
/// # Errors
/// When the camera is not calibrated, its matrix is not that of a pinhole camera, the model is not
/// supported or has other coefficients, the region is not within the sensor, or a number is not finite.
pub fn camera_from_message(message: &CameraInfo) -> Result<CameraModel, ConvertError> {
    if message.k.iter().all(|element| *element == 0.0) {
        return Err(ConvertError::Uncalibrated);
    }
    let [fx, skew, cx, zero_3, fy, cy, zero_6, zero_7, one_8] = message.k;
    let fixed =
        [(1, skew, 0.0), (3, zero_3, 0.0), (6, zero_6, 0.0), (7, zero_7, 0.0), (8, one_8, 1.0)];
    for (index, value, expected) in fixed {
        if value != expected {
            return Err(ConvertError::IntrinsicMatrix { index, value, expected });
        }
    }
    let region = region(message)?;
    let joined_columns = f64::from(message.binning_x.max(1));
    let joined_rows = f64::from(message.binning_y.max(1));
    let model = CameraModel {
        width_px: (region.width / message.binning_x.max(1)) as usize,
        height_px: (region.height / message.binning_y.max(1)) as usize,
        fx_px: fx / joined_columns,
        fy_px: fy / joined_rows,
        cx_px: (cx - f64::from(region.x_offset)) / joined_columns,
        cy_px: (cy - f64::from(region.y_offset)) / joined_rows,
        distortion: Distortion::of_model(&message.distortion_model, &message.d)?,
    };
    model.validate().map_err(ConvertError::Camera)?;
    Ok(model)
}

/// The camera of the images on `image_topic`, see [`calibration_of_image`].
///
/// # Errors
/// As [`camera_from_message`]; an element of `p` is named by its place in the matrix that replaces `k`.
pub fn camera_of_image(
    message: &CameraInfo,
    image_topic: &str,
) -> Result<CameraModel, ConvertError> {
    camera_from_message(&calibration_of_image(message, image_topic))
}

/// The calibration with the camera of the images on `image_topic` as `k` and `d`: that of the raw image as it is, that of a rectified
/// one ([`is_rectified`]) with the left 3 x 3 part of `p` as `k`, the identity as `r` and no distortion.
///
/// `sensor_msgs/msg/CameraInfo` describes both images: `k` and `d` the raw one, `p` and `r` the rectified one. A `p` without focal
/// lengths is not set, and then `k` and `d` are taken. The fourth column of `p` is where the first camera of a stereo pair is, and
/// no part of the camera.
#[must_use]
pub fn calibration_of_image<'a>(message: &'a CameraInfo, image_topic: &str) -> Cow<'a, CameraInfo> {
    let [fx, skew, cx, _, zero_4, fy, cy, _, zero_8, zero_9, one_10, _] = message.p;
    if !is_rectified(image_topic) || fx == 0.0 || fy == 0.0 {
        return Cow::Borrowed(message);
    }
    Cow::Owned(CameraInfo {
        distortion_model: PLUMB_BOB.to_owned(),
        d: vec![0.0; 5],
        k: [fx, skew, cx, zero_4, fy, cy, zero_8, zero_9, one_10],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        ..message.clone()
    })
}

/// Whether the images on a topic are rectified, which their messages do not say: by the names of `image_proc`, `image_rect`,
/// `image_rect_color` and the like, a word of the last part is `rect`. Compressed images have the name of the raw ones and below it
/// that of their transport.
#[must_use]
pub fn is_rectified(image_topic: &str) -> bool {
    let mut parts = image_topic.rsplit('/');
    let is_transport =
        |part: &&str| [COMPRESSED_DEPTH_TOPIC, COMPRESSED_IMAGE_TOPIC].contains(part);
    let name = parts.find(|part| !is_transport(part)).unwrap_or_default();
    name.split('_').any(|word| word == "rect" || word == "rectified")
}

/// The part of the sensor that is sent; a region without size is the whole sensor.
fn region(message: &CameraInfo) -> Result<RegionOfInterest, ConvertError> {
    let (sensor_width, sensor_height) = (message.width, message.height);
    let RegionOfInterest { x_offset, y_offset, width, height, .. } = message.roi;
    if (width, height) == (0, 0) {
        let (width, height) = (sensor_width, sensor_height);
        return Ok(RegionOfInterest { width, height, ..RegionOfInterest::default() });
    }
    let within = |offset: u32, size: u32, sensor: u32| {
        size > 0 && u64::from(offset) + u64::from(size) <= u64::from(sensor)
    };
    if within(x_offset, width, sensor_width) && within(y_offset, height, sensor_height) {
        return Ok(message.roi.clone());
    }
    Err(ConvertError::RegionOutside {
        x_offset,
        y_offset,
        width,
        height,
        sensor_width,
        sensor_height,
    })
}

/// The message of a camera. Without distortion it is a `plumb_bob` of zeros, as drivers send it; `p`
/// is the matrix of the image once the distortion is taken out.
#[must_use]
pub fn message_from_camera(model: &CameraModel, stamp: Stamp, frame_id: &str) -> CameraInfo {
    let CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion } = *model;
    let (distortion_model, d) = match distortion {
        Distortion::None => (PLUMB_BOB, vec![0.0; 5]),
        Distortion::PlumbBob(coefficients) => (PLUMB_BOB, coefficients.to_vec()),
        Distortion::Rational(coefficients) => (RATIONAL, coefficients.to_vec()),
        Distortion::RationalPrism(coefficients) => (RATIONAL, coefficients.to_vec()),
        Distortion::Equidistant(coefficients) => (EQUIDISTANT, coefficients.to_vec()),
    };
    CameraInfo {
        header: header_of(stamp, frame_id),
        height: u32::try_from(height_px).unwrap_or(u32::MAX),
        width: u32::try_from(width_px).unwrap_or(u32::MAX),
        distortion_model: distortion_model.to_owned(),
        d,
        k: [fx_px, 0.0, cx_px, 0.0, fy_px, cy_px, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [fx_px, 0.0, cx_px, 0.0, 0.0, fy_px, cy_px, 0.0, 0.0, 0.0, 1.0, 0.0],
        binning_x: 0,
        binning_y: 0,
        roi: RegionOfInterest::default(),
    }
}
