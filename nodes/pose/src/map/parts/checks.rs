//! The invariants of each part by itself.

use estimation::perturbation::is_rigid;

use super::{KeyframePart, PartsError, PointPart};
use crate::frame::Frame;
use crate::map::PointLook;

/// The numbers of a point. `None` when one means nothing.
pub(super) fn check_point(point: &PointPart) -> Option<()> {
    let PointLook { towards_cameras, nearest_m, farthest_m, .. } = point.look;
    let numbers = point.position_m.iter().chain(towards_cameras.iter());
    let is_finite = numbers.chain([&nearest_m, &farthest_m]).all(|number| number.is_finite());
    let is_range = nearest_m > 0.0 && farthest_m >= nearest_m;
    (is_finite && is_range).then_some(())
}

/// A keyframe by itself.
pub(super) fn check_keyframe(index: usize, part: &KeyframePart) -> Result<(), PartsError> {
    let KeyframePart { camera, camera_from_map, frame, points, lines, loops, .. } = part;
    camera.validate().map_err(|source| PartsError::Camera { index, source })?;
    for (features, listed) in [
        (frame.corners.len(), points.len()),
        (frame.corners.len(), frame.corner_depths.len()),
        (frame.lines.len(), lines.len()),
        (frame.lines.len(), frame.lines_in_space.len()),
    ] {
        if features != listed {
            return Err(PartsError::Features { index, features, listed });
        }
    }
    let poses = loops.iter().map(|(_, pose)| pose).chain([camera_from_map]);
    let is_odometry = part.by_odometry.iter().all(|by| {
        is_rigid(&by.camera_from_odom) && by.travelled_m.is_finite() && by.turned_rad.is_finite()
    });
    if poses.into_iter().all(is_rigid) && is_odometry && is_frame(frame) {
        Ok(())
    } else {
        Err(PartsError::Number { what: "keyframe", index })
    }
}

/// Whether all numbers that something is computed from are finite, and standard deviations positive.
fn is_frame(frame: &Frame) -> bool {
    let corners = frame.corners.iter().all(|corner| {
        corner.pixel.iter().all(|number| number.is_finite()) && corner.angle_rad.is_finite()
    });
    let is_depth = |depth_m: f64, std_dev_m: f64| {
        depth_m.is_finite() && std_dev_m.is_finite() && std_dev_m > 0.0
    };
    let mut depths = frame.corner_depths.iter().flatten();
    let depths = depths.all(|depth| is_depth(depth.depth_m, depth.std_dev_m));
    let lines = frame.lines.iter().all(|line| {
        let ends = [line.segment.start_px, line.segment.end_px];
        ends.as_flattened().iter().all(|number| number.is_finite())
    });
    let in_space = frame.lines_in_space.iter().flatten().all(|line| {
        let ends = line.start_m.iter().chain(line.end_m.iter());
        let numbers = ends.chain([&line.rms_m, &line.support]).all(|number| number.is_finite());
        numbers
            && is_depth(line.start_m.z, line.start_std_dev_m)
            && is_depth(line.end_m.z, line.end_std_dev_m)
    });
    corners && depths && lines && in_space
}
