//! Revolutions of a LiDAR with several lasers.

use geometry::{Revolution, Stamp};

use super::time_from_stamp;
use crate::sensor_msgs::{PointCloud2, PointField};
use crate::std_msgs::Header;

/// Bytes of a point: five floats and a ring of two bytes, packed.
const POINT_BYTES: usize = 22;

/// A shot of a laser as a message has it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LidarShot {
    /// In metres; not a number where nothing returned.
    pub position_m: [f32; 3],
    /// As the scanner reports it.
    pub intensity: f32,
    /// Which laser, the lowest is 0.
    pub ring: u16,
    /// In seconds since the stamp.
    pub time_s: f32,
}

/// The message of shots in rows of this many columns, as `velodyne_driver` publishes organised clouds: x, y, z, intensity,
/// ring and time, little endian, 22 bytes a point.
#[must_use]
pub fn message_from_lidar_shots(
    stamp: Stamp,
    frame_id: &str,
    (rows, columns): (usize, usize),
    shots: impl IntoIterator<Item = LidarShot>,
) -> PointCloud2 {
    let field = |name: &str, offset: u32, datatype: u8| PointField {
        name: name.to_owned(),
        offset,
        datatype,
        count: 1,
    };
    let mut data = Vec::with_capacity(rows * columns * POINT_BYTES);
    let mut is_dense = true;
    for LidarShot { position_m, intensity, ring, time_s } in shots {
        for value in position_m.into_iter().chain([intensity]) {
            data.extend(value.to_le_bytes());
        }
        data.extend(ring.to_le_bytes());
        data.extend(time_s.to_le_bytes());
        is_dense &= position_m.iter().all(|value| value.is_finite());
    }
    let size = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    PointCloud2 {
        header: Header { stamp: time_from_stamp(stamp), frame_id: frame_id.to_owned() },
        height: size(rows),
        width: size(columns),
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
        row_step: size(columns).saturating_mul(POINT_BYTES as u32),
        data,
        is_dense,
    }
}

/// The message of a revolution: a row for each ring, from the lowest up, as [`message_from_lidar_shots`] has it. Where
/// nothing returned, x, y, z and time are NaN.
#[must_use]
pub fn message_from_revolution(revolution: &Revolution) -> PointCloud2 {
    let (rows, columns) = (revolution.rows(), revolution.columns());
    let shots = (0..rows).rev().enumerate().flat_map(|(ring, row)| {
        let ring = u16::try_from(ring).unwrap_or(u16::MAX);
        revolution.row(row).iter().map(move |cell| match cell {
            Some(found) => LidarShot {
                position_m: found.position_m.coords.into(),
                intensity: found.intensity,
                ring,
                time_s: found.time_s,
            },
            None => LidarShot { position_m: [f32::NAN; 3], intensity: 0.0, ring, time_s: f32::NAN },
        })
    });
    message_from_lidar_shots(revolution.stamp, &revolution.frame_id, (rows, columns), shots)
}

#[cfg(test)]
mod tests {
    use geometry::LidarReturn;
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
