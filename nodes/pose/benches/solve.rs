//! How long the pose of a frame takes: `cargo bench -p pose --bench solve`.
// A benchmark may stop where it stands, and exports nothing.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use estimation::Random;
use geometry::{CameraModel, Distortion};
use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
use pose::solve::p3p::p3p;
use pose::solve::{
    LineObservation, PointObservation, PoseGuess, RansacConfig, RefineConfig, RigidSetsConfig,
    pnp_ransac, refine_pose, rigid_alignment, split_rigid_sets,
};

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

    fn pixel(&mut self) -> Point2<f64> {
        Point2::new(self.uniform(0.0, 639.0), self.uniform(0.0, 479.0))
    }

    fn place(&mut self) -> Point3<f64> {
        let (pixel, depth_m) = (self.pixel(), self.uniform(1.0, 5.0));
        let ray = CAMERA.ray(&pixel).unwrap();
        Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m)
    }

    fn seen(&mut self, place: &Point3<f64>) -> Point2<f64> {
        let (x, y) = (place.x / place.z, place.y / place.z);
        let exact = Point2::new(CAMERA.fx_px * x + CAMERA.cx_px, CAMERA.fy_px * y + CAMERA.cy_px);
        exact + NOISE_PX * nalgebra::Vector2::new(self.normal(), self.normal())
    }
}

/// Points, of which the first share is seen anywhere. The map's frame is the camera's.
fn points(count: usize, outliers: f64, with_depth: bool) -> Vec<PointObservation> {
    let mut draw = Draw(Random::new(3));
    let wrong = (outliers * count as f64) as usize;
    (0..count)
        .map(|index| {
            let place = draw.place();
            let depth_std_dev_m = NOISE_AT_1_M * place.z.powi(2);
            let noisy_m = place.z + depth_std_dev_m * draw.normal();
            let (pixel_px, depth_m) = if index < wrong {
                (draw.pixel(), draw.uniform(1.0, 5.0))
            } else {
                (draw.seen(&place), noisy_m)
            };
            PointObservation {
                point_in_map_m: place,
                pixel_px,
                depth_m: with_depth.then_some(depth_m),
                pixel_std_dev_px: NOISE_PX,
                spread_px: Vector2::zeros(),
                depth_std_dev_m,
            }
        })
        .collect()
}

fn lines(count: usize, with_depth: bool) -> Vec<LineObservation> {
    let mut draw = Draw(Random::new(4));
    (0..count)
        .map(|_| {
            let (start, end) = (draw.place(), draw.place());
            LineObservation {
                start_in_map_m: start,
                end_in_map_m: end,
                start_px: draw.seen(&start),
                end_px: draw.seen(&end),
                pixel_std_dev_px: NOISE_PX,
                start_depth_m: with_depth.then_some(start.z),
                end_depth_m: with_depth.then_some(end.z),
                depth_std_dev_m: NOISE_AT_1_M * start.z.max(end.z).powi(2),
            }
        })
        .collect()
}

fn solve(criterion: &mut Criterion) {
    let off = Isometry3::new(Vector3::new(0.02, -0.01, 0.02), Vector3::new(0.01, 0.01, -0.005));
    let guess = PoseGuess { camera_from_map: off, covariance: None };
    for outliers in [0.0, 0.2, 0.5] {
        let (points, lines) = (points(500, outliers, true), lines(150, true));
        let config = RefineConfig::default();
        let found = refine_pose(&CAMERA, &guess, &points, &lines, &config).unwrap();
        let name = format!(
            "refine, 500 points, 150 lines, {outliers} outliers ({} rounds, {} steps)",
            found.rounds, found.iterations
        );
        criterion.bench_function(&name, |bencher| {
            bencher.iter(|| refine_pose(&CAMERA, black_box(&guess), &points, &lines, &config));
        });
    }
    for (with_depth, solver) in [(true, "alignment"), (false, "P3P")] {
        for outliers in [0.5, 0.7] {
            let points = points(300, outliers, with_depth);
            let (config, refine) = (RansacConfig::default(), RefineConfig::default());
            let found = pnp_ransac(&CAMERA, &points, &config, &refine).unwrap();
            let name = format!(
                "RANSAC by {solver}, 300 points, {outliers} outliers ({} samples)",
                found.iterations
            );
            criterion.bench_function(&name, |bencher| {
                bencher.iter(|| pnp_ransac(&CAMERA, black_box(&points), &config, &refine));
            });
        }
    }
    let three = points(3, 0.0, true);
    let in_map = [0, 1, 2].map(|index| three[index].point_in_map_m);
    let rays = [0, 1, 2].map(|index| CAMERA.ray(&three[index].pixel_px).unwrap().push(1.0));
    criterion.bench_function("P3P", |bencher| bencher.iter(|| p3p(black_box(&in_map), &rays)));
    criterion.bench_function("alignment of 3 points", |bencher| {
        bencher.iter(|| rigid_alignment(black_box(&in_map), &in_map));
    });
    // Six of ten points lie on something that has moved 5 cm.
    let mut moved = points(300, 0.0, true);
    moved[..180].iter_mut().for_each(|point| point.point_in_map_m.x += 0.05);
    let covariance = nalgebra::Matrix6::identity() * 1e-5;
    let prediction =
        PoseGuess { camera_from_map: Isometry3::identity(), covariance: Some(covariance) };
    let (config, refine) = (RigidSetsConfig::default(), RefineConfig::default());
    criterion.bench_function("split of 300 points, 180 of them on a moving thing", |bencher| {
        bencher.iter(|| {
            split_rigid_sets(&CAMERA, Some(&prediction), black_box(&moved), &[], &config, &refine)
        });
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = solve
}
criterion_main!(benches);
