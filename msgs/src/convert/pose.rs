//! Poses.

use geometry::{Stamp, StampedPose};
use nalgebra::{Isometry3, Matrix6, Point3, Quaternion as Numbers, Translation3, UnitQuaternion};

use super::{ConvertError, stamp_from_time, time_from_stamp};
use crate::geometry_msgs::{
    Point, Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion as QuaternionMessage,
    Transform, Vector3,
};
use crate::nav_msgs::Odometry;
use crate::std_msgs::Header;

/// How far the squared length of a quaternion may be from 1: tf2's own tolerance
/// (`QUATERNION_NORMALIZATION_TOLERANCE`). Beyond it the four numbers are no rotation.
const ROUNDED: f64 = 10e-3;

/// Below this the quaternion is taken as it stands, so that a pose that goes out and comes back is the
/// same to the last bit. A turn that is wrong by as much moves a point at 10 m by 10 nm.
const EXACT: f64 = 1e-9;

/// The rigid motion of a pose. A quaternion that was rounded in transit is normalised.
///
/// # Errors
/// When the position is not finite, or the quaternion's squared length differs from 1 by more than
/// 0.01, as that of the all-zero one does.
pub fn isometry_from_pose(pose: &Pose) -> Result<Isometry3<f64>, ConvertError> {
    isometry(&pose.position, &pose.orientation)
}

/// The rigid motion of a transform: takes coordinates of the child frame to the parent. A quaternion that was rounded
/// in transit is normalised.
///
/// # Errors
/// As [`isometry_from_pose`].
pub fn isometry_from_transform(transform: &Transform) -> Result<Isometry3<f64>, ConvertError> {
    let Vector3 { x, y, z } = transform.translation;
    isometry(&Point { x, y, z }, &transform.rotation)
}

/// The transform of a rigid motion.
#[must_use]
pub fn transform_from_isometry(isometry: &Isometry3<f64>) -> Transform {
    let Pose { position: Point { x, y, z }, orientation } = pose_from_isometry(isometry);
    Transform { translation: Vector3 { x, y, z }, rotation: orientation }
}

fn isometry(
    position: &Point,
    orientation: &QuaternionMessage,
) -> Result<Isometry3<f64>, ConvertError> {
    let position = point_from_message(position)?;
    let QuaternionMessage { x, y, z, w } = *orientation;
    let numbers = Numbers::new(w, x, y, z);
    let excess = (numbers.norm_squared() - 1.0).abs();
    let rotation = if excess <= EXACT {
        UnitQuaternion::new_unchecked(numbers)
    } else if excess <= ROUNDED {
        UnitQuaternion::new_normalize(numbers)
    } else {
        return Err(ConvertError::Quaternion { x, y, z, w });
    };
    Ok(Isometry3::from_parts(Translation3::from(position), rotation))
}

/// The point of a message.
pub(super) fn point_from_message(message: &Point) -> Result<Point3<f64>, ConvertError> {
    let Point { x: x_m, y: y_m, z: z_m } = *message;
    if [x_m, y_m, z_m].iter().all(|value_m| value_m.is_finite()) {
        Ok(Point3::new(x_m, y_m, z_m))
    } else {
        Err(ConvertError::Position { x_m, y_m, z_m })
    }
}

/// The message of a point.
pub(super) fn message_from_point(point_m: &Point3<f64>) -> Point {
    Point { x: point_m.x, y: point_m.y, z: point_m.z }
}

/// The pose of a rigid motion.
#[must_use]
pub fn pose_from_isometry(isometry: &Isometry3<f64>) -> Pose {
    let [x, y, z] = isometry.translation.vector.into();
    let numbers = isometry.rotation.quaternion();
    Pose {
        position: Point { x, y, z },
        orientation: QuaternionMessage { x: numbers.i, y: numbers.j, z: numbers.k, w: numbers.w },
    }
}

fn stamped(header: &Header, pose: &Pose) -> Result<StampedPose, ConvertError> {
    Ok(StampedPose {
        stamp: stamp_from_time(header.stamp),
        frame_id: header.frame_id.clone(),
        map_from_rig: isometry_from_pose(pose)?,
    })
}

/// The pose of a message; the header's frame is the map.
///
/// # Errors
/// As [`isometry_from_pose`].
pub fn pose_from_message(message: &PoseStamped) -> Result<StampedPose, ConvertError> {
    stamped(&message.header, &message.pose)
}

/// The pose of an odometry message; the header's frame is the map, the child frame must be the rig.
///
/// # Errors
/// As [`isometry_from_pose`].
pub fn pose_from_odometry(message: &Odometry) -> Result<StampedPose, ConvertError> {
    stamped(&message.header, &message.pose.pose)
}

/// The pose of a message that carries its covariance too.
///
/// # Errors
/// As [`isometry_from_pose`].
pub fn pose_from_covariance_message(
    message: &PoseWithCovarianceStamped,
) -> Result<StampedPose, ConvertError> {
    stamped(&message.header, &message.pose.pose)
}

/// The message of a pose.
#[must_use]
pub fn message_from_pose(pose: &StampedPose) -> PoseStamped {
    PoseStamped {
        header: header_of(pose.stamp, &pose.frame_id),
        pose: pose_from_isometry(&pose.map_from_rig),
    }
}

/// A covariance as `PoseWithCovariance` and `TwistWithCovariance` have it: row by row.
#[must_use]
pub fn covariance_by_rows(covariance: &Matrix6<f64>) -> [f64; 36] {
    std::array::from_fn(|index| covariance[(index / 6, index % 6)])
}

/// The header of a moment in a frame.
#[must_use]
pub fn header_of(stamp: Stamp, frame_id: &str) -> Header {
    Header { stamp: time_from_stamp(stamp), frame_id: frame_id.to_owned() }
}

#[cfg(test)]
mod tests {
    use geometry::pose_from_vector;
    use nalgebra::{Point3, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::geometry_msgs::PoseWithCovariance;

    fn turned(x: f64, y: f64, z: f64, w: f64) -> Pose {
        Pose { position: Point::default(), orientation: QuaternionMessage { x, y, z, w } }
    }

    #[test]
    fn a_quarter_turn_to_the_left_takes_forward_to_left() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let pose =
            Pose { position: Point { x: 1.0, y: 2.0, z: 3.0 }, ..turned(0.0, 0.0, half, half) };
        let map_from_rig = isometry_from_pose(&pose).unwrap();
        let moved = map_from_rig * Point3::new(1.0, 0.0, 0.0);
        assert!((moved - Point3::new(1.0, 3.0, 3.0)).norm() < 1e-12);
    }

    #[test]
    fn a_rounded_quaternion_is_made_a_unit_one() {
        // As trajectory files print it, with four decimals.
        let rotation =
            isometry_from_pose(&turned(0.6574, 0.6126, -0.2949, -0.3248)).unwrap().rotation;
        assert!((rotation.quaternion().norm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn what_is_no_rotation_is_refused() {
        for pose in [
            turned(0.0, 0.0, 0.0, 0.0),
            turned(0.0, 0.0, 0.0, 1.1),
            turned(0.0, 0.0, 0.0, f64::NAN),
            turned(f64::INFINITY, 0.0, 0.0, 1.0),
            turned(1e200, 0.0, 0.0, 1.0),
        ] {
            let error = isometry_from_pose(&pose).unwrap_err();
            assert!(matches!(error, ConvertError::Quaternion { .. }), "{error}");
        }
        let mut pose = Pose::default();
        pose.position.y = f64::NAN;
        assert!(matches!(isometry_from_pose(&pose), Err(ConvertError::Position { .. })));
    }

    #[test]
    fn all_three_messages_say_the_same() {
        let pose = StampedPose {
            stamp: Stamp::from_nanos(12_345_678_901),
            frame_id: "map".to_owned(),
            map_from_rig: pose_from_vector(&[1.0, 2.0, 3.0, 0.1, 0.2, 0.3]),
        };
        let PoseStamped { header, pose: pose_message } = message_from_pose(&pose);
        let with_covariance = PoseWithCovariance { pose: pose_message, covariance: [0.5; 36] };
        let odometry = Odometry {
            header: header.clone(),
            child_frame_id: "rig".to_owned(),
            pose: with_covariance.clone(),
            ..Odometry::default()
        };
        let with_covariance = PoseWithCovarianceStamped { header, pose: with_covariance };
        assert_eq!(pose_from_odometry(&odometry).as_ref(), Ok(&pose));
        assert_eq!(pose_from_covariance_message(&with_covariance).as_ref(), Ok(&pose));
    }

    proptest! {
        #[test]
        fn a_pose_comes_back_bit_by_bit(
            first in proptest::array::uniform6(-3.0..3.0_f64),
            second in proptest::array::uniform6(-3.0..3.0_f64),
            fraction in 0.0..1.0_f64,
        ) {
            // An interpolated pose: its quaternion's length is 1 but for rounding.
            let (first, second) = (pose_from_vector(&first), pose_from_vector(&second));
            let Some(map_from_rig) = first.try_lerp_slerp(&second, fraction, 1e-6) else {
                return Ok(());
            };
            let pose = StampedPose {
                stamp: Stamp::from_nanos(1),
                frame_id: "map".to_owned(),
                map_from_rig,
            };
            prop_assert_eq!(pose_from_message(&message_from_pose(&pose)), Ok(pose));
        }

        #[test]
        fn a_pose_that_was_read_is_rigid(numbers in proptest::array::uniform4(-0.6..0.6_f64)) {
            let [x, y, z, w] = numbers;
            if let Ok(pose) = isometry_from_pose(&turned(x, y, z, w)) {
                let moved = pose.rotation * Vector3::new(1.0, 2.0, 2.0);
                prop_assert!((moved.norm() - 3.0).abs() < 1e-8);
            }
        }
    }
}
