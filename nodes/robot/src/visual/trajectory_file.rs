//! Poses as a text file of the TUM benchmark: seconds, place, quaternion.

use std::fmt::Write;
use std::path::Path;

use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use nalgebra::Isometry3;
use node_shell::write_whole_file;

use crate::failure::Failure;

/// Writes a line `seconds x y z qx qy qz qw` for each pose. Under a temporary name first: a reader never finds half a file.
///
/// The poses are those of the rig; written are those of a frame on it.
pub(crate) fn write_trajectory(
    path: &Path,
    poses: &[PoseStamped],
    rig_from_written: &Isometry3<f64>,
) -> Result<(), Failure> {
    let mut text = String::from("# seconds x y z qx qy qz qw\n");
    for PoseStamped { header, pose } in poses {
        let odom_from_rig = convert::isometry_from_pose(pose)
            .map_err(|error| Failure::new(format!("a pose cannot be written: {error}")))?;
        let pose = convert::pose_from_isometry(&(odom_from_rig * rig_from_written));
        let (place, turn) = (&pose.position, &pose.orientation);
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{}.{:09} {} {} {} {} {} {} {}",
            header.stamp.sec,
            header.stamp.nanosec,
            place.x,
            place.y,
            place.z,
            turn.x,
            turn.y,
            turn.z,
            turn.w
        );
    }
    write_whole_file(path, text.as_bytes())
        .map_err(|error| Failure::new(format!("cannot write {}: {error}", path.display())))
}
