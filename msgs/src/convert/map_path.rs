//! The trajectory of the platform in its map.

use geometry::{MapPath, PathVertex};

use super::{
    ConvertError, isometry_from_pose, pose_from_isometry, stamp_from_time, time_from_stamp,
};
use crate::geometry_msgs::PoseStamped;
use crate::nav_msgs::Path;
use crate::std_msgs::Header;

/// The path of a message. Its frame and stamp are those of the message's header, the vertices' stamps those of the
/// poses' headers; the poses' own frames are not looked at.
///
/// # Errors
/// When a pose is invalid, as [`isometry_from_pose`], or the poses are no path, as [`MapPath::new`].
pub fn map_path_from_message(message: &Path) -> Result<MapPath, ConvertError> {
    let vertices = message.poses.iter().map(|posed| {
        let stamp = stamp_from_time(posed.header.stamp);
        Ok(PathVertex { stamp, map_from_rig: isometry_from_pose(&posed.pose)? })
    });
    let vertices = vertices.collect::<Result<Vec<_>, ConvertError>>()?;
    let Header { stamp, frame_id } = &message.header;
    Ok(MapPath::new(stamp_from_time(*stamp), frame_id, vertices)?)
}

/// The message of a path.
#[must_use]
pub fn message_from_map_path(path: &MapPath) -> Path {
    let header =
        |stamp| Header { stamp: time_from_stamp(stamp), frame_id: path.frame_id().to_owned() };
    let poses = path.vertices().iter().map(|vertex| PoseStamped {
        header: header(vertex.stamp),
        pose: pose_from_isometry(&vertex.map_from_rig),
    });
    Path { header: header(path.since()), poses: poses.collect() }
}

#[cfg(test)]
mod tests {
    use geometry::{MapPathError, Stamp, pose_from_vector};

    use super::*;

    fn path(stamps: &[i64]) -> Result<MapPath, MapPathError> {
        let vertices = stamps.iter().map(|nanos| PathVertex {
            stamp: Stamp::from_nanos(*nanos),
            map_from_rig: pose_from_vector(&[*nanos as f64, 1.0, -0.5, 0.3, 0.1, -0.2]),
        });
        MapPath::new(Stamp::from_nanos(9), "map", vertices.collect())
    }

    #[test]
    fn a_path_that_goes_out_and_comes_back_is_the_same() {
        let path = path(&[1, 2, 5]).unwrap();
        assert_eq!(map_path_from_message(&message_from_map_path(&path)), Ok(path));
    }

    #[test]
    fn what_is_no_path_is_refused_with_its_reason() {
        let message = message_from_map_path(&path(&[1, 2, 5]).unwrap());
        let mut unordered = message.clone();
        unordered.poses.swap(0, 1);
        let error = map_path_from_message(&unordered).unwrap_err();
        assert_eq!(error, ConvertError::MapPath(MapPathError::Unordered { index: 1 }));
        let mut not_finite = message.clone();
        not_finite.poses[2].pose.position.y = f64::NAN;
        assert!(map_path_from_message(&not_finite).is_err());
        let mut far = message;
        far.poses[1].pose.position.x = 1e9;
        let error = map_path_from_message(&far).unwrap_err().to_string();
        assert!(error.contains("vertex 1"), "{error}");
    }
}
