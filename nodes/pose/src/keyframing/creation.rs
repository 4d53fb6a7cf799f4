//! Close features become landmarks by their depth.

use nalgebra::Point3;

use super::KeyframingConfig;
use crate::map::{KeyframeId, Map};

/// Makes landmarks of the features of a keyframe that are none yet and whose depth is close; of corners, if these are few,
/// the nearest beyond, too. Returns how many there are.
pub fn create_close(map: &mut Map, keyframe: KeyframeId, config: &KeyframingConfig) -> usize {
    let Some(from) = map.keyframes().get(keyframe) else { return 0 };
    let map_from_camera = from.camera_from_map().inverse();
    let frame = from.frame();
    let free = (0..frame.corners.len()).filter(|corner| from.points()[*corner].is_none());
    let depths = free.filter_map(|corner| Some((frame.corner_depths[corner]?.depth_m, corner)));
    let mut corners: Vec<(f64, usize)> = depths.collect();
    corners.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    let close = corners.partition_point(|(depth_m, _)| *depth_m <= config.close_m());
    corners.truncate(close.max(config.least_created));
    let places = corners.into_iter().filter_map(|(depth_m, corner)| {
        let ray = from.camera().ray(&frame.corners[corner].pixel.cast())?.push(1.0);
        Some((corner, map_from_camera * Point3::from(ray * depth_m)))
    });
    let places: Vec<(usize, Point3<f64>)> = places.collect();
    let free = frame.lines_in_space.iter().enumerate();
    let free = free.filter(|(segment, _)| from.lines().get(*segment) == Some(&None));
    let lines = free.filter_map(|(segment, in_space)| {
        let in_space = in_space.as_ref()?;
        let is_close = in_space.start_m.z.max(in_space.end_m.z) <= config.close_m();
        let ends = [in_space.start_m, in_space.end_m].map(|end| map_from_camera * end);
        is_close.then_some((segment, ends))
    });
    let lines: Vec<(usize, [Point3<f64>; 2])> = lines.collect();
    let points =
        places.iter().filter(|(corner, place)| map.insert_point(keyframe, *corner, place).is_ok());
    let points = points.count();
    let lines =
        lines.iter().filter(|(segment, ends)| map.insert_line(keyframe, *segment, ends).is_ok());
    points + lines.count()
}
