//! Clouds.

pub(super) mod layout;
#[cfg(test)]
mod tests;

use geometry::{Cloud, OrganisedCloud};
use nalgebra::Point3;

use super::rows::Rows;
use super::{ConvertError, stamp_from_time, time_from_stamp};
use crate::sensor_msgs::{PointCloud2, PointField};
use crate::std_msgs::Header;
use layout::Layout;

/// The cloud of a message: its points in the message's order, without those that have a coordinate
/// that is not finite. Other fields than x, y and z are not looked at, nor is `is_dense`.
///
/// Coordinates of every datatype are metres. A cloud of zero points is empty whatever its fields say.
///
/// # Errors
/// When x, y or z is missing, repeated, of unknown datatype, of several elements or not within the
/// point; when rows overlap or the data is shorter than they are.
pub fn cloud_from_message(message: &PointCloud2) -> Result<Cloud, ConvertError> {
    let mut points_m = Vec::new();
    if message.width > 0 && message.height > 0 {
        let layout = Layout::of(message)?;
        let rows = Rows::checked(&message.data, &message.into())?;
        // No more than 12 bytes for each byte of the data: the points do not overlap.
        points_m.reserve_exact(rows.records());
        layout.append_finite_points(&rows, &mut points_m);
    }
    Ok(Cloud {
        stamp: stamp_from_time(message.header.stamp),
        frame_id: message.header.frame_id.clone(),
        points_m,
    })
}

/// The cloud of a message with the pixel of each point: `width` and `height` are those of the camera's image.
///
/// # Errors
/// As [`cloud_from_message`].
pub fn organised_cloud_from_message(message: &PointCloud2) -> Result<OrganisedCloud, ConvertError> {
    let points_m = organised_points_from_message(message)?;
    let stamp = stamp_from_time(message.header.stamp);
    let frame_id = message.header.frame_id.clone();
    Ok(OrganisedCloud::from_rows(stamp, frame_id, message.width as usize, &points_m))
}

/// All points of a message, those included that are not finite.
pub(super) fn organised_points_from_message(
    message: &PointCloud2,
) -> Result<Vec<Point3<f32>>, ConvertError> {
    let mut points_m: Vec<Point3<f32>> = Vec::new();
    if message.width > 0 && message.height > 0 {
        let layout = Layout::of(message)?;
        let rows = Rows::checked(&message.data, &message.into())?;
        points_m.reserve_exact(rows.records());
        layout.append_points(&rows, &mut points_m);
    }
    Ok(points_m)
}

/// Bytes of a coordinate that this crate writes.
const COORDINATE_BYTES: u32 = size_of::<f32>() as u32;

/// The message of a cloud: one row of x, y, z as little-endian 32-bit floats, 12 bytes a point.
#[must_use]
pub fn message_from_cloud(cloud: &Cloud) -> PointCloud2 {
    let field = |index: u32, name: &str| PointField {
        name: name.to_owned(),
        offset: index * COORDINATE_BYTES,
        datatype: PointField::FLOAT32,
        count: 1,
    };
    let width = u32::try_from(cloud.points_m.len()).unwrap_or(u32::MAX);
    let point_step = 3 * COORDINATE_BYTES;
    let mut data = Vec::with_capacity(cloud.points_m.len() * point_step as usize);
    for point in &cloud.points_m {
        let [x, y, z] = point.coords.into();
        let (x, y, z): ([u8; 4], [u8; 4], [u8; 4]) =
            (f32::to_le_bytes(x), f32::to_le_bytes(y), f32::to_le_bytes(z));
        data.extend_from_slice(&[
            x[0], x[1], x[2], x[3], y[0], y[1], y[2], y[3], z[0], z[1], z[2], z[3],
        ]);
    }
    PointCloud2 {
        header: Header { stamp: time_from_stamp(cloud.stamp), frame_id: cloud.frame_id.clone() },
        height: 1,
        width,
        fields: vec![field(0, "x"), field(1, "y"), field(2, "z")],
        is_bigendian: false,
        point_step,
        row_step: width.saturating_mul(point_step),
        data,
        is_dense: true,
    }
}
