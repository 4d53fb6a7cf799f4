//! Features become landmarks by their depth.

use nalgebra::Point3;

use crate::map::{KeyframeId, Map};

/// Makes landmarks of the features of a keyframe that are none yet and whose depth is measured. Returns how many there are.
///
/// The seed takes depths of less than 40 baselines only, since it holds all depths to be equally good. Here each has a
/// standard deviation, which bundle adjustment weighs it by: a far point is created where it was measured, and moves to
/// its place by other views.
pub fn create_measured(map: &mut Map, keyframe: KeyframeId) -> usize {
    let Some(from) = map.keyframes().get(keyframe) else { return 0 };
    let map_from_camera = from.camera_from_map().inverse();
    let frame = from.frame();
    let free = (0..frame.corners.len()).filter(|corner| from.points().get(*corner) == Some(&None));
    let places = free.filter_map(|corner| {
        let depth = frame.corner_depths.get(corner).copied().flatten()?;
        let ray = from.camera().ray(&frame.corners.get(corner)?.pixel.cast())?.push(1.0);
        Some((corner, map_from_camera * Point3::from(ray * depth.depth_m)))
    });
    let places: Vec<(usize, Point3<f64>)> = places.collect();
    let free = frame.lines_in_space.iter().enumerate();
    let free = free.filter(|(segment, _)| from.lines().get(*segment) == Some(&None));
    let lines = free.filter_map(|(segment, in_space)| {
        let in_space = in_space.as_ref()?;
        Some((segment, [in_space.start_m, in_space.end_m].map(|end| map_from_camera * end)))
    });
    let lines: Vec<(usize, [Point3<f64>; 2])> = lines.collect();
    let points =
        places.iter().filter(|(corner, place)| map.insert_point(keyframe, *corner, place).is_ok());
    let points = points.count();
    let lines =
        lines.iter().filter(|(segment, ends)| map.insert_line(keyframe, *segment, ends).is_ok());
    points + lines.count()
}
