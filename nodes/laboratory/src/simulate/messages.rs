//! Messages of the sensors that have no type in `geometry`.

use geometry::LabelImage;
use msgs::convert::{LidarShot, message_from_lidar_shots, pose_from_isometry, time_from_stamp};
use msgs::geometry_msgs::{PoseWithCovariance, Quaternion, Twist, TwistWithCovariance, Vector3};
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{Image, Imu, PointCloud2};
use msgs::std_msgs::Header;
use nalgebra::Matrix3;
use simulator::{ColourImage, ImuReading, VelodyneTurn, WheelReading};

/// In the format of the Kinect drivers.
pub(super) fn image(image: &ColourImage) -> Image {
    Image {
        header: Header { stamp: time_from_stamp(image.stamp), frame_id: image.frame_id.clone() },
        height: image.height_px as u32,
        width: image.width_px as u32,
        encoding: "rgb8".to_owned(),
        is_bigendian: 0,
        step: 3 * image.width_px as u32,
        data: image.rgb.clone(),
    }
}

/// Without an orientation, which it does not measure.
pub(super) fn imu(reading: &ImuReading) -> Imu {
    let vector = |v: &nalgebra::Vector3<f64>| Vector3 { x: v.x, y: v.y, z: v.z };
    let diagonal = |variance: f64| [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance];
    let mut not_measured = [0.0; 9];
    not_measured[0] = -1.0;
    Imu {
        header: Header {
            stamp: time_from_stamp(reading.stamp),
            frame_id: reading.frame_id.clone(),
        },
        orientation: Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 },
        orientation_covariance: not_measured,
        angular_velocity: vector(&reading.angular_velocity_rad_per_s),
        angular_velocity_covariance: diagonal(reading.angular_velocity_variance),
        linear_acceleration: vector(&reading.linear_acceleration_m_per_s2),
        linear_acceleration_covariance: diagonal(reading.linear_acceleration_variance),
    }
}

/// Height, roll and pitch are not measured: their variances are large.
pub(super) fn odometry(reading: &WheelReading) -> Odometry {
    let velocity = &reading.velocity;
    Odometry {
        header: Header {
            stamp: time_from_stamp(reading.stamp),
            frame_id: reading.frame_id.clone(),
        },
        child_frame_id: reading.child_frame_id.clone(),
        pose: PoseWithCovariance {
            pose: pose_from_isometry(&reading.odom_from_base),
            covariance: covariance(&reading.pose_covariance),
        },
        twist: TwistWithCovariance {
            twist: Twist {
                linear: Vector3 { x: velocity.x, y: velocity.y, z: 0.0 },
                angular: Vector3 { x: 0.0, y: 0.0, z: velocity.z },
            },
            covariance: covariance(&reading.velocity_covariance),
        },
    }
}

/// Organised, with a row for each ring, as `velodyne_driver` publishes it.
pub(super) fn velodyne(turn: &VelodyneTurn) -> PointCloud2 {
    let shots = turn.points.iter().map(|point| LidarShot {
        position_m: point.position_m,
        intensity: point.intensity,
        ring: point.ring,
        time_s: point.time_s,
    });
    message_from_lidar_shots(turn.stamp, &turn.frame_id, (turn.rings, turn.columns), shots)
}

/// The labels of a revolution, an image with a pixel for each point; `None` when there are not as many as points.
pub(super) fn velodyne_labels(turn: &VelodyneTurn) -> Option<LabelImage> {
    let size = (turn.columns, turn.rings);
    LabelImage::new(turn.stamp, turn.frame_id.clone(), size, turn.labels.clone()).ok()
}

/// The covariance of x, y, z and the rotations about them, from that of x, y and the rotation about z.
fn covariance(planar: &Matrix3<f64>) -> [f64; 36] {
    /// The variance that planar drivers publish for what they do not measure.
    const NOT_MEASURED: f64 = 1e6;
    const PLANAR_AXES: [usize; 3] = [0, 1, 5];
    let mut covariance = [0.0; 36];
    for axis in [2, 3, 4] {
        covariance[7 * axis] = NOT_MEASURED;
    }
    for (row, row_axis) in PLANAR_AXES.into_iter().enumerate() {
        for (column, column_axis) in PLANAR_AXES.into_iter().enumerate() {
            covariance[6 * row_axis + column_axis] = planar[(row, column)];
        }
    }
    covariance
}
