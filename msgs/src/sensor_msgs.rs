//! `sensor_msgs`: what drivers publish.

use serde::{Deserialize, Serialize};

use crate::geometry_msgs::{Quaternion, Vector3};
use crate::std_msgs::Header;

/// One turn of a planar laser scanner (REP-138).
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct LaserScan {
    /// Stamp of the first ray; angles are measured about the frame's z axis, from x towards y.
    pub header: Header,
    /// Angle of the first ray in radians.
    pub angle_min: f32,
    /// Angle of the last ray in radians.
    pub angle_max: f32,
    /// Angle from a ray to the next in radians.
    pub angle_increment: f32,
    /// Time from a ray to the next in seconds.
    pub time_increment: f32,
    /// Time from a scan to the next in seconds.
    pub scan_time: f32,
    /// Shorter ranges are no measurements; metres.
    pub range_min: f32,
    /// Longer ranges are no measurements; metres.
    pub range_max: f32,
    /// Ranges in metres; `+Inf` too far, `-Inf` too near, NaN not measured (REP-117).
    pub ranges: Vec<f32>,
    /// Intensities in the device's own unit, or empty.
    pub intensities: Vec<f32>,
}
ros_message!(LaserScan, "sensor_msgs");

/// One field of the points of a [`PointCloud2`].
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct PointField {
    /// Name of the field: `x`, `y` and `z` are the coordinates in metres.
    pub name: String,
    /// Bytes from the start of the point to the field.
    pub offset: u32,
    /// One of the datatypes, for instance [`PointField::FLOAT32`].
    pub datatype: u8,
    /// Elements in the field.
    pub count: u32,
}
ros_message!(PointField, "sensor_msgs", {
    /// Signed, 8 bits.
    INT8: u8 = 1,
    /// Unsigned, 8 bits.
    UINT8: u8 = 2,
    /// Signed, 16 bits.
    INT16: u8 = 3,
    /// Unsigned, 16 bits.
    UINT16: u8 = 4,
    /// Signed, 32 bits.
    INT32: u8 = 5,
    /// Unsigned, 32 bits.
    UINT32: u8 = 6,
    /// IEEE 754, 32 bits.
    FLOAT32: u8 = 7,
    /// IEEE 754, 64 bits.
    FLOAT64: u8 = 8,
});

/// A cloud of points, as rows of records whose layout the message itself describes.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct PointCloud2 {
    /// Stamp and frame of the points.
    pub header: Header,
    /// Rows; 1 for a cloud without order.
    pub height: u32,
    /// Points in a row.
    pub width: u32,
    /// The fields of a point.
    pub fields: Vec<PointField>,
    /// Whether the data is big endian.
    pub is_bigendian: bool,
    /// Bytes of a point.
    pub point_step: u32,
    /// Bytes of a row.
    pub row_step: u32,
    /// The points: `row_step * height` bytes.
    #[serde(with = "serde_bytes")]
    pub data: Vec<u8>,
    /// Whether every point is valid.
    pub is_dense: bool,
}
ros_message!(PointCloud2, "sensor_msgs");

/// An uncompressed image.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Image {
    /// Stamp of the exposure; the frame is the camera's optical one.
    pub header: Header,
    /// Rows.
    pub height: u32,
    /// Columns.
    pub width: u32,
    /// Channels and depth of the pixels: `rgb8`, `mono16`, `16UC1`, `32FC1`, ...
    pub encoding: String,
    /// Whether the pixels are big endian: 0 or 1.
    pub is_bigendian: u8,
    /// Bytes of a row.
    pub step: u32,
    /// The pixels: `step * height` bytes.
    #[serde(with = "serde_bytes")]
    pub data: Vec<u8>,
}
ros_message!(Image, "sensor_msgs");

/// A compressed image.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct CompressedImage {
    /// As in [`Image`].
    pub header: Header,
    /// The compression: `jpeg`, `png`, ...
    pub format: String,
    /// The compressed file.
    #[serde(with = "serde_bytes")]
    pub data: Vec<u8>,
}
ros_message!(CompressedImage, "sensor_msgs");

/// A part of an image.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct RegionOfInterest {
    /// First column in pixels.
    pub x_offset: u32,
    /// First row in pixels.
    pub y_offset: u32,
    /// Rows; 0 in a [`CameraInfo`] means the whole image.
    pub height: u32,
    /// Columns; 0 in a [`CameraInfo`] means the whole image.
    pub width: u32,
    /// Whether the part is to be rectified as the whole image would be.
    pub do_rectify: bool,
}
ros_message!(RegionOfInterest, "sensor_msgs");

/// The calibration of a camera.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct CameraInfo {
    /// Stamp and frame of the image that it belongs to.
    pub header: Header,
    /// Rows of the sensor as calibrated.
    pub height: u32,
    /// Columns of the sensor as calibrated.
    pub width: u32,
    /// Name of the distortion model.
    pub distortion_model: String,
    /// Coefficients of the distortion.
    pub d: Vec<f64>,
    /// Intrinsic matrix of the raw image by rows, in pixels; all zero when uncalibrated.
    pub k: [f64; 9],
    /// Rotation that rectifies, by rows.
    pub r: [f64; 9],
    /// Projection matrix of the rectified image by rows, in pixels.
    pub p: [f64; 12],
    /// Columns that were joined to one; 0 and 1 both mean none.
    pub binning_x: u32,
    /// Rows that were joined to one; 0 and 1 both mean none.
    pub binning_y: u32,
    /// The part of the sensor that is sent, before binning.
    pub roi: RegionOfInterest,
}
ros_message!(CameraInfo, "sensor_msgs");

/// A measurement of an inertial unit. Covariances are 3 x 3 matrices by rows; -1 in the first element
/// says that the quantity is not measured.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Imu {
    /// Stamp and frame of the measurement.
    pub header: Header,
    /// Orientation of the frame.
    pub orientation: Quaternion,
    /// Its covariance in rad^2.
    pub orientation_covariance: [f64; 9],
    /// Angular velocity in rad/s.
    pub angular_velocity: Vector3,
    /// Its covariance in rad^2/s^2.
    pub angular_velocity_covariance: [f64; 9],
    /// Acceleration in m/s^2, gravity included.
    pub linear_acceleration: Vector3,
    /// Its covariance in m^2/s^4.
    pub linear_acceleration_covariance: [f64; 9],
}
ros_message!(Imu, "sensor_msgs");
