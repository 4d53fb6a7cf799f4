//! One whole cycle with 307,200 points, every pixel of a Kinect v1: from the message's bytes to the map, with both methods,
//! and with maps of the depth images.
//! The thesis publishes 148 ms a cycle (Rec-HV experiment 8).
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a panic is a benchmark's report"
)]

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use detection::{CycleInput, DetectionConfig, Detector, View};
use geometry::{
    CameraModel, DepthImage, DepthLimits, DepthPixels, DepthProjector, Method, PipelineConfig,
    RayTable, Scan,
};
use msgs::sensor_msgs::{Image, PointCloud2};
use msgs::{cdr, convert};
use nalgebra::Isometry3;
use reconstruction::{Map, ReconstructionConfig};
use segmentation::{SegmentationConfig, Segmenter};
use simulator::{Sample, Scenario};

/// A time of the demo with the person in view.
struct Moment {
    scans: Vec<Scan>,
    image: Arc<DepthImage>,
    camera: CameraModel,
}

fn moment() -> Moment {
    let scenario = Scenario::demo();
    let in_view_s = 11.5;
    let (mut scans, mut image, mut model) = (Vec::new(), None, None);
    for sample in scenario.samples().unwrap() {
        let time_s = sample.stamp().seconds_since(scenario.start);
        match sample {
            Sample::Scan { scan, .. } if time_s > in_view_s - 1.0 => scans.push(scan),
            Sample::Depth { image: depth, .. } => image = Some(depth),
            Sample::CameraInfo { camera, .. } => model = Some(camera),
            _ => {}
        }
        if time_s > in_view_s {
            break;
        }
    }
    Moment { scans, image: Arc::new(full(&image.unwrap())), camera: model.unwrap() }
}

/// The image with a depth in every pixel, so that it has all 307,200 points.
fn full(image: &DepthImage) -> DepthImage {
    let DepthPixels::Millimetres(depths_mm) = image.pixels() else { panic!("not in millimetres") };
    let holes_filled =
        depths_mm.iter().map(|&depth_mm| if depth_mm == 0 { 3000 } else { depth_mm });
    let pixels = DepthPixels::Millimetres(holes_filled.collect());
    let size_px = (image.width_px(), image.height_px());
    DepthImage::new(image.stamp, image.frame_id.clone(), size_px, pixels).unwrap()
}

struct Pipeline {
    detector: Detector,
    projector: DepthProjector,
    segmenter: Segmenter,
    map: Map,
    scans: Vec<Scan>,
    cycles: usize,
}

/// The RPLIDAR A1's 7 Hz.
const CYCLE_S: f64 = 1.0 / 7.0;

impl Pipeline {
    fn new(moment: &Moment, pipeline: PipelineConfig) -> Self {
        let detection = DetectionConfig { pipeline: pipeline.clone(), ..Default::default() };
        let segmentation = SegmentationConfig { pipeline: pipeline.clone(), ..Default::default() };
        let reconstruction = ReconstructionConfig { pipeline, ..ReconstructionConfig::default() };
        let detector = Detector::new(detection).unwrap();
        Self {
            projector: detector.depth_projector(RayTable::new(&moment.camera).unwrap()),
            detector,
            segmenter: Segmenter::new(segmentation).unwrap(),
            map: Map::new(reconstruction, None).unwrap(),
            scans: moment.scans.clone(),
            cycles: 0,
        }
    }

    fn depth_cycle(&mut self, bytes: &[u8]) -> usize {
        let image = convert::depth_from_message(&cdr::decode::<Image>(bytes).unwrap()).unwrap();
        let (image, projector) = (Arc::new(image), self.projector.clone());
        self.cycle(View::Depth(projector.image(&image).unwrap()))
    }

    fn cloud_cycle(&mut self, bytes: &[u8]) -> usize {
        let message = cdr::decode::<PointCloud2>(bytes).unwrap();
        let cloud = convert::cloud_from_message(&message).unwrap();
        self.cycle(View::PointsInCamera(&cloud))
    }

    fn cycle(&mut self, view: View<'_>) -> usize {
        // Time must advance: a scan older than the last one would restart the nodes.
        let stamp = self.scans[0].stamp.plus_seconds(self.cycles as f64 * CYCLE_S);
        let scan = Scan { stamp, ..self.scans[self.cycles % self.scans.len()].clone() };
        self.cycles += 1;
        let map_from_rig = Isometry3::identity();
        let input =
            CycleInput { scan: &scan, view, map_from_rig: &map_from_rig, map_frame_id: "map" };
        let detected = self.detector.step(&input, |_| ()).unwrap();
        let segmented = self.segmenter.step(&detected.cycle, |_| ()).unwrap();
        self.map.integrate(&segmented.cycle).unwrap();
        self.map.len()
    }
}

fn cycles(criterion: &mut Criterion) {
    let moment = moment();
    let image_bytes = cdr::encode(&convert::message_from_depth(&moment.image)).unwrap();
    let rays = RayTable::new(&moment.camera).unwrap();
    let in_camera = Isometry3::identity();
    let cloud = DepthProjector::new(rays, DepthLimits::default(), &in_camera, "camera")
        .image(&moment.image)
        .unwrap()
        .cloud();
    assert_eq!(cloud.points_m.len(), 307_200);
    let cloud_bytes = cdr::encode(&convert::message_from_cloud(&cloud)).unwrap();

    for method in Method::ALL {
        let config = PipelineConfig { method, ..PipelineConfig::default() };
        let mut pipeline = Pipeline::new(&moment, config.clone());
        criterion.bench_function(&format!("{method}, a depth image of 307,200 points"), |bench| {
            bench.iter(|| pipeline.depth_cycle(black_box(&image_bytes)));
        });
        let mut pipeline = Pipeline::new(&moment, config);
        criterion.bench_function(&format!("{method}, a PointCloud2 of 307,200 points"), |bench| {
            bench.iter(|| pipeline.cloud_cycle(black_box(&cloud_bytes)));
        });
    }
    for map_edge_m in [0.08, 0.05, 0.03, 0.02] {
        let config = PipelineConfig { map_edge_m, ..PipelineConfig::default() };
        let mut pipeline = Pipeline::new(&moment, config);
        let name = format!("a depth image into a map of depth images at {map_edge_m} m");
        criterion.bench_function(&name, |bench| {
            bench.iter(|| pipeline.depth_cycle(black_box(&image_bytes)));
        });
    }
}

criterion_group!(benches, cycles);
criterion_main!(benches);
