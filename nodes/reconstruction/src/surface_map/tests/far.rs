//! How far the camera is used, and its noise there.

use geometry::{DepthFrame, DepthImage, DepthPixels};

use super::*;

/// The noise of a RealSense D435 at 1 m.
const STEREO_NOISE_M: f64 = 0.0036;
const END_M: f64 = 6.0;

/// The cycle with depths that scatter like those of a stereo camera.
fn of_stereo_camera(mut cycle: SegmentedCycle, random: &mut Random) -> SegmentedCycle {
    let depth = cycle.depth.unwrap();
    let frame = depth.frame();
    let scatters = |depth_mm: &u16| {
        let depth_m = f64::from(*depth_mm) / 1e3;
        let noise_m = STEREO_NOISE_M * depth_m * depth_m * random.normal();
        ((depth_m + noise_m) * 1e3) as u16
    };
    let pixels = DepthPixels::Millimetres(frame.depths_mm().iter().map(scatters).collect());
    let (image, camera) = (frame.image(), *frame.camera());
    let size_px = (image.width_px(), image.height_px());
    let image = DepthImage::new(image.stamp, image.frame_id.clone(), size_px, pixels).unwrap();
    let is_moving = depth.is_moving().to_vec();
    let frame = DepthFrame::new(image, camera).unwrap();
    cycle.depth = MaskedDepth::new(Arc::new(frame), is_moving).ok();
    cycle
}

/// The points of a corridor's map, and how many of them are behind its end.
fn points_of(config: ReconstructionConfig) -> (usize, usize) {
    let mut random = Random::new(5);
    let mut map = Map::new(config, None).unwrap();
    let scene = Scene::corridor(END_M);
    for index in 0..40 {
        let rig = rig_at(0.005 * f64::from(index), 0.0);
        let seen = cycle(&scene, index, &rig, None);
        map.integrate(&of_stereo_camera(seen, &mut random)).unwrap();
    }
    let points = points(&map);
    let behind = points.iter().filter(|(point, _)| point.x > END_M + 0.25).count();
    (points.len(), behind)
}

/// Regression: the noise of every camera was a Kinect's. Of a stereo camera there was a second wall behind each that is farther than 4 m.
#[test]
fn with_the_noise_of_the_camera_a_far_wall_is_one() {
    let (_, by_default) = points_of(config(0.05));
    let (all, behind) =
        points_of(ReconstructionConfig { depth_noise_m: STEREO_NOISE_M, ..config(0.05) });
    assert!(by_default > 20 && behind * 20 < by_default, "{by_default}, {behind} of {all}");
}

#[test]
fn nothing_beyond_the_reach_is_in_the_map() {
    let (whole, _) = points_of(config(0.05));
    let reach_m = 4.0;
    let mut random = Random::new(5);
    let mut map =
        Map::new(ReconstructionConfig { map_reach_m: reach_m, ..config(0.05) }, None).unwrap();
    for index in 0..10 {
        let seen = cycle(&Scene::corridor(END_M), index, &rig_at(0.0, 0.0), Some(&mut random));
        map.integrate(&seen).unwrap();
    }
    let points = points(&map);
    let farthest_m = points.iter().map(|(point, _)| point.x).fold(0.0, f64::max);
    assert!((reach_m - 0.2..reach_m + 0.1).contains(&farthest_m), "{farthest_m} m");
    assert!(points.len() < whole, "{} of {whole}", points.len());
}
