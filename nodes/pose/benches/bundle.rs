//! How long a local bundle adjustment takes: `cargo bench -p pose --bench bundle`.
// A benchmark may stop where it stands, and exports nothing.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use estimation::Random;
use geometry::{CameraModel, Distortion};
use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
use pose::bundle_adjustment::{Bundle, BundleConfig, BundlePose, Sighting, adjust};
use pose::solve::{LineObservation, PointObservation};

const CAMERA: CameraModel = CameraModel {
    width_px: 640,
    height_px: 480,
    fx_px: 522.0,
    fy_px: 518.1,
    cx_px: 305.8,
    cy_px: 248.6,
    distortion: Distortion::None,
};
/// A Kinect's noise: of a pixel, and of a depth at 1 m, which grows with the square.
const NOISE_PX: f64 = 1.0;
const NOISE_AT_1_M: f64 = 0.003;
const KEYFRAMES: usize = 20;
const POINTS: usize = 2000;
const LINES: usize = 200;

/// Numbers that look like chance, always the same.
struct Draw(Random);

impl Draw {
    fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0.between(from, to)
    }

    /// Mean 0 and deviation 1.
    fn normal(&mut self) -> f64 {
        self.0.normal()
    }

    fn off(&mut self, std_dev: f64) -> Vector3<f64> {
        std_dev * Vector3::new(self.normal(), self.normal(), self.normal())
    }

    fn place(&mut self) -> Point3<f64> {
        Point3::new(self.uniform(-4.0, 4.0), self.uniform(-1.5, 1.5), self.uniform(2.0, 5.0))
    }

    /// The pixel and the depth that a camera sees.
    fn seen(&mut self, in_camera: &Point3<f64>) -> Option<(Point2<f64>, f64)> {
        let pixel = CAMERA.project(in_camera).filter(|pixel| CAMERA.contains(pixel))?;
        let off = NOISE_PX * nalgebra::Vector2::new(self.normal(), self.normal());
        let depth_m = in_camera.z + NOISE_AT_1_M * in_camera.z.powi(2) * self.normal();
        Some((pixel + off, depth_m))
    }
}

/// A wall that keyframes go along; everything but the first two of them is off by centimetres.
fn bundle() -> Bundle {
    let mut draw = Draw(Random::new(1));
    let points: Vec<Point3<f64>> = (0..POINTS).map(|_| draw.place()).collect();
    let lines: Vec<[Point3<f64>; 2]> = (0..LINES)
        .map(|_| {
            let start = draw.place();
            [start, start + draw.off(0.4)]
        })
        .collect();
    let mut bundle = Bundle::default();
    for pose in 0..KEYFRAMES {
        let along_m = 0.15 * (pose as f64 - 0.5 * KEYFRAMES as f64);
        let truth = Isometry3::new(Vector3::new(-along_m, 0.0, 0.0), draw.off(0.05));
        for (landmark, place) in points.iter().enumerate() {
            let Some((pixel_px, depth_m)) = draw.seen(&(truth * place)) else { continue };
            let seen = PointObservation {
                point_in_map_m: *place,
                pixel_px,
                depth_m: Some(depth_m),
                pixel_std_dev_px: NOISE_PX,
                spread_px: Vector2::zeros(),
                depth_std_dev_m: NOISE_AT_1_M * depth_m * depth_m,
            };
            bundle.point_sightings.push(Sighting { pose, landmark, seen });
        }
        for (landmark, ends) in lines.iter().enumerate() {
            let [start, end] = ends.map(|end| draw.seen(&(truth * end)));
            let Some((start, end)) = start.zip(end) else { continue };
            let seen = LineObservation {
                start_in_map_m: ends[0],
                end_in_map_m: ends[1],
                start_px: start.0,
                end_px: end.0,
                pixel_std_dev_px: NOISE_PX,
                start_depth_m: Some(start.1),
                end_depth_m: Some(end.1),
                depth_std_dev_m: NOISE_AT_1_M * start.1.max(end.1).powi(2),
            };
            bundle.line_sightings.push(Sighting { pose, landmark, seen });
        }
        let is_fixed = pose < 2;
        let off = if is_fixed {
            Isometry3::identity()
        } else {
            Isometry3::new(draw.off(0.02), draw.off(0.005))
        };
        bundle.poses.push(BundlePose { camera: CAMERA, camera_from_map: off * truth, is_fixed });
    }
    bundle.points_m = points.iter().map(|place| place + draw.off(0.02)).collect();
    bundle.lines_m = lines.iter().map(|ends| ends.map(|end| end + draw.off(0.02))).collect();
    bundle
}

fn benches(criterion: &mut Criterion) {
    let bundle = bundle();
    let mut group = criterion.benchmark_group("bundle");
    group.sample_size(20);
    let name = format!(
        "{KEYFRAMES} keyframes, {POINTS} points seen {} times, {LINES} lines seen {} times",
        bundle.point_sightings.len(),
        bundle.line_sightings.len()
    );
    group.bench_function(name, |bench| {
        bench.iter(|| black_box(adjust(&bundle, &BundleConfig::default(), &|| false).unwrap()));
    });
    let once =
        BundleConfig { first_iterations: 1, second_iterations: 0, ..BundleConfig::default() };
    group.bench_function("one step of it", |bench| {
        bench.iter(|| black_box(adjust(&bundle, &once, &|| false).unwrap()));
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
