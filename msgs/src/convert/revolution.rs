//! Revolutions of a LiDAR with several lasers.

use geometry::Revolution;

use super::time_from_stamp;
use crate::sensor_msgs::{PointCloud2, PointField};
use crate::std_msgs::Header;

/// Bytes of a point: five floats and a ring of two bytes, packed.
const POINT_BYTES: usize = 22;

/// The message of a revolution, as `velodyne_driver` publishes organised clouds: a row for each ring, from the lowest
/// up; x, y, z, intensity, ring (0 the lowest) and time in seconds since the stamp, little endian, 22 bytes a point.
/// Where nothing returned, x, y, z and time are NaN.
#[must_use]
pub fn message_from_revolution(revolution: &Revolution) -> PointCloud2 {
    let field = |name: &str, offset: u32, datatype: u8| PointField {
        name: name.to_owned(),
        offset,
        datatype,
        count: 1,
    };
    let (rows, columns) = (revolution.rows(), revolution.columns());
    let mut data = Vec::with_capacity(rows * columns * POINT_BYTES);
    for (ring, row) in (0..rows).rev().enumerate() {
        let ring = u16::try_from(ring).unwrap_or(u16::MAX).to_le_bytes();
        for cell in revolution.row(row) {
            let [x_m, y_m, z_m, intensity, time_s] = match cell {
                Some(found) => {
                    let [x_m, y_m, z_m] = found.position_m.coords.into();
                    [x_m, y_m, z_m, found.intensity, found.time_s]
                }
                None => [f32::NAN, f32::NAN, f32::NAN, 0.0, f32::NAN],
            };
            for value in [x_m, y_m, z_m, intensity] {
                data.extend(value.to_le_bytes());
            }
            data.extend(ring);
            data.extend(time_s.to_le_bytes());
        }
    }
    let width = u32::try_from(columns).unwrap_or(u32::MAX);
    PointCloud2 {
        header: Header {
            stamp: time_from_stamp(revolution.stamp),
            frame_id: revolution.frame_id.clone(),
        },
        height: u32::try_from(rows).unwrap_or(u32::MAX),
        width,
        fields: vec![
            field("x", 0, PointField::FLOAT32),
            field("y", 4, PointField::FLOAT32),
            field("z", 8, PointField::FLOAT32),
            field("intensity", 12, PointField::FLOAT32),
            field("ring", 16, PointField::UINT16),
            field("time", 18, PointField::FLOAT32),
        ],
        is_bigendian: false,
        point_step: POINT_BYTES as u32,
        row_step: width.saturating_mul(POINT_BYTES as u32),
        data,
        is_dense: revolution.returns().iter().all(Option::is_some),
    }
}

#[cfg(test)]
mod tests {
    use geometry::{LidarReturn, Stamp};
    use nalgebra::Point3;

    use super::*;
    use crate::convert::cloud_from_message;

    #[test]
    fn rows_become_rings_from_the_lowest_and_holes_are_holes() {
        let at = |x_m: f32| LidarReturn {
            position_m: Point3::new(x_m, 2.0, 3.0),
            intensity: 10.0 * x_m,
            time_s: 0.25,
        };
        let (stamp, frame) = (Stamp::from_secs_nanos(7, 8), "velodyne".to_owned());
        let returns = vec![Some(at(1.0)), None, None, Some(at(4.0)), Some(at(5.0)), Some(at(6.0))];
        let (rows, columns) = (vec![0.1, -0.1], vec![0.3, 0.2, 0.1]);
        let revolution = Revolution::new(stamp, frame, rows, columns, returns).unwrap();
        let message = message_from_revolution(&revolution);
        assert_eq!((message.height, message.width, message.row_step), (2, 3, 66));
        assert_eq!(message.data.len(), 132);
        assert!(!message.is_dense);
        let cloud = cloud_from_message(&message).unwrap();
        let x_m: Vec<f32> = cloud.points_m.iter().map(|point| point.x).collect();
        assert_eq!(x_m, [4.0, 5.0, 6.0, 1.0]);
        assert_eq!((cloud.stamp, cloud.frame_id.as_str()), (stamp, "velodyne"));
        // The last cell of the lowest row, and the first of the highest.
        let point = |index: usize| &message.data[22 * index..22 * (index + 1)];
        assert_eq!(point(2)[12..16], 60.0_f32.to_le_bytes());
        assert_eq!(
            (point(2)[16..18].to_vec(), point(3)[16..18].to_vec()),
            (vec![0, 0], vec![1, 0])
        );
        assert_eq!(point(3)[18..22], 0.25_f32.to_le_bytes());
    }
}
