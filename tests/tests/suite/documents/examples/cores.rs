use std::error::Error;
use std::sync::Arc;

use detection::{CycleInput, DetectionConfig, Detector, View};
use geometry::{
    CameraModel, DepthImage, DepthPixels, DepthSizeError, Distortion, RayTable, Scan, Stamp, ply,
};
use nalgebra::Isometry3;
use reconstruction::{Map, ReconstructionConfig};
use segmentation::{SegmentationConfig, Segmenter};

pub fn main() -> Result<(), Box<dyn Error>> {
    let camera = CameraModel {
        width_px: 160,
        height_px: 120,
        fx_px: 140.0,
        fy_px: 140.0,
        cx_px: 79.5,
        cy_px: 59.5,
        distortion: Distortion::None,
    };
    let mut detector = Detector::new(DetectionConfig::default())?;
    let projector = detector.depth_projector(RayTable::new(&camera)?);
    let mut segmenter = Segmenter::new(SegmentationConfig::default())?;
    let mut map = Map::new(ReconstructionConfig::default(), None)?;
    for cycle in 0..40 {
        // From the second second on something passes before the wall, 12 cm in each cycle.
        let object_m = (cycle >= 20).then(|| -1.2 + 0.12 * f64::from(cycle - 20));
        let stamp = Stamp::from_nanos(i64::from(cycle) * 100_000_000);
        let (scan, image) = sensors(stamp, &camera, object_m)?;
        let image = Arc::new(image);
        let input = CycleInput {
            scan: &scan,
            view: View::Depth(projector.image(&image)?),
            map_from_rig: &Isometry3::identity(),
            map_frame_id: "map",
        };
        let detected = detector.step(&input, |_stage| ())?;
        let segmented = segmenter.step(&detected.cycle, |_stage| ())?;
        map.integrate(&segmented.cycle)?;
        let (zones, moving) = (&detected.cycle.zones, &segmented.cycle.dynamic_cloud.points_m);
        println!("cycle {cycle}: {} zones, {} points move", zones.len(), moving.len());
    }
    let whole = map.whole();
    std::fs::write("map.ply", ply::encode_map(&whole.points, &whole.views))?;
    println!("{} points in map.ply", whole.points.points_m.len());
    Ok(())
}

/// The depth along a ray with this slope to the left: a wall 3 m ahead, and a post of 40 cm at 1.5 m.
fn depth_m(left: f64, object_m: Option<f64>) -> f64 {
    if object_m.is_some_and(|object_m| (1.5 * left - object_m).abs() < 0.2) { 1.5 } else { 3.0 }
}

fn sensors(
    stamp: Stamp,
    camera: &CameraModel,
    object_m: Option<f64>,
) -> Result<(Scan, DepthImage), DepthSizeError> {
    let azimuth_rad = |beam: i32| f64::from(beam - 40).to_radians();
    let range_m = |beam| depth_m(azimuth_rad(beam).tan(), object_m) / azimuth_rad(beam).cos();
    let scan = Scan {
        stamp,
        angle_min_rad: azimuth_rad(0) as f32,
        angle_increment_rad: 1_f32.to_radians(),
        range_min_m: 0.15,
        range_max_m: 12.0,
        ranges_m: (0..=80).map(|beam| range_m(beam) as f32).collect(),
        ..Scan::default()
    };
    let size_px = (camera.width_px, camera.height_px);
    let left = |pixel: usize| (camera.cx_px - (pixel % camera.width_px) as f64) / camera.fx_px;
    let depth_mm = |pixel| (1e3 * depth_m(left(pixel), object_m)) as u16;
    let pixels = DepthPixels::Millimetres((0..size_px.0 * size_px.1).map(depth_mm).collect());
    Ok((scan, DepthImage::new(stamp, "camera".to_owned(), size_px, pixels)?))
}
