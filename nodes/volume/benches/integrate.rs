//! Benchmark: the integration of a depth image of 640 x 480 at voxel edges of 1 to 10 cm: `cargo bench -p volume`.
//!
//! And of the mesh: of all blocks, and of those that an image has changed, as `mesh` of the node has it.
//!
//! The camera moves 1 cm an image through a furnished room, with the noise of a Kinect.
// A benchmark may panic, and exports nothing.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use estimation::executor::Serial;
use geometry::{CameraModel, DepthImage, DepthPixels, Distortion, Stamp};
use nalgebra::{Isometry3, Point3, Vector3};
use volume::{
    DepthInput, DepthNoise, DepthRange, DepthView, MeshFollower, PointRules, Surface, SurfaceConfig,
};

const CAMERA: CameraModel = CameraModel {
    width_px: 640,
    height_px: 480,
    fx_px: 525.0,
    fy_px: 525.0,
    cx_px: 319.5,
    cy_px: 239.5,
    distortion: Distortion::None,
};
/// The number of images of the camera's path; then it goes back.
const IMAGES: usize = 30;

/// As many triangles as the node of the map has in a message.
const MESSAGE_TRIANGLES: usize = 1_000;

/// The depth of a ray from a position in the room, which has five walls, two boxes and a ball.
fn depth_m(from: &Point3<f64>, ray: &Vector3<f64>) -> f64 {
    let planes = [
        ([0.18, 0.0, 1.0], 3.95),
        ([-1.0, 0.0, 0.05], 1.6),
        ([1.0, 0.0, 0.08], 1.9),
        ([0.0, 1.0, 0.02], 1.15),
        ([0.0, -1.0, 0.0], 1.35),
    ];
    let planes = planes.map(|(normal, offset)| {
        let normal = Vector3::from(normal);
        (offset - normal.dot(&from.coords)) / normal.dot(ray)
    });
    let boxes = [([-1.3, 0.3, 2.2], [-0.6, 1.15, 2.9]), ([0.7, 0.0, 2.6], [1.4, 1.15, 3.2])];
    let boxes = boxes.map(|(least, most)| {
        let [a, b] = [least, most].map(|corner| (Point3::from(corner) - from).component_div(ray));
        let (enters, leaves) = (a.inf(&b).max(), a.sup(&b).min());
        if enters < leaves { enters } else { f64::INFINITY }
    });
    let (from_ball, radius_m) = (from - Point3::new(-0.9, 0.05, 2.5), 0.25);
    let (a, b) = (ray.norm_squared(), ray.dot(&from_ball));
    let root = b * b - a * (from_ball.norm_squared() - radius_m * radius_m);
    let ball = if root > 0.0 { (-b - root.sqrt()) / a } else { f64::INFINITY };
    let depths = planes.into_iter().chain(boxes).chain([ball]);
    depths.filter(|depth_m| *depth_m > 0.2).fold(f64::INFINITY, f64::min)
}

fn images() -> Vec<(DepthImage, Isometry3<f64>)> {
    let mut seed = 1_u64;
    let mut noise = || {
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 40) as f64 / f64::from(1 << 24)
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    };
    (0..IMAGES)
        .map(|index| {
            let along_m = 0.01 * index as f64;
            let pose = Isometry3::translation(along_m, 0.0, along_m);
            let from = Point3::new(along_m, 0.0, along_m);
            let pixels = (0..480).flat_map(|row| (0..640).map(move |column| (column, row)));
            let values = pixels.map(|(column, row)| {
                let x = (f64::from(column) - CAMERA.cx_px) / CAMERA.fx_px;
                let y = (f64::from(row) - CAMERA.cy_px) / CAMERA.fy_px;
                let depth_m = depth_m(&from, &Vector3::new(x, y, 1.0));
                ((depth_m + 1.4e-3 * depth_m * depth_m * noise()) * 1e3).round() as u16
            });
            let pixels = DepthPixels::Millimetres(values.collect());
            let stamp = Stamp::default().plus_seconds(0.1 * index as f64);
            (DepthImage::new(stamp, "camera".into(), (640, 480), pixels).unwrap(), pose)
        })
        .collect()
}

fn view() -> DepthView {
    DepthView::new(DepthRange { min_m: 0.2, max_m: 6.0 }, DepthNoise::default()).unwrap()
}

fn fill(view: &mut DepthView, (image, pose): &(DepthImage, Isometry3<f64>), colour: &[[u8; 3]]) {
    let colour = (!colour.is_empty()).then_some(colour);
    let (camera, map_from_camera) = (&CAMERA, pose);
    view.fill(&DepthInput { image, is_moving: None, colour, camera, map_from_camera }).unwrap();
}

fn integrate(criterion: &mut Criterion) {
    let images = images();
    let grey = vec![[128; 3]; 640 * 480];
    let mut view = view();
    criterion.bench_function("preparation", |bencher| {
        let mut images = images.iter().cycle();
        bencher.iter(|| fill(&mut view, images.next().unwrap(), &[]));
    });
    let mut group = criterion.benchmark_group("surface");
    group.sample_size(15);
    for has_colour in [false, true] {
        let colour: &[[u8; 3]] = if has_colour { &grey } else { &[] };
        for edge_m in [0.10, 0.08, 0.05, 0.03, 0.02, 0.01] {
            let config =
                SurfaceConfig { edge_m, reach_m: 6.0, has_colour, ..SurfaceConfig::default() };
            let mut surface = Surface::new(config).unwrap();
            let mut images = images.iter().cycle();
            let name = if has_colour { "coloured image" } else { "image" };
            let id = BenchmarkId::new(name, format!("{edge_m} m"));
            group.bench_function(id, |bencher| {
                bencher.iter(|| {
                    fill(&mut view, images.next().unwrap(), colour);
                    surface.integrate(&view, &Serial)
                });
            });
            if !has_colour {
                group.bench_function(
                    BenchmarkId::new("points", format!("{edge_m} m")),
                    |bencher| {
                        bencher.iter(|| surface.points(PointRules::default()).len());
                    },
                );
            }
        }
    }
    group.finish();
}

fn mesh(criterion: &mut Criterion) {
    let images = images();
    let mut view = view();
    let mut group = criterion.benchmark_group("mesh");
    for edge_m in [0.05, 0.03, 0.02] {
        let config = SurfaceConfig { edge_m, reach_m: 6.0, ..SurfaceConfig::default() };
        let mut surface = Surface::new(config).unwrap();
        let mut follower = MeshFollower::default();
        let mut images = images.iter().cycle();
        group.bench_function(BenchmarkId::new("blocks of an image", edge_m), |bencher| {
            bencher.iter_custom(|iterations| {
                let mut took = Duration::ZERO;
                for _ in 0..iterations {
                    fill(&mut view, images.next().unwrap(), &[]);
                    surface.integrate(&view, &Serial);
                    let start = Instant::now();
                    follower.follow(&surface);
                    while follower.waiting() > 0 {
                        let most = MESSAGE_TRIANGLES;
                        black_box(follower.take(&surface, PointRules::default(), most));
                    }
                    took += start.elapsed();
                }
                took
            });
        });
        group.bench_function(BenchmarkId::new("all blocks", edge_m), |bencher| {
            bencher.iter(|| surface.mesh(PointRules::default()).triangles.len());
        });
    }
    group.finish();
}

criterion_group!(benches, integrate, mesh);
criterion_main!(benches);
